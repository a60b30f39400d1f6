"""Bricks of patterns: which way a motion goes, how late it is, hat functions, holds."""

from __future__ import annotations

import itertools

import numpy as np

from fem_spa.loop.data import Data
from fem_spa.loop.operators import lowpass, play
from fem_spa.loop.signatures.statistic import Seen

BACKLASH = 0.02
"""Share of the response that a motion must go before it counts as one in that direction."""
STILL = 1e-3
"""Share of the largest pressure within which a command stands."""


def each(columns: np.ndarray) -> np.ndarray:
    """(n, d, d k): columns (n, d, k) for every output of its own."""
    n, d, k = columns.shape
    out = np.zeros((n, d, d, k))
    for j in range(d):
        out[:, j, j] = columns[:, j]
    return out.reshape(n, d, d * k)


def together(*columns: np.ndarray) -> np.ndarray:
    """(n, d, k) of (n, d) or (n, d, k) columns."""
    return np.concatenate([c[:, :, None] if c.ndim == 2 else c for c in columns], axis=2)


def none(seen: Seen) -> np.ndarray:
    """(n, d, 0)"""
    return np.zeros((*seen.response.shape, 0))


def weight(seen: Seen) -> np.ndarray:
    """(d,) outputs by how far they go, the farthest one."""
    return np.asarray(seen.scale / seen.scale.max())


def direction(seen: Seen) -> np.ndarray:
    """(n, d) +1 where the response rises, -1 where it falls, and on the way between them after a turn."""
    data, s = seen.context.data, seen.share
    stops = [s[:, j] - play(data, s[:, j], BACKLASH) for j in range(s.shape[1])]
    return np.stack(stops, axis=1) / BACKLASH


def late(seen: Seen, tau: float) -> np.ndarray:
    """(n, d) share of the response by which a lag of `tau` (s) is behind."""
    s = seen.share
    return np.asarray(lowpass(seen.context.data, s, tau) - s)


def hats(seen: Seen, count: int = 7) -> np.ndarray:
    """(n, d, d count) hat functions of the response, output by output: any static curve."""
    s = seen.share
    rows = seen.rows
    low, high = s[rows].min(axis=0), s[rows].max(axis=0)
    place = np.clip((s - low) / np.maximum(high - low, 1e-12), 0.0, 1.0) * (count - 1)
    return each(np.maximum(1.0 - np.abs(place[:, :, None] - np.arange(count)), 0.0))


def powers(seen: Seen, most: int) -> np.ndarray:
    """(n, d, d (most - 1)) the response's square, cube ..., output by output: any smooth curve."""
    s = seen.share
    return each(np.stack([s**k for k in range(2, most + 1)], axis=2))


def holds(data: Data, pressure: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
    """(n,) number of the hold that a row is in, -1 outside, and (n,) s since it began; shorter ones left out.

    Parameters
    ----------
    pressure : (n, m) Pa
    least : s
    """
    label, since = np.full(len(pressure), -1), np.zeros(len(pressure))
    limit, count = STILL * data.p_max, 0
    for run in data.runs:
        moved = np.abs(np.diff(pressure[run.part], axis=0)).max(axis=1) > limit * min(run.step / 0.1, 1.0)
        edges = np.concatenate([[0], np.nonzero(moved)[0] + 1, [run.part.stop - run.part.start]])
        for a, b in itertools.pairwise(edges):
            if (b - a) * run.step >= least:
                rows = slice(run.part.start + a, run.part.start + b)
                label[rows], since[rows] = count, run.step * np.arange(b - a)
                count += 1
    return label, since
