"""shape.png: the rest shape as a ghost, the deformed one coloured by its largest principal stretch."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.output.files import write_whole
from fem_spa.output.render import RenderingFailed, Window
from fem_spa.output.style import INK, figure
from fem_spa.output.surface import Outside, on_paper, outside, shading
from fem_spa.output.words import number, pressures
from fem_spa.solid.problem import Problem, Row, State

GHOST = np.array([0.88, 0.89, 0.91])
MAP = "viridis"
PIXELS = 1200


def write_shape(path: Path, problem: Problem, space: Any, state: State | None, row: Row | None) -> None:
    """Draw and write the picture of one state.

    Parameters
    ----------
    path : the .png
    problem : its symmetry is mirrored
    space : the second-order mesh (points m, boundary, surfaces)
    state, row : what is shown; None shows the rest shape alone
    """
    skin = outside(space, problem.symmetry)
    stretch = np.ones(len(space.points))
    moved = skin.rest
    if state is not None:
        from fem_spa.solid.fields import nodal_fields

        stretch = np.max(np.asarray(nodal_fields(space, problem.materials, state)["principal stretches"]), axis=1)
        moved = skin.moved(state.displacement)
    write_whole(path, _draw(skin, moved, stretch[skin.node] if state is not None else None, row))


def _draw(skin: Outside, moved: np.ndarray, stretch: np.ndarray | None, row: Row | None) -> bytes:
    """The picture as PNG; coordinates of its axes are mm on paper."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    paper = [on_paper(skin.rest), on_paper(moved)]
    low, high = np.vstack(paper)[:, :2].min(axis=0), np.vstack(paper)[:, :2].max(axis=0)
    margin = 0.03 * float((high - low).max())
    span = high - low + 2.0 * margin
    if span[1] < 0.30 * span[0]:
        low, high = low - [0.0, 0.5 * (0.30 * span[0] - span[1])], high + [0.0, 0.5 * (0.30 * span[0] - span[1])]
    box = (low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin)
    ratio = (box[3] - box[2]) / (box[1] - box[0])
    width = 8.6 if ratio < 1.1 else max(4.8, 8.2 / ratio)
    drawing = figure(width, width * 0.94 * ratio + 1.5)
    axes = drawing.add_subplot()
    scale = Normalize(1.0, 1.001)
    layers = [(paper[0], GHOST * shading(skin.rest, skin.triangles)[:, :, None])]
    if stretch is not None:
        scale = Normalize(1.0, max(1.001, float(np.quantile(stretch, 0.999))))
        colours = colormaps[MAP](scale(stretch))[:, :3]
        layers.append((paper[1], colours[skin.triangles] * shading(moved, skin.triangles)[:, :, None]))
    _paint(axes, skin.triangles, layers, box)
    axes.set_xlim(1e3 * box[0], 1e3 * box[1])
    axes.set_ylim(1e3 * box[2], 1e3 * box[3])
    axes.set_aspect("equal")
    axes.set_axis_off()
    _scale_bar(axes, 1e3 * (box[1] - box[0]))
    axes.set_title(_title(row), fontweight="bold", fontsize=13, color=INK)
    if stretch is not None:
        bar = drawing.colorbar(
            ScalarMappable(scale, MAP), ax=axes, orientation="horizontal", shrink=0.55, aspect=36, pad=0.03, extend="max"
        )
        bar.set_label(f"largest principal stretch (highest on the outside: {number(float(stretch.max()), 3)});  grey: at rest")
        bar.outline.set_visible(False)  # type: ignore[operator]
    buffer = io.BytesIO()
    drawing.savefig(buffer, format="png", dpi=150)
    return buffer.getvalue()


Layer = tuple[np.ndarray, np.ndarray]
"""Points on paper (n, 3) m, and colours (k, 3, 3) of the triangles' corners."""


def _paint(axes: Any, triangles: np.ndarray, layers: list[Layer], box: tuple[float, float, float, float]) -> None:
    """Every layer over the one before, by VTK or, where that fails, by matplotlib."""
    try:
        window = Window(box, PIXELS)
        for paper, colours in layers:
            image = window.image(paper, triangles, colours)
            axes.imshow(image, extent=[1e3 * value for value in box], interpolation="antialiased", zorder=2)
    except RenderingFailed:
        _paint_flat(axes, triangles, layers)


def _paint_flat(axes: Any, triangles: np.ndarray, layers: list[Layer]) -> None:
    """Without VTK: one colour a triangle, from back to front."""
    from matplotlib.collections import PolyCollection

    for paper, colours in layers:
        corner = paper[triangles]
        (x1, y1), (x2, y2) = (corner[:, i, :2].T - corner[:, 0, :2].T for i in (1, 2))
        facing = np.flatnonzero(x1 * y2 - y1 * x2 > 0.0)
        order = facing[np.argsort(-corner[facing, :, 2].mean(axis=1))]
        paint = np.clip(colours[order].mean(axis=1), 0.0, 1.0)
        axes.add_collection(
            PolyCollection(1e3 * corner[order, :, :2], facecolors=paint, edgecolors=paint, linewidths=0.3, zorder=2)
        )


def _scale_bar(axes: Any, width: float) -> None:
    """A bar of a round length, a sixth of the picture wide; valid for everything in the bending plane."""
    raw = width / 6.0
    power = 10.0 ** math.floor(math.log10(raw))
    length = max(step * power for step in (1.0, 2.0, 5.0) if step * power <= raw)
    x = axes.get_xlim()[0] + 0.03 * width
    y = axes.get_ylim()[0] + 0.03 * width
    axes.plot([x, x + length], [y, y], color=INK, linewidth=3.0, solid_capstyle="butt", zorder=5)
    axes.text(x + length / 2, y + 0.008 * width, f"{number(length)} mm", ha="center", va="bottom", color=INK, zorder=5)


def _title(row: Row | None) -> str:
    """Pressure and angle of the shown state."""
    if row is None:
        return "at rest (no load step converged)"
    words = pressures(row.pressure)
    if math.isfinite(row.angle):
        words += f", bent by {number(math.degrees(row.angle))}°"
    return words
