"""Several chambers: one that does more than the others, one that moves what only its neighbour is asked."""

from __future__ import annotations

import numpy as np

from fem_spa.loop.signatures.shapes import together
from fem_spa.loop.signatures.statistic import Contrast, Seen, Statistic

MORE = 0.02
"""Share of a pressure whose answer is taken for linear."""
ONE = "one pressure only"


def _changed(seen: Seen, gains: np.ndarray) -> np.ndarray:
    """(n, d) answer of the base to more pressure, by (n, m) Pa per unit, a per cent."""
    pressure = seen.context.data.pressure
    return np.asarray((seen.respond(pressure + MORE * gains) - seen.response) * (0.01 / MORE))


def _gains(seen: Seen) -> list[np.ndarray]:
    pressure = seen.context.data.pressure
    return [_changed(seen, pressure * row) for row in np.eye(pressure.shape[1])]


def one(seen: Seen) -> tuple[Contrast, ...] | str:
    """Each chamber against all together."""
    pressure = seen.context.data.pressure
    if pressure.shape[1] < 2:
        return ONE
    columns = _gains(seen)
    beside, record = together(np.sum(columns, axis=0)), seen.record
    return tuple(Contrast(c, beside, record, f"chamber {j + 1}") for j, c in enumerate(columns))


def neighbours(seen: Seen) -> tuple[Contrast, ...] | str:
    """Part of the others' pressure in each chamber, or of the product; own gains put aside."""
    pressure = seen.context.data.pressure
    if pressure.shape[1] < 2:
        return ONE
    others = (pressure.sum(axis=1, keepdims=True) - pressure) / (pressure.shape[1] - 1)
    beside, record = together(*_gains(seen)), seen.record
    return (
        Contrast(_changed(seen, others), beside, record, "of the others"),
        Contrast(_changed(seen, pressure * others / seen.context.p_max), beside, record, "with the others"),
    )


CHAMBER = Statistic("gain of one chamber against the others", 0, one, "%")
NEIGHBOURS = Statistic("pressure that acts in the neighbouring chambers", 1, neighbours, "%")
