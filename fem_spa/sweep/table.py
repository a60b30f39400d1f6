"""sweep.csv: a row a case, its keys with units, how it ended, and the end of its curve."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from fem_spa.sweep.case import Line
from fem_spa.sweep.cases import Case, Plan


class Output(NamedTuple):
    """A number at the end of a curve.

    column : of curve.csv;  name : in words;  unit : for sentences;  label : for axes
    """

    column: str
    name: str
    unit: str
    label: str


OUTPUTS = (
    Output("force [N]", "force of the held tip", "N", "force of the held tip [N]"),
    Output("angle [deg]", "bending angle", "°", "bending angle [deg]"),
    Output("extension [mm]", "stroke of the tip", "mm", "stroke of the tip [mm]"),
    Output("volume [mm^3]", "enclosed volume", "mm³", "enclosed volume [mm³]"),
)
"""A sweep is about the first of them that moves in any case."""


def folder_of(case: Case) -> str:
    """Of a case, from the sweep's folder."""
    return f"cases/{case.name}"


def sweep_csv(plan: Plan, lines: Mapping[str, Line]) -> str:
    """The text of the table; a cell without a number is empty.

    Parameters
    ----------
    lines : name of a case -> what is known of it; one that is not in it is `waiting`
    """
    known = [lines.get(case.name, Line("waiting")) for case in plan.cases]
    end = [name for name in merged(line.end for line in known) if name != "step"]
    cost = merged(line.cost for line in known)
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    head = ["case", *(axis.title for axis in plan.axes), "status", "reason", "folder"]
    writer.writerow([*head, *end, "steps", *cost])
    for case, line in zip(plan.cases, known, strict=True):
        cells = [case.name, *(value.text for value in case.values), line.status, line.reason, folder_of(case)]
        cells += [_cell(line.end.get(name)) for name in (*end, "step")]
        writer.writerow(cells + [_cell(line.cost.get(name)) for name in cost])
    return buffer.getvalue()


def merged(tables: Iterable[Mapping[str, float]]) -> list[str]:
    """The columns of several tables; one that only some have stands behind the one it follows there."""
    found: list[str] = []
    for table in tables:
        names = list(table)
        for i, name in enumerate(names):
            if name not in found:
                at = found.index(names[i - 1]) + 1 if i else 0
                found.insert(at, name)
    return found


def _cell(value: float | None) -> str:
    return "" if value is None or not math.isfinite(value) else f"{value:.10g}"


def main_output(lines: Sequence[Line]) -> Output:
    """The one of `OUTPUTS` that the cases show."""
    for output in OUTPUTS:
        values = [line.end.get(output.column, math.nan) for line in lines]
        if any(math.isfinite(value) and abs(value) > 1e-9 for value in values):
            return output
    return OUTPUTS[1]
