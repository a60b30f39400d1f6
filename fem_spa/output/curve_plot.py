"""curve.png: the angle over the pressure; under volume control the pressure over the volume beside it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.output.places import Place, clear
from fem_spa.output.style import ACCENT, GREY, SECOND, SERIES, WARN, figure, tidy, write_picture
from fem_spa.output.table import obstacle_forces
from fem_spa.output.words import by_stroke, ended_at_touch, held, holds, number, pressures
from fem_spa.solid.problem import Problem, Result, Row

PATH = "length of the load path [kPa]"
"""The abscissa where the pressures of several cavities do not keep one ratio."""


def write_curve(path: Path, problem: Problem, result: Result, rows: Sequence[Row]) -> None:
    """Draw and write the picture; empty axes that say so where no step converged.

    Parameters
    ----------
    path : the .png
    problem, result : for control, first touch and status
    rows : the converged steps, in load order
    """
    angles = bool(rows) and not held(problem) and any(math.isfinite(row.angle) for row in rows)
    volume = problem.loads.control != "pressure"
    force = bool(rows) and (rows[-1].force is not None or bool(problem.obstacles))
    panels = max(1, int(angles or not (volume or force)) + int(volume) + int(force))
    split = (
        panels == 1
        and angles
        and len(problem.mesh.cavities) > 1
        and _abscissa(problem, result, rows)[1] == PATH
    )
    drawing = figure(1.0 + 5.6 * panels if panels > 1 else 7.2, 5.6 if split else 4.6)
    if split:
        upper, lower = drawing.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.2))
        _angle_over_pressure(upper, problem, result, rows)
        upper.set_xlabel("")
        _pressures(lower, problem, result, rows)
    else:
        axes = list(np.atleast_1d(drawing.subplots(1, panels)))
        if not rows:
            axes[0].text(
                0.5, 0.5, "no load step converged", ha="center", va="center", transform=axes[0].transAxes
            )
        elif angles or not (volume or force):
            _angle_over_pressure(axes.pop(0), problem, result, rows)
        if rows and force:
            _force_over_pressure(axes.pop(0), problem, result, rows)
        if rows and volume:
            _pressure_over_volume(axes.pop(0), problem, result, rows)
    write_picture(path, drawing, 150)


def _abscissa(problem: Problem, result: Result, rows: Sequence[Row]) -> tuple[np.ndarray, str, float | None]:
    """Values, label and place of the first touch: a pressure where one number says it, else the load path.

    Several cavities whose pressures keep one ratio are drawn over the largest of them, the ratio in the
    label; others over the length of the path in the space of pressures, kPa.
    """
    names = problem.mesh.cavities
    table = np.array([[row.pressure[name] for name in names] for row in rows]) / 1e3
    first = result.touch_pressure
    touch = None if not first else np.array([first.get(name, 0.0) for name in names]) / 1e3
    lead = int(np.argmax(np.abs(table[-1])))
    largest = float(np.max(np.abs(table)))
    if len(names) == 1:
        return table[:, 0], "pressure [kPa]", None if touch is None else float(touch[0])
    ratio = table[-1] / table[-1, lead] if table[-1, lead] else np.zeros(len(names))
    if np.all(np.abs(table - np.outer(table[:, lead], ratio)) <= 1e-6 * largest):
        others = ", ".join(
            f"{n}: {number(r)} times"
            for n, r, i in zip(names, ratio, range(len(names)), strict=True)
            if i != lead
        )
        return (
            table[:, lead],
            f"pressure {names[lead]} [kPa]   ({others})",
            None if touch is None else float(touch[lead]),
        )
    length = np.cumsum(np.linalg.norm(np.diff(np.vstack([np.zeros(len(names)), table]), axis=0), axis=1))
    place = None
    if touch is not None:
        place = float(length[int(np.argmin(np.linalg.norm(table - touch, axis=1)))])
    return length, PATH, place


def _line(
    axes: Any, x: np.ndarray, y: np.ndarray, rows: Sequence[Row], name: str, colour: str = ACCENT
) -> None:
    """A curve: every converged step a small dot, the load points that the deck names a ring."""
    axes.plot(x, y, "-", color=colour, linewidth=2.0, label=name, zorder=3)
    axes.plot(x, y, ".", color=colour, markersize=4.5, zorder=3)
    named = np.array([row.is_point for row in rows])
    if named.any():
        axes.plot(
            x[named],
            y[named],
            "o",
            color="white",
            markeredgecolor=colour,
            markeredgewidth=1.6,
            markersize=6.5,
            zorder=4,
        )


def _unstable(
    axes: Any, x: np.ndarray, y: np.ndarray, problem: Problem, result: Result, rows: Sequence[Row]
) -> None:
    """A cross where the equilibrium no longer stays by itself."""
    at = [k for k, row in enumerate(rows) if row.step == result.unstable_step]
    if not at:
        return
    place = (x[at[0]], y[at[0]])
    axes.plot(*place, "X", color=WARN, markersize=9, markeredgecolor="white", zorder=5)
    axes.annotate(
        ("" if problem.loads.control == "pressure" else "with pressure held:\n") + "not stable from here",
        place,
        xytext=(8, -14),
        textcoords="offset points",
        color=WARN,
        fontsize=9,
        ha="left",
        va="top",
        zorder=5,
    )


def _touch_line(
    axes: Any, problem: Problem, result: Result, place: float | None, curves: Sequence[tuple[Any, Any]]
) -> None:
    """Where walls touch for the first time, and whether what comes after is without contact.

    `curves` : (x, y) that its words must not cover
    """
    if place is None or result.touch_pressure is None:
        return
    low, high = axes.get_xlim()
    colour = GREY if holds(problem) else WARN
    axes.axvline(place, color=colour, linewidth=1.3, linestyle="--", zorder=2)
    if not holds(problem):
        axes.axvspan(place, max(high, place), color=colour, alpha=0.07, linewidth=0, zorder=0)
    axes.set_xlim(low, max(high, place))
    beyond = "" if ended_at_touch(result) or holds(problem) else ";\nbeyond: without contact"
    words = axes.annotate(
        "first touch at\n" + pressures(result.touch_pressure, 3).replace(", ", ",\n") + beyond,
        (place, 0.97),
        (0.0, 0.0),
        xycoords=("data", "axes fraction"),
        textcoords="offset points",
        color=colour,
        fontsize=9,
    )
    sides = ((6, "left"), (-6, "right")) if place < 0.5 * (low + high) else ((-6, "right"), (6, "left"))
    places: list[Place] = [
        ((place, height), (shift, 0.0), side, up)
        for height, up in ((0.97, "top"), (0.03, "bottom"), (0.66, "top"), (0.34, "bottom"))
        for shift, side in sides
    ]
    clear(axes, words, places, [*curves, (axes.get_xlim(), (0.0, 0.0))])


def _from_rest(problem: Problem, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The dotted stretch from rest (nothing turned, no pressure) to the first step, where rest is at zero."""
    loads = problem.loads
    if any(loads.gravity) or any(loads.tip_force) or loads.tip_displacement is not None:
        return x[:0], y[:0]
    return np.array([0.0, x[0]]), np.array([0.0, y[0]])


def _colours(count: int) -> Iterable[str]:
    """Of so many curves in one panel beside the angle's."""
    return (SECOND,) if count == 1 else cycle(SERIES)


def _angle_over_pressure(axes: Any, problem: Problem, result: Result, rows: Sequence[Row]) -> None:
    x, label, touch = _abscissa(problem, result, rows)
    linear = by_stroke(problem, rows[-1])
    y = 1e3 * np.array([row.motion.extension for row in rows if row.motion is not None])
    if not linear:
        y = np.degrees([row.angle for row in rows])
    axes.plot(*_from_rest(problem, x, y), "-", color=ACCENT, linewidth=2.0, zorder=3)
    _line(axes, x, y, rows, "angle")
    _unstable(axes, x, y, problem, result, rows)
    end = axes.annotate(
        f"{number(float(y[-1]), 3)}{' mm' if linear else '°'}",
        (x[-1], y[-1]),
        (0.0, 0.0),
        textcoords="offset points",
        color=ACCENT,
        fontweight="bold",
    )
    axes.set_xlabel(label)
    axes.set_ylabel("stroke of the tip [mm]" if linear else "bending angle [deg]")
    words = {
        "done": "",
        "limit": ", load limit",
        "diverged": ", stopped early",
        "interrupted": ", interrupted",
    }
    axes.set_title(
        f"{'Stroke' if linear else 'Angle'} over pressure, {len(rows)} steps{words.get(result.status, '')}"
    )
    axes.margins(y=0.12)
    tidy(axes)
    tip = (float(x[-1]), float(y[-1]))
    around = [(-8, 6, "right", "bottom"), (-8, -6, "right", "top"), (0, 10, "right", "bottom")]
    around += [(0, -10, "right", "top"), (8, 6, "left", "bottom"), (8, -6, "left", "top")]
    clear(axes, end, [(tip, (dx, dy), h, v) for dx, dy, h, v in around], [(x, y)])
    _touch_line(axes, problem, result, touch, [(x, y)])


def _pressures(axes: Any, problem: Problem, result: Result, rows: Sequence[Row]) -> None:
    """The pressure of every cavity along the path, where one abscissa cannot say them."""
    x, label, _ = _abscissa(problem, result, rows)
    styles = ("-", "--", ":", "-.")
    for i, name in enumerate(problem.mesh.cavities):
        y = [row.pressure[name] / 1e3 for row in rows]
        axes.plot(x, y, linestyle=styles[i % 4], color=GREY if i else SECOND, linewidth=1.6, label=name)
    axes.set_xlabel(label)
    axes.set_ylabel("pressure [kPa]")
    axes.legend(frameon=False, fontsize=9)
    tidy(axes)


def _force_over_pressure(axes: Any, problem: Problem, result: Result, rows: Sequence[Row]) -> None:
    """The reaction of the held tip and the force on every obstacle."""
    x, label, touch = _abscissa(problem, result, rows)
    curves: dict[str, Any] = {}
    if rows[-1].force is not None:
        curves["held tip"] = [math.nan if row.force is None else row.force for row in rows]
    on = np.array([obstacle_forces(row, len(problem.obstacles)) for row in rows])
    curves |= {f"obstacle {k + 1}": on[:, k] for k in range(len(problem.obstacles))}
    for (name, y), colour in zip(curves.items(), _colours(len(curves)), strict=False):
        _line(axes, x, np.asarray(y), rows, name, colour)
        _unstable(axes, x, np.asarray(y), problem, result, rows)
    axes.set_xlabel(label)
    axes.set_ylabel("force [N]" if len(curves) > 1 else f"force on the {next(iter(curves))} [N]")
    axes.set_title("Force over pressure")
    if len(curves) > 1:
        axes.legend(frameon=False)
    tidy(axes)
    _touch_line(axes, problem, result, touch, [(x, y) for y in curves.values()])


def _pressure_over_volume(axes: Any, problem: Problem, result: Result, rows: Sequence[Row]) -> None:
    x = np.array([row.volume for row in rows]) * 1e6
    names = problem.mesh.cavities
    for name, colour in zip(names, _colours(len(names)), strict=False):
        y = np.array([row.pressure[name] for row in rows]) / 1e3
        _line(axes, x, y, rows, name, colour)
        _unstable(axes, x, y, problem, result, rows)
        top = int(np.argmax(y))
        if 0 < top < len(y) - 1:
            axes.annotate(
                f"limit point {number(float(y[top]))} kPa",
                (x[top], y[top]),
                xytext=(0, 9),
                textcoords="offset points",
                ha="center",
                color=colour,
                fontweight="bold",
            )
    if len(problem.mesh.cavities) > 1:
        axes.legend(frameon=False)
    axes.set_xlabel("enclosed volume [ml]")
    axes.set_ylabel("pressure [kPa]")
    axes.set_title("Pressure over volume")
    axes.margins(y=0.12)
    tidy(axes, zero=False)
