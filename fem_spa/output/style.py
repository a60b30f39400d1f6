"""How the pictures look: one place for colours and axes. matplotlib's Agg: no display is needed."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from fem_spa.output.files import write_whole

ACCENT = "#1f5fa8"
SECOND = "#a8481f"
GREY = "#6b7280"
WARN = "#b45309"
INK = "#1f2937"
SERIES = (ACCENT, "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", INK)
"""Curves beside one another: Okabe and Ito's colours, which stay apart for the colour-blind too."""


def figure(width: float, height: float) -> Any:
    """An empty figure of width x height inches with an Agg canvas and constrained layout."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with rc_context({"font.size": 10.5, "axes.edgecolor": GREY, "text.color": INK}):
        drawing = Figure(figsize=(width, height), layout="constrained", facecolor="white")
        FigureCanvasAgg(drawing)
    return drawing


def tidy(axes: Any, zero: bool = True) -> None:
    """Light grid, no box, titles on the left; `zero` draws the axes' zero lines."""
    axes.grid(True, color="#e5e7eb", linewidth=0.8, zorder=0)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(GREY)
    axes.tick_params(colors=INK)
    axes.title.set_fontweight("bold")
    if zero:
        axes.axhline(0.0, color=GREY, linewidth=0.8, zorder=1)


def write_picture(path: Path, drawing: Any, dpi: int) -> None:
    """Write a figure as .png, whole or not at all (`write_whole`)."""
    buffer = io.BytesIO()
    drawing.savefig(buffer, format="png", dpi=dpi)
    write_whole(path, buffer.getvalue())
