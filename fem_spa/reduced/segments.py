"""Kind "segments": equal chambers in a row, each with its turn and stretch against pressure from FE.

    [model]
    kind = "segments"
    count = 6
    pitch = "7 mm"                 # length of one at rest
    stiffness = "0.012 N*m/rad"    # of one against bending
    mass = "3 g"                   # of one
    gain = 1.0                     # factor on the turn;  offset = "0 deg", of the angle
    base = "2 mm"                  # rigid length before the first;  tip = "2 mm", behind the last
    gravity = true                 # false: weightless, a payload too
    law = { pressure = ["0 kPa", "5 kPa"], turn = ["0 deg", "3 deg"], stretch = [0.0, 0.001] }

The law is that of one unloaded chamber; `fem_spa.calibration.segment` makes it from a short piece solved with
FE. A chamber is a joint in its middle: a load that leaves a moment M there turns it by M / stiffness besides.
Between the rows of the law the monotone cubic (PCHIP) runs, beyond them the end slopes go on.

The plane is that of a built-in finger: x along it, positive angles towards -z. `orientation` of a drive: 0
hangs down; at 90 deg the finger lies level and bends upwards.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from scipy.interpolate import PchipInterpolator

from fem_spa.errors import InputError
from fem_spa.reduced.chain_links import Links, loaded, places
from fem_spa.reduced.chain_statics import turns
from fem_spa.reduced.checks import check_drive
from fem_spa.reduced.model import Drive, Output, Parameter, Range
from fem_spa.reduced.tables import (
    amount,
    changed,
    common_table,
    read_parameters,
    read_valid,
    refuse_unknown,
    shown,
)
from fem_spa.units import ATMOSPHERE, brief

OUTPUTS = (Output("angle", "deg"), Output("x", "mm"), Output("z", "mm"))
GRAVITY = 9.80665
GRID = 129
"""Pressures solved where more are asked for; in between a cubic runs."""


@dataclass(frozen=True, eq=False)
class Segments:
    """A row of chambers.

    Attributes
    ----------
    law : (m, 3), Pa increasing, rad, axial strain: of one unloaded chamber
    count : how many
    gravity : whether weight acts
    """

    law: np.ndarray
    count: int
    parameters: Mapping[str, Parameter]
    gravity: bool = True
    valid: Range | None = None
    outputs: tuple[Output, ...] = OUTPUTS
    kind: str = "segments"
    chambers: int = 1

    def __post_init__(self) -> None:
        law = np.asarray(self.law, float)
        if law.ndim != 2 or law.shape[1] != 3 or len(law) < 2 or not np.all(np.isfinite(law)):
            raise InputError("a law of segments needs pressure, turn and stretch, two rows of each at least")
        if np.any(np.diff(law[:, 0]) <= 0):
            raise InputError("a law of segments needs pressures that increase; sort the rows")
        if not 1 <= self.count <= 1000:
            raise InputError(f"given {self.count} for model.count: allowed is 1 to 1000")

    def with_values(self, **values: float) -> Self:
        """A copy with other values in SI."""
        return replace(self, parameters=changed(self.parameters, values, self.kind))

    @cached_property
    def _curve(self) -> PchipInterpolator:
        return PchipInterpolator(self.law[:, 0], self.law[:, 1:])

    def at(self, pressure: np.ndarray) -> np.ndarray:
        """(n, 2): turn (rad) and stretch of one unloaded chamber at pressures (n,) Pa."""
        p = np.asarray(pressure, float)
        inside = np.clip(p, self.law[0, 0], self.law[-1, 0])
        return np.asarray(self._curve(inside) + self.slope(inside) * (p - inside)[:, None])

    def slope(self, pressure: np.ndarray) -> np.ndarray:
        """(n, 2): derivative of `at` by pressure, 1/Pa."""
        inside = np.clip(np.asarray(pressure, float), self.law[0, 0], self.law[-1, 0])
        return np.asarray(self._curve(inside, 1))

    def simulate(self, drive: Drive) -> np.ndarray:
        """(n, 3): angle in rad, x and z of the tip in m; no memory."""
        _, pressure = check_drive(drive, 1, self.kind)
        p, back = np.unique(pressure[:, 0], return_inverse=True)
        if len(p) <= GRID:
            return self.bent(p, drive.orientation, drive.payload)[back]
        grid = np.linspace(p[0], p[-1], GRID)
        return np.asarray(
            PchipInterpolator(grid, self.bent(grid, drive.orientation, drive.payload))(pressure[:, 0])
        )

    def bent(self, pressure: np.ndarray, orientation: float = 0.0, payload: float = 0.0) -> np.ndarray:
        """(n, 3): angle (rad), x and z of the tip (m) at pressures (n,) Pa under weights."""
        value = {name: p.value for name, p in self.parameters.items()}
        pull = GRAVITY * np.exp(-1j * orientation) if self.gravity else 0j
        out = np.empty((len(pressure), 3))
        for k, (turn, stretch) in enumerate(self.at(pressure)):
            links = loaded(self.links(float(stretch)), payload)
            torque = np.full((1, self.count), value["stiffness"] * value["gain"] * turn)
            q = turns(links, torque, complex(pull))
            joints, _ = places(links, q)
            end = complex(joints[0, -1])
            out[k] = float(q.sum()) + value["offset"], end.real, -end.imag
        return out

    def links(self, stretch: float) -> Links:
        """The chain at rest, every chamber `stretch` longer; joints in the chambers' middles."""
        value = {name: p.value for name, p in self.parameters.items()}
        pitch, n = value["pitch"] * (1.0 + stretch), self.count
        vector = np.full(n, pitch, dtype=complex)
        vector[-1] = 0.5 * pitch + value["tip"]
        ones = np.ones(n)
        centre = np.full(n, 0.5 * pitch, dtype=complex)
        mass = value["mass"] * ones
        # behind the last joint half a chamber is left; before the first the base holds the other half
        mass[-1], centre[-1] = 0.5 * mass[-1], 0.25 * pitch
        inertia = mass * pitch**2 / 12.0
        start = complex(value["base"] + 0.5 * pitch)
        return Links(start, vector, centre, mass, inertia, value["stiffness"] * ones, 0.0 * ones, ones)

    def table(self) -> dict[str, Any]:
        """The `[model]` table."""
        table = common_table(self.kind, self.parameters, self.valid, self.outputs)
        pressure, turn, stretch = self.law.T
        law = {
            "pressure": [shown(p, "kPa") for p in pressure],
            "turn": [shown(t, "deg") for t in turn],
            "stretch": [float(s) for s in stretch],
        }
        return table | {"count": self.count, "gravity": self.gravity, "law": law}


def segments(
    pressure: np.ndarray,
    turn: np.ndarray,
    stretch: np.ndarray,
    stiffness: float,
    count: int,
    pitch: float,
    mass: float = 0.0,
    source: str = "",
) -> Segments:
    """A row of chambers from the law of one: Pa, rad, axial strain, each (m,); N m/rad, m, kg."""
    law = np.column_stack([pressure, turn, stretch])
    given = {"stiffness": stiffness, "pitch": pitch, "mass": mass}
    numbers = {n: replace(p, value=given.get(n, p.value), source=source) for n, p in _PARAMETERS.items()}
    return Segments(law, count, numbers, valid=Range((float(law[0, 0]),), (float(law[-1, 0]),), None, source))


_PARAMETERS = {
    "pitch": Parameter(10e-3, "mm", 1e-4, 1.0),
    "stiffness": Parameter(1e-2, "N*m/rad", 1e-7, 1e4),
    "mass": Parameter(0.0, "g", 0.0, 10.0),
    "gain": Parameter(1.0, "", 0.2, 5.0),
    "offset": Parameter(0.0, "deg", -3.2, 3.2),
    "base": Parameter(0.0, "mm", 0.0, 1.0),
    "tip": Parameter(0.0, "mm", 0.0, 1.0),
}


def read(table: Mapping[str, Any], where: Path) -> Segments:
    """The model of a `[model]` table."""
    refuse_unknown(table, (*_PARAMETERS, "count", "gravity", "law"))
    for name in ("count", "pitch", "stiffness", "law"):
        if name not in table:
            raise InputError(f"given no model.{name}: kind 'segments' needs count, pitch, stiffness and law")
    count, gravity = table["count"], table.get("gravity", True)
    if isinstance(count, bool) or not isinstance(count, int):
        raise InputError(f"given {brief(count)} for model.count: a whole number is needed")
    if not isinstance(gravity, bool):
        raise InputError(f"given {brief(gravity)} for model.gravity: true or false is needed")
    numbers = read_parameters(table, _PARAMETERS)
    return Segments(_law(table["law"]), count, numbers, gravity, read_valid(table, OUTPUTS))


def _law(given: Any) -> np.ndarray:
    if not isinstance(given, Mapping) or set(given) != {"pressure", "turn", "stretch"}:
        raise InputError("model.law: a table of pressure, turn and stretch is needed, a list of each")
    columns: list[list[float]] = []
    for name, unit in (("pressure", "kPa"), ("turn", "deg"), ("stretch", "")):
        cells = given[name]
        if not isinstance(cells, Sequence) or isinstance(cells, str):
            raise InputError(f"given {brief(cells)} for model.law.{name}: a list is needed")
        low = -ATMOSPHERE if name == "pressure" else -np.inf
        columns.append([amount(cell, unit, f"model.law.{name}", low) for cell in cells])
    if len({len(column) for column in columns}) != 1:
        raise InputError("model.law: pressure, turn and stretch need as many values each")
    return np.array(columns).T
