"""Pictures of a sweep: every curve, the end over each key, maps over two keys."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.output.style import ACCENT, GREY, INK, SECOND, WARN, figure, tidy, write_picture
from fem_spa.output.words import number
from fem_spa.sweep.axes import Axis
from fem_spa.sweep.case import read_curve
from fem_spa.sweep.cases import Case
from fem_spa.sweep.state import Sweep
from fem_spa.sweep.table import folder_of

COLOURS = "viridis"
MOST_CURVES = 200
MOST_PANELS = 6
MOST_MAPS = 6
MOST_LINES = 50
FEW = 8
"""Values of a key that a legend names one by one."""
LEGEND = {"edgecolor": "none", "framealpha": 0.85, "fontsize": 9, "title_fontsize": 9}
DASHES = ("-", "--", ":", "-.")
CATEGORIES = (ACCENT, SECOND, "#14633b", WARN, GREY, "#7a3e9d", "#0e7490", "#be185d")


def draw_all(sweep: Sweep) -> list[str]:
    """Write curves.png, keys.png and maps.png as far as there is something to see; what failed, in words."""
    notes = []
    for name, draw in (("curves.png", curves), ("keys.png", keys), ("maps.png", maps)):
        path = sweep.folder / name
        path.unlink(missing_ok=True)
        try:
            draw(sweep, path)
        except Exception as error:  # a picture that cannot be drawn does not cost the table
            notes.append(f"{name} could not be drawn ({type(error).__name__}: {error}).")
    return notes


def _position(axis: Axis, case: Case, index: int) -> float:
    """Where a case stands along a key: its number, or the place of its word in the list."""
    value = case.values[index]
    return value.number if axis.numeric and value.number is not None else float(axis.values.index(value))


def _colour(axis: Axis, index: int, drawing: Any, axes: Any) -> Callable[[Case], Any]:
    """Colours by a key, with what explains them beside the axes: a bar for numbers, a legend for words."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    few = axis.numeric and not axis.sampled and len(axis.values) <= FEW
    if axis.numeric and not few:
        numbers = [value.number for value in axis.values if value.number is not None]
        scale = Normalize(min(numbers), max(numbers))
        bar = drawing.colorbar(ScalarMappable(scale, COLOURS), ax=axes, pad=0.02)
        bar.set_label(axis.title)
        bar.outline.set_visible(False)
        return lambda case: colormaps[COLOURS](scale(_position(axis, case, index)))
    last = max(1, len(axis.values) - 1)
    hues: list[Any] = [CATEGORIES[k % len(CATEGORIES)] for k in range(last + 1)]
    if few:
        hues = [colormaps[COLOURS](0.92 * k / last) for k in range(last + 1)]
    for value, hue in zip(axis.values, hues, strict=False):
        axes.plot([], [], color=hue, label=_short(value.label), linewidth=2.5)
    axes.legend(title=axis.title, **LEGEND)
    return lambda case: hues[axis.values.index(case.values[index])]


def curves(sweep: Sweep, path: Path) -> None:
    """The main output over the pressure, a line a case.

    Its colour tells the first key that is not a load, its dashes the second one, if that has few values.
    """
    output = sweep.output
    found = [(case, read_curve(sweep.folder / folder_of(case))) for case in sweep.plan.cases[:MOST_CURVES]]
    found = [(case, curve) for case, curve in found if len(curve.get(output.column, ())) > 1]
    if not found:
        return
    abscissa = _abscissa([curve for _, curve in found])
    drawing = figure(8.6, 5.2)
    axes = drawing.add_subplot()
    every = sweep.plan.axes
    first, *others = [k for k, axis in enumerate(every) if axis.path[0] != "loads"] or [0]
    colour = _colour(every[first], first, drawing, axes)
    second = next((k for k in others if not every[k].sampled and len(every[k].values) <= len(DASHES)), None)
    dashes = (lambda _: "-") if second is None else _dashes(every[second], second, axes)
    stopped = False
    for case, curve in found:
        if abscissa not in curve:
            continue
        x, y, hue = curve[abscissa], curve[output.column], colour(case)
        width = 1.6 if len(found) <= 40 else 0.9
        axes.plot(x, y, dashes(case), color=hue, linewidth=width, zorder=3)
        if sweep.line(case).status != "done":
            axes.plot(x[-1:], y[-1:], "x", color=hue, markersize=7, markeredgewidth=2, zorder=4)
            stopped = True
    axes.set_xlabel(abscissa)
    axes.set_ylabel(output.label)
    many = len(sweep.plan.cases)
    some = f"the first {MOST_CURVES} of {many} designs" if many > MOST_CURVES else f"{len(found)} designs"
    axes.set_title(
        f"{some}{'; x: ended on the way' if stopped else ''}", color=INK, loc="left", fontweight="bold"
    )
    tidy(axes)
    write_picture(path, drawing, 130)


def _dashes(axis: Axis, index: int, axes: Any) -> Callable[[Case], str]:
    """Dashes by a key, with a legend below that of the colours."""
    colours = axes.get_legend()
    if colours is not None:
        colours.set_loc("upper left")
        axes.add_artist(colours)
    handles = [
        axes.plot([], [], style, color=INK, label=_short(value.label))[0]
        for value, style in zip(axis.values, DASHES, strict=False)
    ]
    axes.legend(handles=handles, loc="lower right", title=axis.title, **LEGEND)
    return lambda case: DASHES[axis.values.index(case.values[index])]


def _abscissa(tables: Sequence[dict[str, list[float]]]) -> str:
    """The pressure that changes most along the curves."""
    names = {name for table in tables for name in table if name.startswith("pressure")}

    def span(name: str) -> float:
        return max(float(np.ptp(table[name])) for table in tables if name in table)

    return max(sorted(names), key=span)


def keys(sweep: Sweep, path: Path) -> None:
    """The end of the main output over each key, lines between cases that differ in that key alone."""
    plan = sweep.plan
    column, label = sweep.output.column, sweep.output.label
    shown = [i for i, axis in enumerate(plan.axes) if len({case.values[i] for case in plan.cases}) > 1]
    shown = shown[:MOST_PANELS]
    solved = [case for case in plan.cases if _end(sweep, case, column) is not None]
    if not shown or not solved:
        return
    across = min(len(shown), 3 if len(shown) != 4 else 2)
    down = math.ceil(len(shown) / across)
    drawing = figure({1: 8.6, 2: 11.4, 3: 13.6}[across], 0.6 + 4.2 * down)
    for panel, i in enumerate(shown):
        axes = drawing.add_subplot(down, across, panel + 1)
        _over_key(sweep, axes, drawing, i, column)
        axes.set_ylabel(label)
    drawing.suptitle(
        "At the end of the path, over each key" if len(shown) > 1 else "At the end of the path",
        color=INK,
        fontweight="bold",
    )
    write_picture(path, drawing, 130)


def _end(sweep: Sweep, case: Case, column: str) -> float | None:
    """The end of a solved case: others end elsewhere, and cannot be compared with it."""
    line = sweep.line(case)
    value = line.end.get(column, math.nan)
    return value if line.status == "done" and math.isfinite(value) else None


def _over_key(sweep: Sweep, axes: Any, drawing: Any, i: int, column: str) -> None:
    """The panel of one key, its colours by the first of the others."""
    plan = sweep.plan
    axis = plan.axes[i]
    other = next((j for j in range(len(plan.axes)) if j != i), None)
    colour = (lambda _: ACCENT) if other is None else _colour(plan.axes[other], other, drawing, axes)
    groups: dict[Any, list[Case]] = {}
    for case in plan.cases:
        rest = tuple(v.text for k, v in enumerate(case.values) if k != i)
        groups.setdefault(rest, []).append(case)
    lines = not plan.sample and len(groups) <= MOST_LINES
    missed = []
    for group in groups.values():
        pairs = [(_position(axis, case, i), _end(sweep, case, column)) for case in group]
        missed += [x for x, y in pairs if y is None]
        points = sorted((x, y) for x, y in pairs if y is not None)
        if points:
            x, y = zip(*points, strict=True)
            style = "o-" if lines and axis.numeric else "o"
            axes.plot(x, y, style, color=colour(group[0]), markersize=4.5, linewidth=1.5, zorder=3)
    if missed:
        low = axes.get_ylim()[0]
        axes.plot(missed, [low] * len(missed), "x", color=WARN, clip_on=False, zorder=5, label="not done")
        axes.set_ylim(bottom=low)
    if not axis.numeric:
        axes.set_xticks(range(len(axis.values)), [_short(value.label) for value in axis.values])
        axes.set_xlim(-0.5, len(axis.values) - 0.5)
    elif not axis.sampled and len(axis.values) <= FEW:
        axes.set_xticks([value.number for value in axis.values], [value.label for value in axis.values])
    axes.set_xlabel(f"{axis.title}{'   (x: not done)' if missed else ''}")
    tidy(axes, zero=False)


def _short(text: str) -> str:
    return text if len(text) <= 18 else text[:16] + "..."


def maps(sweep: Sweep, path: Path) -> None:
    """The end of the main output over every two keys."""
    plan = sweep.plan
    column, label = sweep.output.column, sweep.output.label
    shown = [i for i in range(len(plan.axes)) if len({case.values[i] for case in plan.cases}) > 1]
    pairs = list(itertools.combinations(shown, 2))[:MOST_MAPS]
    values = [value for case in plan.cases if (value := _end(sweep, case, column)) is not None]
    if not pairs or len(values) < 3:
        return
    from matplotlib.colors import Normalize

    across = min(len(pairs), 3 if len(pairs) != 4 else 2)
    down = math.ceil(len(pairs) / across)
    drawing = figure({1: 8.0, 2: 11.4, 3: 13.6}[across], 0.6 + (5.0 if across == 1 else 4.4) * down)
    scale = Normalize(min(values), max(values))
    every, image = [], None
    for panel, (i, j) in enumerate(pairs):
        axes = drawing.add_subplot(down, across, panel + 1)
        every.append(axes)
        draw = _cloud if plan.sample else _grid
        image = draw(sweep, axes, i, j, column, scale)
        axes.set_xlabel(plan.axes[i].title)
        axes.set_ylabel(plan.axes[j].title)
    bar = drawing.colorbar(image, ax=every, pad=0.02)
    bar.set_label(label)
    bar.outline.set_visible(False)
    rest = "" if len(plan.axes) == 2 or plan.sample else ", mean over the other keys"
    drawing.suptitle(f"At the end of the path, over two keys{rest}", color=INK, fontweight="bold")
    write_picture(path, drawing, 130)


def _grid(sweep: Sweep, axes: Any, i: int, j: int, column: str, scale: Any) -> Any:
    """A cell a pair of values, its number in it; cells that are not solved are left open with a cross."""
    plan = sweep.plan
    first, second = plan.axes[i], plan.axes[j]
    xs, ys = (sorted({_position(a, c, k) for c in plan.cases}) for a, k in ((first, i), (second, j)))
    total, count = np.zeros((len(ys), len(xs))), np.zeros((len(ys), len(xs)))
    for case in plan.cases:
        value = _end(sweep, case, column)
        if value is not None:
            at = ys.index(_position(second, case, j)), xs.index(_position(first, case, i))
            total[at] += value
            count[at] += 1
    cells = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    image = axes.imshow(cells, origin="lower", aspect="auto", cmap=COLOURS, norm=scale)
    if cells.size <= 120:
        for (row, place), value in np.ndenumerate(cells):
            bright = np.isfinite(value) and scale(value) > 0.6
            axes.text(
                place,
                row,
                number(float(value), 3) if np.isfinite(value) else "x",
                ha="center",
                va="center",
                fontsize=9 if cells.size <= 60 else 7,
                color=INK if bright or not np.isfinite(value) else "white",
            )
    for axis, ticks, set_ticks in ((first, xs, axes.set_xticks), (second, ys, axes.set_yticks)):
        step = max(1, len(ticks) // 10)
        places = list(range(0, len(ticks), step))
        texts = [
            number(ticks[p], 4) if axis.numeric else _short(axis.values[int(ticks[p])].label) for p in places
        ]
        set_ticks(places, texts)
    for side in axes.spines.values():
        side.set_visible(False)
    return image


def _cloud(sweep: Sweep, axes: Any, i: int, j: int, column: str, scale: Any) -> Any:
    """Drawn points, coloured; between them, where only these two keys vary, the linear interpolation."""
    plan = sweep.plan
    first, second = plan.axes[i], plan.axes[j]
    solved = [(case, value) for case in plan.cases if (value := _end(sweep, case, column)) is not None]
    x = np.array([_position(first, case, i) for case, _ in solved])
    y = np.array([_position(second, case, j) for case, _ in solved])
    z = np.array([value for _, value in solved])
    if len(plan.axes) == 2 and first.numeric and second.numeric and len(solved) >= 6:
        axes.tricontourf(x, y, z, 24, cmap=COLOURS, norm=scale, alpha=0.75)
    image = axes.scatter(
        x, y, c=z, cmap=COLOURS, norm=scale, edgecolors="white", linewidths=0.8, s=46, zorder=3
    )
    missed = [case for case in plan.cases if _end(sweep, case, column) is None]
    if missed:
        places = [(_position(first, case, i), _position(second, case, j)) for case in missed]
        axes.plot(*zip(*places, strict=True), "x", color=WARN, zorder=4)
    for axis, set_ticks in ((first, axes.set_xticks), (second, axes.set_yticks)):
        if not axis.numeric:
            set_ticks(range(len(axis.values)), [_short(value.label) for value in axis.values])
    tidy(axes, zero=False)
    return image
