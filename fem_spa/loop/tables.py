"""Responses of slow models as tables over pressure, so that a search may ask for them thousands of times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RegularGridInterpolator

POINTS = {1: 201, 2: 33, 3: 9}
"""Points an axis, by the number of pressures; on the arm's rod 9 are within 0.02 mm, with lines 1.9 mm."""
STIFFER = 0.25
"""Logarithm of the factor by which the stiffness of the outer tables differs."""
Settled = Callable[[np.ndarray, float], np.ndarray]


@dataclass(frozen=True)
class Table:
    """Response over pressures (cubic splines) and the logarithm of a stiffness factor (quadratic).

    Attributes
    ----------
    table : pressures (n, m) -> (n, states, d), states being softer, as it is, stiffer; or one state
    low, high : (m,) Pa, its edges
    """

    table: RegularGridInterpolator
    low: np.ndarray
    high: np.ndarray

    def __call__(self, pressure: np.ndarray, stiffer: float) -> np.ndarray:
        """(n, d) at pressures (n, m) Pa; beyond the table its edge's slope goes on."""
        inside = np.clip(pressure, self.low, self.high)
        beyond = pressure - inside
        far = np.nonzero(beyond.any(axis=1))[0]
        found = self.table(inside)
        for j in range(len(self.low) if len(far) else 0):
            slope = self.table(inside[far], nu=[int(i == j) for i in range(len(self.low))])
            found[far] += slope * beyond[far, j, None, None]
        if found.shape[1] == 1:
            return np.asarray(found[:, 0])
        x = stiffer / STIFFER
        return np.asarray(found.transpose(0, 2, 1) @ [0.5 * x * (x - 1.0), 1.0 - x * x, 0.5 * x * (x + 1.0)])


def tabulate(settled: Settled, low: np.ndarray, high: np.ndarray, stiffness: bool) -> Table:
    """Tables of `settled` (pressures (n, m), log stiffness factor) -> (n, d) between `low` and `high`
    (m,)."""
    m = len(low)
    axes = [np.linspace(a, b, POINTS.get(m, 6)) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, m)
    shape = tuple(len(axis) for axis in axes)
    states = (-STIFFER, 0.0, STIFFER) if stiffness else (0.0,)
    values = np.stack([settled(points, stiffer) for stiffer in states], axis=1)
    return Table(
        RegularGridInterpolator(axes, values.reshape(*shape, *values.shape[1:]), method="cubic"), low, high
    )


def reach(p_low: np.ndarray, p_high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axes of a table for what the records reach: a fifth beyond, zero included, never a vacuum that is
    none."""
    low, high = np.minimum(p_low, 0.0), np.maximum(p_high, 0.0)
    top = float(np.max(high - low)) or 1.0
    high = np.maximum(high, 0.1 * top)
    return np.where(low < 0.0, np.maximum(1.2 * low, -9.5e4), low), high + 0.2 * top
