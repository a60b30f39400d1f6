"""curve.csv: one row a converged load step, in load order, header cells `name [unit]`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_spa.solid.problem import Problem, Row


def pressure_headers(cavities: Sequence[str]) -> list[str]:
    """One cavity: `pressure [kPa]`; several: `pressure NAME [kPa]` each."""
    return ["pressure [kPa]"] if len(cavities) == 1 else [f"pressure {name} [kPa]" for name in cavities]


@dataclass(frozen=True)
class Columns:
    """Which columns there are.

    cavities : names in the order of the columns
    gap : contact or obstacles, so that the smallest gap is a column
    force : the tip is held, so that its reaction is a column
    obstacles : how many; the force on each is a column
    motion : the mesh has a tip;  chord : and a base, so that there is a line between the two
    leans : the axis is not held by two planes of symmetry, so that the tip can lean
    """

    cavities: tuple[str, ...]
    gap: bool = False
    force: bool = False
    obstacles: int = 0
    motion: bool = False
    chord: bool = False
    leans: bool = False


def columns(problem: Problem) -> Columns:
    """The columns of a problem's curve."""
    mesh = problem.mesh
    motion = "tip" in mesh.surfaces
    planes = set(problem.symmetry.values())
    return Columns(
        cavities=tuple(mesh.cavities),
        gap=problem.contact or bool(problem.obstacles),
        force=problem.blocked or problem.loads.tip_displacement is not None,
        obstacles=len(problem.obstacles),
        motion=motion,
        chord=motion and ("base" in mesh.surfaces or bool(problem.fixed)),
        leans=motion and len(planes) < 2,
    )


def header(c: Columns) -> list[str]:
    """The header cells: first those that other programs rely on."""
    cells = ["step", *pressure_headers(c.cavities), "angle [deg]"]
    cells += ["tip x [mm]", "tip y [mm]", "tip z [mm]", "volume [mm^3]", "max stretch"]
    cells += ["min gap [mm]"] if c.gap else []
    cells += ["force [N]"] if c.force else []
    cells += [f"force obstacle {k + 1} [N]" for k in range(c.obstacles)]
    cells += ["tip-face angle [deg]"] if c.motion else []
    cells += ["chord angle [deg]", "chord length [mm]"] if c.chord else []
    cells += ["extension [mm]"] if c.motion else []
    return cells + (["tilt [deg]", "direction [deg]"] if c.leans else [])


def values(row: Row, c: Columns) -> list[float]:
    """The numbers of one row in the units of `header`."""
    cells = [float(row.step), *(row.pressure[name] / 1e3 for name in c.cavities), math.degrees(row.angle)]
    cells += [*(float(x) * 1e3 for x in np.asarray(row.tip)), row.volume * 1e9, row.max_stretch]
    if c.gap:
        cells.append(math.nan if row.gap is None else row.gap * 1e3)
    if c.force:
        cells.append(math.nan if row.force is None else row.force)
    cells += obstacle_forces(row, c.obstacles)
    m = row.motion
    if c.motion:
        cells.append(math.nan if m is None else math.degrees(m.tip_face))
    if c.chord:
        cells += [math.nan] * 2 if m is None else [math.degrees(m.chord), m.chord_length * 1e3]
    if c.motion:
        cells.append(math.nan if m is None else m.extension * 1e3)
    if c.leans:
        cells += [math.nan] * 2 if m is None else [math.degrees(m.tilt), math.degrees(m.direction)]
    return cells


def obstacle_forces(row: Row, count: int) -> list[float]:
    """Size of the force on each obstacle, N; nan where it is not known."""
    if row.obstacle_force is None or not count:
        return [math.nan] * count
    return [float(np.linalg.norm(force)) for force in np.asarray(row.obstacle_force).reshape(count, -1)]


def curve_csv(rows: Sequence[Row], c: Columns) -> str:
    """The text of curve.csv; numbers with ten significant digits, `nan` where there is none."""
    return _line(header(c)) + "".join(curve_line(row, c) for row in rows)


def curve_line(row: Row, c: Columns) -> str:
    """The line of one row, as in `curve_csv`."""
    numbers = values(row, c)
    return ",".join([f"{row.step:d}", *(f"{number:.10g}" for number in numbers[1:])]) + "\n"


def centre_line_csv(rows: Sequence[Row], arc: np.ndarray, lines: Sequence[np.ndarray], c: Columns) -> str:
    """The text of centre_line.csv: a row a point and step.

    Parameters
    ----------
    arc : (n,) m along the axis at rest;  lines : a step each, (n, 3) m
    """
    names = ["step", *pressure_headers(c.cavities), "s [mm]", "x [mm]", "y [mm]", "z [mm]"]
    steps = zip(rows, lines, strict=True)
    return _line(names) + "".join(centre_line_lines(row, arc, line, c) for row, line in steps)


def centre_line_lines(row: Row, arc: np.ndarray, line: np.ndarray, c: Columns) -> str:
    """The lines of one step, as in `centre_line_csv`."""
    head = [f"{row.step:d}", *(f"{row.pressure[name] / 1e3:.10g}" for name in c.cavities)]
    return "".join(
        ",".join([*head, *(f"{1e3 * value:.6g}" for value in (s, *point))]) + "\n"
        for s, point in zip(arc, line, strict=True)
    )


def _line(names: Sequence[str]) -> str:
    """The line of the header cells."""
    return ",".join(_cell(name) for name in names) + "\n"


def _cell(text: str) -> str:
    """A header cell, quoted where a cavity's name needs it."""
    return '"' + text.replace('"', '""') + '"' if any(c in text for c in ',"\n') else text
