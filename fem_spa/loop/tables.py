"""Responses of slow models as tables over pressure, so that a search may ask for them thousands of times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RegularGridInterpolator

POINTS = {1: 201, 2: 33, 3: 11}
"""Points an axis, by the number of pressures."""
STIFFER = 0.25
"""Logarithm of the factor by which the stiffness of the outer tables differs."""
Settled = Callable[[np.ndarray, float], np.ndarray]


@dataclass(frozen=True)
class Table:
    """Response over pressures and the logarithm of a stiffness factor, quadratic in the latter."""

    tables: tuple[RegularGridInterpolator, ...]
    low: np.ndarray
    high: np.ndarray

    def __call__(self, pressure: np.ndarray, stiffer: float) -> np.ndarray:
        """(n, d) at pressures (n, m) Pa; beyond the table its edge's slope goes on."""
        values = [table(pressure) for table in self.tables]
        if len(values) == 1:
            return np.asarray(values[0])
        soft, middle, stiff = values
        x = stiffer / STIFFER
        return np.asarray(middle + 0.5 * x * (stiff - soft) + 0.5 * x * x * (stiff - 2.0 * middle + soft))


def tabulate(settled: Settled, low: np.ndarray, high: np.ndarray, stiffness: bool) -> Table:
    """Tables of `settled` (pressures (n, m), log stiffness factor) -> (n, d) between `low` and `high`
    (m,)."""
    m = len(low)
    axes = [np.linspace(a, b, POINTS.get(m, 6)) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, m)
    shape = tuple(len(axis) for axis in axes)
    tables = []
    for stiffer in (-STIFFER, 0.0, STIFFER) if stiffness else (0.0,):
        values = settled(points, stiffer).reshape(*shape, -1)
        tables.append(RegularGridInterpolator(axes, values, bounds_error=False, fill_value=None))
    return Table(tuple(tables), low, high)


def reach(p_low: np.ndarray, p_high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axes of a table for what the records reach: a fifth beyond, zero included, never a vacuum that is
    none."""
    low, high = np.minimum(p_low, 0.0), np.maximum(p_high, 0.0)
    top = float(np.max(high - low)) or 1.0
    high = np.maximum(high, 0.1 * top)
    return np.where(low < 0.0, np.maximum(1.2 * low, -9.5e4), low), high + 0.2 * top
