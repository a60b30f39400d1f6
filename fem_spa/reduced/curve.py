"""Kind "curve": a static map from pressure to one output, from FE (`fem-spa solve`) or from anywhere.

    [model]
    kind = "curve"
    file = "curve.csv"        # `pressure [kPa]` and output columns, any unit
    output = "angle"          # default: the first known output that varies

Only the loading branch is used: from the first row on, the rows whose pressure goes beyond all before
them, up or down. So a record that comes back, or a snap through a limit point, gives a single-valued curve.
Between the points the map is the monotone piecewise cubic of Fritsch and Butland (PCHIP); beyond them it
goes on with the end's slope, and `checks.outside` says so.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from scipy.interpolate import PchipInterpolator

from fem_spa.errors import InputError
from fem_spa.reduced.checks import check_drive
from fem_spa.reduced.model import Drive, Output, Parameter, Range
from fem_spa.reduced.tables import (
    changed,
    common_table,
    factor,
    read_parameters,
    read_valid,
    refuse_unknown,
    same_kind,
)
from fem_spa.units import brief
from materials.bounded import MOST_ROWS, read_text

UNITS = {"angle": "deg", "displacement": "mm", "force": "N", "x": "mm", "y": "mm", "z": "mm"}
"""Outputs of records and the unit shown."""
ALIASES = {"extension": "displacement"}
"""Columns of `fem-spa solve` under another name."""
INNER = {"torque": "N*m"}
"""What models hold as curves besides."""
KEYS = ("file", "output", "columns", "rows")
_CELL = re.compile(r"\s*(.*?)\s*(?:\[(.*)\])?\s*")


@dataclass(frozen=True, eq=False)
class Curve:
    """A static map.

    Attributes
    ----------
    points : (n, 2), Pa and the output's SI unit, pressure increasing
    parameters : `gain` and `offset` of the output: gain * map + offset
    """

    points: np.ndarray
    outputs: tuple[Output, ...]
    parameters: Mapping[str, Parameter]
    valid: Range | None
    kind: str = "curve"
    chambers: int = 1

    def with_values(self, **values: float) -> Self:
        """A copy with another gain or offset (SI)."""
        return replace(self, parameters=changed(self.parameters, values, self.kind))

    def simulate(self, drive: Drive) -> np.ndarray:
        """(n, 1), the output at each pressure; no memory."""
        _, pressure = check_drive(drive, 1, self.kind)
        return self.at(pressure[:, 0])[:, None]

    def at(self, pressure: np.ndarray) -> np.ndarray:
        """Output in SI at pressures (any shape) in Pa."""
        gain, offset = self.parameters["gain"].value, self.parameters["offset"].value
        return gain * self._map(pressure, 0) + offset

    def slope(self, pressure: np.ndarray) -> np.ndarray:
        """Derivative of `at`, SI unit a Pa."""
        return self.parameters["gain"].value * self._map(pressure, 1)

    def _map(self, pressure: np.ndarray, derivative: int) -> np.ndarray:
        p = np.asarray(pressure, float)
        inside = np.clip(p, self.points[0, 0], self.points[-1, 0])
        if derivative:
            return np.asarray(self._slopes(inside))
        return np.asarray(self._spline(inside)) + np.asarray(self._slopes(inside)) * (p - inside)

    @cached_property
    def _spline(self) -> PchipInterpolator:
        return PchipInterpolator(self.points[:, 0], self.points[:, 1])

    @cached_property
    def _slopes(self) -> Any:
        return self._spline.derivative()

    def table(self) -> dict[str, Any]:
        """The `[model]` table with the points themselves, so that it depends on no other file."""
        output = self.outputs[0]
        units = np.array([1e3, factor(output.unit)])
        rows = [[float(f"{x:.10g}") for x in row] for row in self.points / units]
        given = {"output": output.name, "columns": ["pressure [kPa]", f"{output.name} [{output.unit}]"]}
        return common_table(self.kind, self.parameters, self.valid, self.outputs) | given | {"rows": rows}


def read(table: Mapping[str, Any], where: Path) -> Curve:
    """The model of a `[model]` table: `file`, or `columns` and `rows`; `where` is the folder of `file`."""
    refuse_unknown(table, (*KEYS, "gain", "offset"))
    name = table.get("output")
    if name is not None and not isinstance(name, str):
        raise InputError(f"given {brief(name)} for model.output: a name such as 'angle' is needed")
    if "file" in table:
        path = where / str(table["file"])
        columns, rows = read_columns(path)
        source = path.name
    elif "columns" in table and "rows" in table:
        columns, source = [str(cell) for cell in table["columns"]], "the model file"
        rows = rows_of(table["rows"], columns)
    else:
        raise InputError("given no model.file: a CSV with `pressure [kPa]` and an output column is needed")
    curve = from_columns(columns, rows, name, source)
    valid = read_valid(table, curve.outputs) or curve.valid
    return replace(curve, parameters=read_parameters(table, curve.parameters), valid=valid)


def rows_of(rows: Any, columns: list[str]) -> np.ndarray:
    """Rows of a table in a model file, (n, columns); InputError where they are no numbers."""
    try:
        values = np.array(rows, float)
    except (TypeError, ValueError):
        values = np.empty(0)
    if values.ndim != 2 or values.shape[1] != len(columns):
        raise InputError(f"model.rows: rows of {len(columns)} numbers are needed, one a column")
    return values


def read_columns(path: Path) -> tuple[list[str], np.ndarray]:
    """Header cells and numbers (n, columns) of a CSV; empty cells are nan, lines from # on passed over."""
    try:
        text = read_text(path, MOST_ROWS, "utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise InputError(f"given {path}: it cannot be read ({reason}); give a CSV file") from None
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    cells = list(csv.reader(lines))
    if len(cells) < 2:
        raise InputError(f"given {path}: a header line and rows of numbers are needed")
    values = np.empty((len(cells) - 1, len(cells[0])))
    for i, row in enumerate(cells[1:]):
        if len(row) != len(cells[0]):
            raise InputError(
                f"given {path}, row {i + 1}: {len(row)} cells where the header has {len(cells[0])}"
            )
        for j, cell in enumerate(row):
            try:
                values[i, j] = float(cell) if cell.strip() else math.nan
            except ValueError:
                raise InputError(f"given {path}, row {i + 1}: {brief(cell)} is not a number") from None
    return cells[0], values


def from_columns(
    columns: Sequence[str], rows: np.ndarray, name: str | None = None, source: str = ""
) -> Curve:
    """The curve of a table with header cells `name [unit]`.

    Parameters
    ----------
    columns : header cells;  rows : (n, columns) in their units
    name : output; "x" also finds `tip x`, and "displacement", where there is no such column, is the tip's
        way towards its farthest place; None: the first known output that varies
    source : for the range and the error lines

    Raises
    ------
    InputError : no or several pressure columns, no known output, a wrong unit, fewer than two points
    """
    found = {}
    for j, cell in enumerate(columns):
        match = _CELL.fullmatch(cell)
        word, unit = (match[1].lower(), match[2] or "") if match else (cell, "")
        found[word] = (rows[:, j], unit)
    pressures = [word for word in found if word.split(" ")[0] == "pressure"]
    if len(pressures) != 1:
        given = "no pressure column" if not pressures else f"{len(pressures)} pressure columns"
        raise InputError(
            f"given {given} in {source or 'the curve'}: kind 'curve' takes one, `pressure [kPa]`"
        )
    pressure = _in_si(*found[pressures[0]], "kPa", "pressure", source)
    outputs = {word: values for word, values in _outputs(found, source).items()}
    if name is None:
        varying = [
            w for w, v in outputs.items() if np.ptp(v[np.isfinite(v)] if np.isfinite(v).any() else 0.0) > 0
        ]
        name = next(iter(varying or outputs), None)
    elif name == "displacement" and name not in outputs and {"x", "y", "z"} <= set(outputs):
        outputs[name] = _way(np.column_stack([outputs[axis] for axis in "xyz"]))
    name = None if name is None else name.lower().removeprefix("tip ")
    if name is None or name not in outputs:
        from fem_spa.deck import nearest

        there = nearest(name or "", outputs or UNITS)
        raise InputError(
            f"given output {name or '(none)'}: {source or 'the curve'} has no such column{there}"
        )
    return from_points(pressure, outputs[name], name, source)


def _outputs(found: Mapping[str, tuple[np.ndarray, str]], source: str) -> dict[str, np.ndarray]:
    """Known output -> its column in SI, in the order of the file."""
    result = {}
    for word, (values, unit) in found.items():
        name = ALIASES.get(word, word.removeprefix("tip "))
        known = (UNITS | INNER).get(name)
        if known is not None and name not in result:
            result[name] = _in_si(values, unit, known, word, source)
    return result


def _in_si(values: np.ndarray, unit: str, expected: str, name: str, source: str) -> np.ndarray:
    if not unit or not same_kind(unit, expected):
        raise InputError(
            f"given `{name} [{unit}]` in {source or 'the curve'}: a unit like {expected} is needed, "
            f"for example `{name} [{expected}]`"
        )
    with np.errstate(over="ignore"):  # what is infinite then is left out as what is so in the file
        return values * factor(unit)


def _way(tip: np.ndarray) -> np.ndarray:
    """How far the tip (n, 3) has gone along the direction from its first place to its farthest."""
    moved = tip - tip[0]
    far = moved[int(np.nanargmax(np.linalg.norm(moved, axis=1)))]
    length = float(np.linalg.norm(far))
    return moved @ (far / length) if length > 0 else moved[:, 0]


def from_points(pressure: np.ndarray, values: np.ndarray, name: str, source: str = "") -> Curve:
    """The curve through points in SI in load order; rows that are not finite are left out.

    Raises
    ------
    InputError : fewer than two different pressures are left
    """
    keep = np.isfinite(pressure) & np.isfinite(values)
    p, y = np.asarray(pressure, float)[keep], np.asarray(values, float)[keep]
    branch = loading(p)
    points = np.column_stack([p[branch], y[branch]])
    points = points[np.argsort(points[:, 0])]
    if len(points) < 2:
        raise InputError(f"given {source or 'a curve'}: two rows of different pressure are needed at least")
    unit = (UNITS | INNER)[name]
    parameters = {
        "gain": Parameter(1.0, "", 1e-3, 1e3),
        "offset": Parameter(0.0, unit, -1e3 * factor(unit), 1e3 * factor(unit)),
    }
    valid = Range((float(points[0, 0]),), (float(points[-1, 0]),), None, source)
    return Curve(points, (Output(name, unit),), parameters, valid)


def loading(pressure: np.ndarray) -> np.ndarray:
    """Rows (indices) of a pressure history that go beyond all before them, the first row among them."""
    p = np.asarray(pressure, float)
    if p.size == 0:
        return np.empty(0, int)
    most, least = np.maximum.accumulate(p), np.minimum.accumulate(p)
    new = np.concatenate([[True], (p[1:] > most[:-1]) | (p[1:] < least[:-1])])
    near = 1e-9 * max(float(np.ptp(p)), 1e-300)  # rows written with ten digits repeat their pressure
    rows = np.flatnonzero(new)
    order = rows[np.argsort(p[rows], kind="stable")]
    return np.sort(order[np.concatenate([[True], np.diff(p[order]) > near])])
