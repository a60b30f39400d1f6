"""shape.png: the rest shape as a ghost, the deformed one coloured by its largest principal stretch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.output.obstacle_surface import surface
from fem_spa.output.render import Layer, Rendering, RenderingFailed
from fem_spa.output.style import INK, figure, write_picture
from fem_spa.output.surface import bending_plane, on_paper, outside, shading, turned
from fem_spa.output.words import by_stroke, done, number, pressures
from fem_spa.solid.problem import Problem, Row, State

GHOST = np.array([0.88, 0.89, 0.91])
RIGID = np.array([0.66, 0.74, 0.83])
MAP = "YlOrRd"
PIXELS = 1200
READABLE = 14.0
"""Points: pages show the picture at less than half its size."""
NARROW = 8.0
"""Inches below which the words under the colours take two lines."""


class ShapePicture:
    """The picture of one state; its rendering begins here and ends in `write`.

    Parameters
    ----------
    problem : its symmetry is mirrored
    space : the second-order mesh (points m, boundary, surfaces)
    state, row : what is shown; None shows the rest shape alone
    """

    def __init__(self, problem: Problem, space: Any, state: State | None, row: Row | None) -> None:
        from matplotlib import colormaps
        from matplotlib.colors import Normalize

        skin = outside(space, problem.symmetry)
        self.title = _title(problem, row)
        self.scale, self.highest = Normalize(1.0, 1.001), 1.0
        view = bending_plane(space, problem.symmetry)
        rest = turned(skin.rest, view)
        papers = [on_paper(rest)]
        self.layers: list[Layer] = [
            (papers[0], skin.triangles, GHOST * shading(rest, skin.triangles)[:, :, None])
        ]
        body = skin.rest
        if state is not None:
            from fem_spa.solid.fields import NodalFields

            fields = NodalFields(space, problem.materials)(state)
            stretch = np.max(np.asarray(fields["principal stretches"]), axis=1)[skin.node]
            stretch = _filled(stretch, skin.triangles)
            moved = skin.moved(state.displacement)
            self.highest = float(stretch.max())
            self.scale = Normalize(1.0, max(1.001, float(np.quantile(stretch, 0.99))))
            colours = colormaps[MAP](self.scale(stretch))[:, :3]
            papers.append(on_paper(turned(moved, view)))
            shade = shading(turned(moved, view), skin.triangles)[:, :, None]
            self.layers.append((papers[1], skin.triangles, colours[skin.triangles] * shade))
            body = np.vstack([body, moved])
        self.box = _frame(np.vstack(papers), 0.12 if problem.obstacles else 0.03)
        self.foot = _foot(self.box, np.vstack(papers))
        faces = [surface(obstacle, body) for obstacle in problem.obstacles]
        rigid = [(turned(points, view), triangles) for points, triangles in faces]
        self.layers = [
            *((on_paper(points), t, RIGID * shading(points, t)[:, :, None]) for points, t in rigid),
            *self.layers,
        ]
        self.coloured = state is not None
        self.rendering = Rendering(self.box, PIXELS, self.layers)

    def write(self, path: Path, title: str | None = None) -> None:
        """Compose and write the .png; the coordinates of its axes are mm on paper.

        `title` : None is pressure and angle (or stroke, or force of the held tip) of the state
        """
        left, right, bottom, top = (1e3 * value for value in self.box)
        low = bottom - 1e3 * self.foot
        ratio = (top - low) / (right - left)
        width = 8.6 if ratio < 0.9 else max(5.6, 7.7 / ratio)
        drawing = figure(width, min(width * 0.94 * ratio + 1.9, 9.6))
        axes = drawing.add_subplot()
        self._paint(axes, (left, right, bottom, top))
        axes.set_xlim(left, right)
        axes.set_ylim(low, top)
        axes.set_aspect("equal")
        axes.set_axis_off()
        _scale_bar(axes, right - left)
        axes.set_title(title or self.title, fontweight="bold", fontsize=16, color=INK)
        if self.coloured:
            self._colour_bar(drawing, axes)
        write_picture(path, drawing, 150)

    def _paint(self, axes: Any, extent: tuple[float, float, float, float]) -> None:
        """Every layer over the one before, by VTK or, where that fails, by matplotlib."""
        try:
            for image in self.rendering.images():
                axes.imshow(image, extent=extent, interpolation="antialiased", zorder=2)
        except RenderingFailed:
            _paint_flat(axes, self.layers)

    def _colour_bar(self, drawing: Any, axes: Any) -> None:
        from matplotlib.cm import ScalarMappable

        bar = drawing.colorbar(
            ScalarMappable(self.scale, MAP),
            ax=axes,
            orientation="horizontal",
            shrink=0.7,
            aspect=36,
            pad=0.03,
            extend="max",
        )
        between = " " if drawing.get_figwidth() > NARROW else "\n"
        bar.set_label(
            f"largest principal stretch{between}(at most {number(self.highest, 3)} on the outside);  "
            "grey: at rest",
            fontsize=READABLE,
        )
        bar.ax.tick_params(labelsize=READABLE)
        bar.ax.locator_params(axis="x", nbins=6)
        bar.outline.set_visible(False)


def _filled(values: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Values that are not finite (an element turned inside out at a node) become their neighbours' mean."""
    values = values.copy()
    for _ in range(len(values)):
        known = np.isfinite(values)
        near = triangles[known[triangles].any(axis=1) & ~known[triangles].all(axis=1)]
        if not len(near):
            break
        total, count = np.zeros(len(values)), np.zeros(len(values))
        weight = known[near].sum(axis=1)
        np.add.at(total, near, np.where(known[near], values[near], 0.0).sum(axis=1, keepdims=True))
        np.add.at(count, near, weight[:, None])
        values = np.where(known, values, np.where(count > 0, total / np.maximum(count, 1), np.nan))
    return np.where(np.isfinite(values), values, 1.0)


def _frame(paper: np.ndarray, share: float) -> tuple[float, float, float, float]:
    """(left, right, bottom, top) around all points, with a margin, not flatter than three tenths."""
    low, high = paper[:, :2].min(axis=0), paper[:, :2].max(axis=0)
    margin = share * float((high - low).max())
    low, high = low - margin, high + margin
    lacking = max(0.0, 0.30 * (high[0] - low[0]) - (high[1] - low[1]))
    return float(low[0]), float(high[0]), float(low[1] - 0.5 * lacking), float(high[1] + 0.5 * lacking)


def _paint_flat(axes: Any, layers: list[Layer]) -> None:
    """Without VTK: one colour a triangle, from back to front."""
    from matplotlib.collections import PolyCollection

    for paper, triangles, colours in layers:
        corner = paper[triangles]
        (x1, y1), (x2, y2) = (corner[:, i, :2].T - corner[:, 0, :2].T for i in (1, 2))
        facing = np.flatnonzero(x1 * y2 - y1 * x2 > 0.0)
        order = facing[np.argsort(-corner[facing, :, 2].mean(axis=1))]
        paint: Any = np.clip(colours[order].mean(axis=1), 0.0, 1.0)
        axes.add_collection(
            PolyCollection(
                list(1e3 * corner[order, :, :2]), facecolors=paint, edgecolors=paint, linewidths=0.3, zorder=2
            )
        )


def _foot(box: Sequence[float], points: np.ndarray) -> float:
    """Room below the picture for the scale bar, where the body lies in its corner; m on paper."""
    left, right, bottom, _ = box
    width = right - left
    in_corner = (points[:, 0] < left + 0.22 * width) & (points[:, 1] < bottom + 0.09 * width)
    return 0.07 * width if in_corner.any() else 0.0


def _scale_bar(axes: Any, width: float) -> None:
    """A bar of a round length, a sixth of the picture wide; valid for everything in the bending plane."""
    raw = width / 6.0
    power = 10.0 ** math.floor(math.log10(raw))
    length = max(step * power for step in (1.0, 2.0, 5.0) if step * power <= raw)
    x = axes.get_xlim()[0] + 0.03 * width
    y = axes.get_ylim()[0] + 0.03 * width
    axes.plot([x, x + length], [y, y], color=INK, linewidth=3.0, solid_capstyle="butt", zorder=5)
    axes.text(
        x + length / 2,
        y + 0.008 * width,
        f"{number(length)} mm",
        ha="center",
        va="bottom",
        color=INK,
        fontsize=READABLE,
        zorder=5,
    )


def _title(problem: Problem, row: Row | None) -> str:
    """Pressure of the shown state, and what it does there."""
    if row is None:
        return "at rest (no load step converged)"
    words, did = pressures(row.pressure), done(problem, row)
    if did is not None:
        words += f", {'moved' if by_stroke(problem, row) else 'bent'} by {did}"
    elif row.force is not None:
        words += f", held tip pushes with {number(row.force, 3)} N"
    return words
