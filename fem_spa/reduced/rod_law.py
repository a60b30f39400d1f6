"""What one chamber's pressure does to the rod, as a table: from FE or bench, in place of (14)-(26).

The table is of one chamber alone in an unloaded piece of the arm: at each pressure the curvature that it
gives (away from the chamber) and the axial strain. Between the rows the monotone cubic of Fritsch and
Carlson (SIAM J. Numer. Anal. 17, 1980) runs, which has a continuous derivative and no overshoot; beyond the
rows the end slopes go on. Chambers superpose: curvatures as vectors, strains as numbers.

A CSV file has the columns `pressure [kPa]`, `curvature [1/m]`, `stretch` (axial strain, 0.1 for 10 %) and,
before its header, optional lines `# bending stiffness: 0.07 N*m^2`, `# axial stiffness: 300 N`,
`# source: ...`.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.errors import InputError
from fem_spa.reduced.tables import amount
from fem_spa.units import ATMOSPHERE, brief
from materials.bounded import MOST_ROWS, read_text

COLUMNS = {"pressure": "kPa", "curvature": "1/m", "stretch": ""}
STIFFNESS = {"bending_stiffness": "N*m^2", "axial_stiffness": "N"}


@dataclass(frozen=True, eq=False)
class RodLaw:
    """Actuation of one chamber.

    Attributes
    ----------
    pressure : (m,) Pa gauge, increasing, m >= 2
    curvature : (m,) 1/m of the rest length, positive away from the chamber
    stretch : (m,) axial strain of the centre line
    bending_stiffness, axial_stiffness : N m^2 and N of the whole section, or None to keep E I and E A
    source : deck or file that it is from

    Raises
    ------
    InputError : rows that do not increase in pressure, are not finite or fewer than two
    """

    pressure: np.ndarray
    curvature: np.ndarray
    stretch: np.ndarray
    bending_stiffness: float | None = None
    axial_stiffness: float | None = None
    source: str = ""

    def __post_init__(self) -> None:
        columns = [np.asarray(c, float) for c in (self.pressure, self.curvature, self.stretch)]
        if len({c.shape for c in columns}) != 1 or columns[0].ndim != 1 or columns[0].size < 2:
            raise InputError(
                "a rod's law needs pressure, curvature and stretch, as many of each, at least two"
            )
        if not all(np.all(np.isfinite(c)) for c in columns) or np.any(np.diff(columns[0]) <= 0):
            raise InputError(
                "a rod's law needs pressures that increase and numbers that are finite; sort the rows"
            )
        if np.any(columns[2] <= -0.9):
            raise InputError("a rod's law has a stretch below -0.9; stretch is axial strain, 0.1 for 10 %")
        for name in STIFFNESS:
            given = getattr(self, name)
            if given is not None and not (np.isfinite(given) and given > 0):
                raise InputError(f"given {given} for {name} of a rod's law: a positive number is needed")
        for name, column in zip(COLUMNS, columns, strict=True):
            object.__setattr__(self, name, column)

    @cached_property
    def _curves(self) -> tuple[Any, Any]:
        from scipy.interpolate import PchipInterpolator

        return tuple(PchipInterpolator(self.pressure, y) for y in (self.curvature, self.stretch))  # type: ignore[return-value]

    def at(self, pressure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Curvature (1/m) and axial strain at pressures (Pa) of any shape."""
        p = np.asarray(pressure, float)
        inside = np.clip(p, self.pressure[0], self.pressure[-1])
        curvature, stretch = (curve(inside) for curve in self._curves)
        if np.any(p != inside):
            slopes = self.slope(inside)
            curvature = curvature + slopes[0] * (p - inside)
            stretch = stretch + slopes[1] * (p - inside)
        return curvature, stretch

    def slope(self, pressure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of `at` by pressure: 1/(m Pa) and 1/Pa."""
        inside = np.clip(np.asarray(pressure, float), self.pressure[0], self.pressure[-1])
        curvature, stretch = (curve(inside, 1) for curve in self._curves)
        return curvature, stretch

    def table(self) -> dict[str, Any]:
        """As a model file stores it, to be read back by `read_law`."""
        rows: dict[str, Any] = {
            "pressure": [f"{p / 1e3:.12g} kPa" for p in self.pressure],
            "curvature": [f"{c:.12g} 1/m" for c in self.curvature],
            "stretch": [float(s) for s in self.stretch],
        }
        for name, unit in STIFFNESS.items():
            if getattr(self, name) is not None:
                rows[name] = f"{getattr(self, name):.12g} {unit}"
        return rows | ({"source": self.source} if self.source else {})


def from_loads(
    pressure: np.ndarray,
    moment: np.ndarray,
    force: np.ndarray,
    bending_stiffness: float,
    axial_stiffness: float,
    source: str = "",
) -> RodLaw:
    """The law from what a held piece gives, (17)-(19): one chamber's moment (m,) N m, axial force (m,) N."""
    curvature, stretch = np.asarray(moment) / bending_stiffness, np.asarray(force) / axial_stiffness
    return RodLaw(pressure, curvature, stretch, bending_stiffness, axial_stiffness, source)


def read_law(given: Any, where: Path) -> RodLaw:
    """The law of a model file: a table as `RodLaw.table` writes it, or a CSV file beside the model."""
    if isinstance(given, str):
        return _read_csv(where / given)
    if not isinstance(given, Mapping):
        raise InputError(
            f"given {brief(given)} for model.law: a CSV file or a table of pressure, curvature, stretch"
        )
    allowed = [*COLUMNS, *STIFFNESS, "source"]
    for key in given:
        if key not in allowed:
            raise InputError(f"given model.law.{key}: no such key; allowed are {', '.join(allowed)}")
    columns = []
    for name, unit in COLUMNS.items():
        cells = given.get(name)
        if not isinstance(cells, list):
            raise InputError(f"given {brief(cells)} for model.law.{name}: a list is needed")
        low = -ATMOSPHERE if name == "pressure" else -np.inf
        columns.append(np.array([amount(c, unit, f"model.law.{name}", low) for c in cells]))
    stiff = {
        name: amount(given[name], u, f"model.law.{name}") for name, u in STIFFNESS.items() if name in given
    }
    return _law(columns, stiff, str(given.get("source", "")))


def _read_csv(path: Path) -> RodLaw:
    """The law of a CSV file."""
    try:
        lines = read_text(path, MOST_ROWS, "utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"given {path}: the rod's law cannot be read ({type(error).__name__})") from None
    notes = dict(line[1:].split(":", 1) for line in lines if line.startswith("#") and ":" in line)
    notes = {key.strip().replace(" ", "_"): text.strip() for key, text in notes.items()}
    rows = list(csv.reader(line for line in lines if line.strip() and not line.startswith("#")))
    header = [cell.strip() for cell in rows[0]] if rows else []
    columns = []
    for name, unit in COLUMNS.items():
        found = [i for i, cell in enumerate(header) if cell.partition("[")[0].strip() == name]
        if not found:
            raise InputError(f"given {path}: no column '{f'{name} [{unit}]' if unit else name}'")
        written = header[found[0]].partition("[")[2].rstrip("] ")
        texts = [row[found[0]].strip() if found[0] < len(row) else "" for row in rows[1:]]
        where = f"{path.name}, {name}"
        if unit:
            columns.append(np.array([amount(f"{cell} {written}", unit, where) for cell in texts]))
        else:
            try:
                columns.append(np.array([float(cell) for cell in texts]))
            except ValueError:
                raise InputError(f"given {path}: a cell of {name} is not a number") from None
    stiff = {name: amount(notes[name], unit, name) for name, unit in STIFFNESS.items() if name in notes}
    return _law(columns, stiff, notes.get("source", path.name))


def _law(columns: list[np.ndarray], stiff: Mapping[str, float], source: str) -> RodLaw:
    bending, axial = (stiff.get(name) for name in STIFFNESS)
    return RodLaw(columns[0], columns[1], columns[2], bending, axial, source)
