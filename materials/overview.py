"""Many materials on one sheet: each with its data and the recommended law."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from html import escape

import numpy as np

from materials.fitting import predict
from materials.job import Outcome
from materials.page import STYLE
from materials.picture import ACCENT, INK, png, tidy
from materials.response import principal_stretches


def overview(outcomes: Sequence[Outcome]) -> bytes:
    """PNG with a panel a material."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = min(5, len(outcomes))
    rows = math.ceil(len(outcomes) / columns)
    figure = Figure(figsize=(3.1 * columns, 2.6 * rows), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    for k, outcome in enumerate(outcomes):
        axes = figure.add_subplot(rows, columns, k + 1)
        fit = outcome.chosen.fit
        for s in outcome.specimens:
            pick = np.unique(np.linspace(0, s.stretch.size - 1, 40).astype(int))
            axes.plot(s.stretch[pick], s.stress[pick] / 1e3, "o", ms=2.5, mfc="none", mec=INK, mew=0.6)
        for mode in sorted({s.mode for s in outcome.specimens}):
            own = [s for s in outcome.specimens if s.mode == mode]
            grid = np.linspace(
                min(1.0, *(float(s.stretch.min()) for s in own)),
                max(float(s.stretch.max()) for s in own),
                200,
            )
            p = predict(fit.law, fit.parameters, principal_stretches(mode, grid)) / 1e3
            a, b = outcome.chosen.stable_ranges[mode]
            good = (grid >= a - 1e-9) & (grid <= b + 1e-9)
            axes.plot(grid, np.where(good, p, np.nan), color=ACCENT, lw=1.6)
            axes.plot(grid, np.where(~good, p, np.nan), color=ACCENT, lw=1.6, ls="--")
        axes.set_title(
            f"{outcome.card.name}\n{fit.name}, {100 * fit.rmse_share:.2g} %", loc="left", fontsize=9
        )
        axes.tick_params(labelsize=8)
        tidy(axes)
    figure.supxlabel("stretch [1]", fontsize=10)
    figure.supylabel("nominal stress [kPa]", fontsize=10)
    return png(figure, 80)


def overview_page(outcomes: Sequence[Outcome], picture: bytes, command: str) -> str:
    """HTML with the overview inside it, and the table."""
    image = base64.b64encode(picture).decode("ascii")
    rows_text = ""
    for o in outcomes:
        fit = o.chosen.fit
        cells = [o.card.name, o.chosen.name, f"{fit.rmse / 1e3:.3g}", f"{100 * fit.rmse_share:.2g}"]
        cells += [f"{o.card.small_strain.mu / 1e3:.4g}", "yes" if o.chosen.stable else "NO"]
        rows_text += "<tr>" + "".join(f"<td>{escape(c)}</td>" for c in cells) + "</tr>"
    head = "".join(
        f"<th>{h}</th>" for h in ("material", "law", "rmse [kPa]", "of max [%]", "mu [kPa]", "stable")
    )
    parts = [
        "<!doctype html><html lang='en'><meta charset='utf-8'><title>Materials</title>",
        f"<style>{STYLE}</style><main><header><small>fem-spa fit --each</small>",
        f"<h1>{len(outcomes)} materials</h1></header>",
        f"<section><img alt='data and laws' src='data:image/png;base64,{image}'></section>",
        f"<section><table><tr>{head}</tr>{rows_text}</table></section>",
        f"<section><p>Made with</p><pre>{escape(command)}</pre></section></main></html>",
    ]
    return "\n".join(parts)
