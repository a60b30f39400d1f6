"""Folds for cross-validation among the training rows: whole records, or blocks of them where there are
few."""

from __future__ import annotations

import numpy as np

from fem_spa.loop.data import Data

FEWEST = 3
"""Below this many training records, each is cut into blocks."""


def folds(data: Data) -> list[np.ndarray]:
    """Row indices of each fold; together all training rows."""
    parts = [np.arange(r.part.start, r.part.stop) for r in data.runs if r.train]
    if len(parts) >= FEWEST:
        return parts
    return [block for part in parts for block in np.array_split(part, 6 // len(parts))]


def blocks(data: Data, count: int = 3) -> list[np.ndarray]:
    """Row indices of parts of the training records: what runs through the session is interpolated between
    them."""
    parts = [np.arange(r.part.start, r.part.stop) for r in data.runs if r.train]
    return [block for part in parts for block in np.array_split(part, count)]


def by_records(data: Data) -> bool:
    """Whether a fold is a whole record."""
    return sum(r.train for r in data.runs) >= FEWEST
