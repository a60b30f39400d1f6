"""Kind "surface": a static map from several pressures to one output, over a grid of pressures, from FE say.

    [model]
    kind = "surface"
    pressures = [[0, 20, 40], [0, 10, 20]]     # kPa, the grid of each chamber, at least 3 points
    output = "angle"
    values = [0, 4.1, ...]                     # deg, mm or N; the last chamber's pressure runs fastest
    gain = 1.0
    offset = "0 deg"

Between the points splines of third order (second, where a chamber has three) run; beyond them the slopes at
the edge go on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from scipy.interpolate import NdBSpline, make_interp_spline

from fem_spa.errors import InputError
from fem_spa.reduced.checks import check_drive
from fem_spa.reduced.curve import UNITS
from fem_spa.reduced.model import Drive, Output, Parameter, Range
from fem_spa.reduced.tables import changed, common_table, factor, read_parameters, read_valid, refuse_unknown
from fem_spa.units import brief

FEWEST = 3


@dataclass(frozen=True, eq=False)
class Surface:
    """A static map.

    Attributes
    ----------
    grid : a chamber each, (k,) Pa increasing
    values : (k1, k2, ...) in the output's SI unit
    parameters : `gain` and `offset` of the output: gain * map + offset
    """

    grid: tuple[np.ndarray, ...]
    values: np.ndarray
    outputs: tuple[Output, ...]
    parameters: Mapping[str, Parameter]
    valid: Range | None = None
    kind: str = "surface"

    @property
    def chambers(self) -> int:
        """One an axis of the grid."""
        return len(self.grid)

    def with_values(self, **values: float) -> Self:
        """A copy with another gain or offset (SI)."""
        return replace(self, parameters=changed(self.parameters, values, self.kind))

    def simulate(self, drive: Drive) -> np.ndarray:
        """(n, 1), the output at each row of pressures; no memory."""
        _, pressure = check_drive(drive, self.chambers, self.kind)
        return self.at(pressure)[:, None]

    def at(self, pressure: np.ndarray) -> np.ndarray:
        """(n,) output in SI at pressures (n, chambers) Pa."""
        low = np.array([axis[0] for axis in self.grid])
        high = np.array([axis[-1] for axis in self.grid])
        inside = np.clip(pressure, low, high)
        found = np.array(self._spline(inside))
        beyond = pressure - inside
        far = np.nonzero(beyond.any(axis=1))[0]
        for j in range(self.chambers if len(far) else 0):
            nu = [int(i == j) for i in range(self.chambers)]
            found[far] += self._spline(inside[far], nu=nu) * beyond[far, j]
        return np.asarray(self.parameters["gain"].value * found + self.parameters["offset"].value)

    @cached_property
    def _spline(self) -> NdBSpline:
        coefficients, knots, orders = self.values, [], []
        for j, axis in enumerate(self.grid):
            order = min(3, len(axis) - 1)
            one = make_interp_spline(axis, np.moveaxis(coefficients, j, 0), k=order)
            coefficients = np.moveaxis(one.c, 0, j)
            knots.append(one.t)
            orders.append(order)
        return NdBSpline(tuple(knots), np.ascontiguousarray(coefficients), tuple(orders))

    def table(self) -> dict[str, Any]:
        """The `[model]` table, points included."""
        output = self.outputs[0]
        short = [[float(f"{p / 1e3:.10g}") for p in axis] for axis in self.grid]
        values = [float(f"{v / factor(output.unit):.10g}") for v in self.values.ravel()]
        given = {"output": output.name, "pressures": short, "values": values}
        return common_table(self.kind, self.parameters, self.valid, self.outputs) | given


def surface(
    grid: Sequence[np.ndarray], values: np.ndarray, name: str, source: str, valid: Range | None = None
) -> Surface:
    """A map of points: `grid` in Pa a chamber, `values` (k1, k2, ...) in SI of output `name`.

    Raises
    ------
    InputError : too few points, pressures that do not increase, values that are not finite or too few
    """
    axes = tuple(np.asarray(axis, float) for axis in grid)
    shape = tuple(len(axis) for axis in axes)
    if any(len(axis) < FEWEST or not (np.diff(axis) > 0).all() for axis in axes):
        raise InputError(f"given a grid of {shape} pressures: at least {FEWEST} a chamber, increasing")
    numbers = np.asarray(values, float)
    if numbers.size != np.prod(shape) or not np.isfinite(numbers).all():
        raise InputError(f"given {numbers.size} values for a grid of {shape}: one a point is needed, finite")
    if name not in UNITS:
        raise InputError(f"given {brief(name)} for model.output: allowed are {', '.join(UNITS)}")
    unit = UNITS[name]
    size = factor(unit)
    parameters = {
        "gain": Parameter(1.0, "", 1e-3, 1e3),
        "offset": Parameter(0.0, unit, -1e3 * size, 1e3 * size),
    }
    valid = valid or Range(tuple(float(a[0]) for a in axes), tuple(float(a[-1]) for a in axes), source=source)
    return Surface(axes, numbers.reshape(shape), (Output(name, unit),), parameters, valid)


def read(table: Mapping[str, Any], where: Path) -> Surface:
    """The model of a `[model]` table; `where` is not used, there are no files."""
    refuse_unknown(table, ("pressures", "output", "values", "gain", "offset"))
    name = str(table.get("output", "angle"))
    try:
        grid = [1e3 * np.array(axis, float) for axis in table["pressures"]]
        values = np.array(table["values"], float) * factor(UNITS.get(name, "deg"))
    except (KeyError, TypeError, ValueError):
        raise InputError("kind 'surface' needs pressures, a list of numbers a chamber, and values") from None
    found = surface(grid, values, name, "the model file")
    valid = read_valid(table, found.outputs) or found.valid
    return replace(found, parameters=read_parameters(table, found.parameters), valid=valid)
