"""The composite finger as the loop sees it: exact but for lines between the tabulated turns of its modules.

Its networks do not influence one another, and a stiffness divides the pressures: a table a network is all.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fem_spa.loop.base import Base
from fem_spa.loop.data import Data
from fem_spa.reduced.curvature import tip
from fem_spa.reduced.finger import Finger
from fem_spa.units import ATMOSPHERE

POINTS = 4001
STIFFER = 1.5
"""Largest logarithm of the factor on the stiffness."""


def finger_base(model: Any, columns: tuple[int, ...], p_low: np.ndarray, p_high: np.ndarray) -> Base:
    """The base of a `pneunet`; `stiffness` and an offset an output are refitted."""
    finger: Finger = model
    names = tuple(finger.outputs[j].name for j in columns)
    units = tuple(finger.outputs[j].unit for j in columns)
    low = np.maximum(np.minimum(p_low, 0.0) * 2.0, -0.95 * ATMOSPHERE)
    high = np.maximum(2.0 * p_high, 1e3)
    grids, turned = [], []
    for j, network in enumerate(finger.networks):
        grid = np.linspace(low[j], high[j], POINTS)
        grid = np.unique(np.append(grid, 0.0))
        pressure = np.zeros((len(grid), finger.chambers))
        pressure[:, j] = grid
        grids.append(grid)
        turned.append(finger.module_angles(pressure)[:, 0 if network == "slow" else 1])

    def respond(data: Data, pressure: np.ndarray, values: np.ndarray) -> np.ndarray:
        modules = np.zeros((len(pressure), 2))
        softened = pressure / np.exp(float(values[0]))
        for j, network in enumerate(finger.networks):
            modules[:, 0 if network == "slow" else 1] = np.interp(softened[:, j], grids[j], turned[j])
        given = {"angle": modules.sum(axis=1) + finger.parameters["offset"].value}
        if set(names) - {"angle"}:
            place = tip(*finger.chain(modules))
            given |= {axis: place[:, i] for i, axis in enumerate("xyz")}
        return np.stack([given[name] for name in names], axis=1)

    return Base(
        model,
        names,
        units,
        False,
        ("stiffness",),
        np.zeros(1),
        np.full(1, -STIFFER),
        np.full(1, STIFFER),
        respond,
        factor=True,
        together=("stiffness",),
    )
