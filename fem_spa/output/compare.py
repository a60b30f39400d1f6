"""Curves of several runs beside each other: one picture and one table. Studies use it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.output.files import write_whole
from fem_spa.output.places import Place, clear
from fem_spa.output.style import GREY, INK, SERIES, figure, tidy, write_picture

Numbers = Sequence[float] | np.ndarray
Curve = tuple[Numbers, Numbers]


def draw(
    path: Path,
    title: str,
    labels: tuple[str, str],
    curves: Mapping[str, Curve],
    marks: Mapping[str, Curve] | None = None,
    lines: Mapping[str, float] | None = None,
) -> None:
    """Write a .png of curves with a legend.

    Parameters
    ----------
    labels : of the two axes, with units
    curves : name -> (x, y)
    marks : name -> (x, y) of single points that others printed: crosses
    lines : words -> x of a dashed upright line
    """
    drawing = figure(7.2, 4.6)
    paint(drawing.add_subplot(), title, labels, curves, marks, lines)
    save(drawing, path)


def paint(
    axes: Any,
    title: str,
    labels: tuple[str, str],
    curves: Mapping[str, Curve],
    marks: Mapping[str, Curve] | None = None,
    lines: Mapping[str, float] | None = None,
) -> None:
    """The same on axes that are there already."""
    for (name, (x, y)), colour in zip(curves.items(), cycle(SERIES), strict=False):
        dashed = "--" if "off" in name or "linear" in name else "-"
        axes.plot(x, y, dashed, marker="o", markersize=3.5, color=colour, linewidth=1.8, label=name)
    for (name, (x, y)), shape in zip((marks or {}).items(), "Xs^", strict=False):
        axes.plot(x, y, shape, color=INK, markersize=8, linestyle="none", label=name, zorder=5)
    axes.set_title(title)
    axes.set_xlabel(labels[0])
    axes.set_ylabel(labels[1])
    tidy(axes)
    for words, place in (lines or {}).items():
        axes.axvline(place, color=GREY, linewidth=1.0, linestyle=":")
        text = axes.annotate(
            words,
            (place, 0.98),
            (3, 0),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            rotation=90,
            fontsize=8,
            color=GREY,
        )
        heights = ((0.97, "top"), (0.75, "top"), (0.55, "top"), (0.4, "top"), (0.03, "bottom"))
        sides = ((3.0, "left"), (-3.0, "right"))
        places: list[Place] = [
            ((place, height), (shift, 0.0), side, up) for height, up in heights for shift, side in sides
        ]
        clear(axes, text, places, list(curves.values()))
    axes.legend(frameon=False, fontsize=9)


def save(drawing: Any, path: Path) -> None:
    """Write a figure as .png."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_picture(path, drawing, 120)


def table(path: Path, columns: Mapping[str, Numbers]) -> None:
    """Write columns (header cell -> numbers) as CSV; shorter ones end in empty cells."""
    longest = max(len(values) for values in columns.values())
    rows = [",".join(columns)]
    for i in range(longest):
        rows.append(",".join(f"{v[i] + 0.0:.8g}" if i < len(v) else "" for v in columns.values()))
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, "\n".join(rows) + "\n")


def at(x: Numbers, y: Numbers, place: float) -> float:
    """y at a place of x, between neighbouring points; nan beyond the last."""
    order = np.argsort(x, kind="stable")
    xs, ys = np.asarray(x, dtype=float)[order], np.asarray(y, dtype=float)[order]
    return float(np.interp(place, xs, ys, left=np.nan, right=np.nan))


def cost(name: str, record: Mapping[str, Any]) -> str:
    """What a run took, and how it ended, on one line; its warnings after it."""
    seconds = record["seconds"]["total"]
    memory = f", at most {record['peak_rss_mb']:.0f} MB" if record["peak_rss_mb"] else ""
    end = "" if record["status"] == "done" else f"; {record['status']}: {record['message']}"
    words = f"{name}: {record['newton_iterations']} Newton iterations, {seconds:.0f} s{memory}{end}"
    return "\n".join([words, *(f"  Note: {text}" for text in record["warnings"])])
