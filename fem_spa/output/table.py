"""curve.csv: one row a converged load step, in load order, header cells `name [unit]`."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fem_spa.solid.problem import Row


def pressure_headers(cavities: Sequence[str]) -> list[str]:
    """One cavity: `pressure [kPa]`; several: `pressure NAME [kPa]` each."""
    return ["pressure [kPa]"] if len(cavities) == 1 else [f"pressure {name} [kPa]" for name in cavities]


def header(cavities: Sequence[str], force: bool) -> list[str]:
    """The header cells.

    Parameters
    ----------
    cavities : names in the order of the columns
    force : whether the tip is held, so that its reaction is a column
    """
    cells = ["step", *pressure_headers(cavities), "angle [deg]"]
    cells += ["tip x [mm]", "tip y [mm]", "tip z [mm]", "volume [mm^3]", "max stretch"]
    return [*cells, "force [N]"] if force else cells


def values(row: Row, cavities: Sequence[str], force: bool) -> list[float]:
    """The numbers of one row in the units of `header`."""
    cells = [float(row.step), *(row.pressure[name] / 1e3 for name in cavities), math.degrees(row.angle)]
    cells += [*(float(x) * 1e3 for x in np.asarray(row.tip)), row.volume * 1e9, row.max_stretch]
    if force:
        cells.append(math.nan if row.force is None else row.force)
    return cells


def curve_csv(rows: Sequence[Row], cavities: Sequence[str], force: bool) -> str:
    """The text of curve.csv; numbers with ten significant digits, `nan` where there is none."""
    lines = [",".join(_cell(name) for name in header(cavities, force))]
    for row in rows:
        numbers = values(row, cavities, force)
        lines.append(",".join([f"{row.step:d}", *(f"{number:.10g}" for number in numbers[1:])]))
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    """A header cell, quoted where a cavity's name needs it."""
    return '"' + text.replace('"', '""') + '"' if any(c in text for c in ',"\n') else text
