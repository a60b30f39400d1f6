"""The picture of a fit: data, laws, band of uncertainty, residuals; unstable parts dashed."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from materials.fitting import predict
from materials.job import Outcome
from materials.laws import Array
from materials.prony import branch
from materials.ranking import Ranked
from materials.response import MODES, principal_stretches
from materials.specimen import mean_curve

COLOURS = (
    "#a8481f",
    "#14633b",
    "#7c3aed",
    "#0e7490",
    "#ca8a04",
    "#be185d",
    "#4d7c0f",
    "#475569",
    "#9f1239",
    "#0369a1",
)
ACCENT, GREY, INK = "#1f5fa8", "#6b7280", "#1f2937"
MOST_LAWS = 7


def picture(outcome: Outcome) -> bytes:
    """PNG: three panels of stress over stretch, one a mode, and under each its residuals."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    inelastic = bool(outcome.prony or outcome.mullins)
    figure = Figure(figsize=(13.5, 11.0 if inelastic else 7.6), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    heights = [3.0, 1.2, 2.4] if inelastic else [3.0, 1.2]
    grid = figure.add_gridspec(len(heights), 3, height_ratios=heights)
    tested = {s.mode for s in outcome.specimens}
    rows = _shown(outcome)
    colours = {
        r.name: c for r, c in zip([r for r in rows if r.name != outcome.chosen.name], COLOURS, strict=False)
    }
    colours[outcome.chosen.name] = ACCENT
    legend = None
    for k, mode in enumerate(sorted(MODES, key=lambda m: (m not in tested, MODES.index(m)))):
        axes = figure.add_subplot(grid[0, k])
        _curves(axes, outcome, rows, colours, mode, mode in tested)
        legend = legend or axes.get_legend_handles_labels()
        below = figure.add_subplot(grid[1, k], sharex=axes)
        _residuals(below, outcome, rows, colours, mode, mode in tested)
    figure.suptitle(_title(outcome), x=0.01, ha="left", fontsize=14, fontweight="bold", color=INK)
    assert legend is not None
    figure.legend(
        *legend, loc="outside lower center", ncols=min(6, len(legend[1])), frameon=False, fontsize=10
    )
    if inelastic:
        _inelastic(figure, grid, outcome)
    return png(figure, 110)


def png(figure: Any, dpi: int) -> bytes:
    """A figure as a file's content."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi)
    return buffer.getvalue()


def _title(outcome: Outcome) -> str:
    fit = outcome.chosen.fit
    share = f"{100 * fit.rmse_share:.2g} % of the largest stress"
    return f"{outcome.card.name}: {fit.name}, rmse {fit.rmse / 1e3:.3g} kPa ({share})"


def _shown(outcome: Outcome) -> list[Ranked]:
    """The best laws, the recommended among them."""
    rows = outcome.ranking.rows[:MOST_LAWS]
    return rows if any(r.name == outcome.chosen.name for r in rows) else [*rows[:-1], outcome.chosen]


def tidy(axes: Any, zero: bool = True) -> None:
    axes.grid(True, color="#e5e7eb", linewidth=0.8)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    if zero:
        axes.axhline(0.0, color=GREY, linewidth=0.8, zorder=1)


def _split(outcome: Outcome, row: Ranked, mode: str, grid: Array) -> tuple[Array, Array]:
    """Nominal stress in kPa where the law is stable, and where it is not (nan elsewhere)."""
    p = predict(row.fit.law, row.fit.parameters, principal_stretches(mode, grid)) / 1e3
    a, b = row.stable_ranges[mode]
    low, high = outcome.ranking.asked[mode]
    a, b = (0.0 if a <= low else a), (np.inf if b >= high else b)
    good = (grid >= a - 1e-9) & (grid <= b + 1e-9)
    return np.where(good, p, np.nan), np.where(~good, p, np.nan)


def _curves(
    axes: Any, outcome: Outcome, rows: list[Ranked], colours: dict[str, str], mode: str, tested: bool
) -> None:
    own = [s for s in outcome.specimens if s.mode == mode]
    a, b = outcome.ranking.asked[mode]
    if own:
        low, high = min(float(s.stretch.min()) for s in own), max(float(s.stretch.max()) for s in own)
        axes.axvspan(low, high, color="#eef2f7", zorder=0, label="range of the data")
        a = 1.0 if low >= 0.98 else low - 0.04 * (high - low)
        b = high + 0.06 * (high - low)
    elif not any(float(s.stretch.min()) < 0.95 for s in outcome.specimens):
        a = 1.0
    grid = np.linspace(max(a, 0.05), b, 400)
    best = outcome.chosen
    for s in own:
        pick = np.unique(np.linspace(0, s.stretch.size - 1, 60).astype(int))
        axes.plot(
            s.stretch[pick],
            s.stress[pick] / 1e3,
            "o",
            ms=3.5,
            mfc="none",
            mec=INK,
            mew=0.8,
            zorder=5,
            label="data" if s is own[0] else None,
        )
    mean = mean_curve(own)
    if mean is not None:
        axes.fill_between(
            mean.stretch,
            (mean.stress - 2 * mean.spread) / 1e3,
            (mean.stress + 2 * mean.spread) / 1e3,
            color=GREY,
            alpha=0.25,
            zorder=2,
            label="specimens, 2 s.d.",
        )
    if best.uncertainty is not None:
        l = principal_stretches(mode, grid)
        middle, half = (
            predict(best.fit.law, best.fit.parameters, l) / 1e3,
            best.uncertainty.band(best.fit, l) / 1e3,
        )
        axes.fill_between(
            grid, middle - half, middle + half, color=ACCENT, alpha=0.18, zorder=2, label="95 % band"
        )
    for r in rows:
        solid, dashed = _split(outcome, r, mode, grid)
        width, order = (2.4, 6) if r.name == best.name else (1.2, 4)
        axes.plot(grid, solid, color=colours[r.name], lw=width, zorder=order, label=r.name)
        axes.plot(grid, dashed, color=colours[r.name], lw=width, zorder=order, ls=(0, (4, 3)))
    inner = predict(best.fit.law, best.fit.parameters, principal_stretches(mode, grid)) / 1e3
    values = np.concatenate([inner[np.isfinite(inner)], *(s.stress / 1e3 for s in own)])
    span = float(np.ptp(values)) or 1.0
    axes.set_ylim(values.min() - 0.08 * span, values.max() + (0.12 if tested else 0.6) * span)
    axes.set_xlim(grid[0], grid[-1])
    axes.set_title(
        mode if tested else f"{mode}: not tested, what the laws say",
        loc="left",
        fontsize=11,
        fontweight="bold",
    )
    axes.set_ylabel("nominal stress [kPa]")
    axes.tick_params(labelbottom=False)
    tidy(axes)


def _residuals(
    axes: Any, outcome: Outcome, rows: list[Ranked], colours: dict[str, str], mode: str, tested: bool
) -> None:
    axes.set_xlabel("stretch [1]    (dashed: unstable)")
    if not tested:
        axes.text(0.5, 0.5, "no data", transform=axes.transAxes, ha="center", va="center", color=GREY)
        axes.set_yticks([])
        for side in ("top", "right", "left"):
            axes.spines[side].set_visible(False)
        return
    mine = outcome.data.mode == mode
    order = np.argsort(outcome.data.stretches[0][mine], kind="stable")
    l = outcome.data.stretches[0][mine][order]
    several = len(set(outcome.data.specimen[mine].tolist())) > 1
    style = "," if several else ".-" if l.size < 60 else "-"
    largest = 0.0
    for r in rows:
        error = (predict(r.fit.law, r.fit.parameters, outcome.data.stretches) - outcome.data.stress)[mine][
            order
        ] / 1e3
        best = r.name == outcome.chosen.name
        axes.plot(l, error, style, color=colours[r.name], lw=2.0 if best else 1.0, ms=3)
        if best or r is rows[0]:
            largest = max(largest, float(np.max(np.abs(error))))
    axes.set_ylim(-2.5 * largest - 1e-9, 2.5 * largest + 1e-9)
    axes.set_ylabel("fit less data [kPa]")
    tidy(axes)


def _inelastic(figure: Any, grid: Any, outcome: Outcome) -> None:
    k = 0
    for s, series in outcome.prony[:2]:
        axes = figure.add_subplot(grid[2, k])
        k += 1
        assert s.time is not None
        t = s.time - s.time[0]
        shown = np.maximum(t, 0.5 * float(t[t > 0].min()))
        axes.plot(shown, s.stress / 1e3, "o", ms=3, mfc="none", mec=INK, mew=0.7)
        if s.kind == "relaxation" and np.ptp(s.stretch) == 0:
            top = float(np.max(np.abs(s.stress))) / 1e3 * series.instantaneous
            axes.plot(shown, top * series.relaxation(t), color=ACCENT, lw=2)
        elif s.kind == "relaxation":
            e = predict(
                outcome.card.law, dict(outcome.card.parameters), principal_stretches(s.mode, s.stretch)
            )
            e = e / np.max(np.abs(e)) * np.max(np.abs(s.stress)) / 1e3 * series.instantaneous
            model = e * (1 - series.g.sum()) + sum(
                g * branch(e, t, tau) for g, tau in zip(series.g, series.tau, strict=True)
            )
            axes.plot(shown, model, color=ACCENT, lw=2)
        axes.set_xscale("log")
        axes.set_title(f"{s.kind}: {len(series.g)} Prony terms", loc="left", fontsize=11, fontweight="bold")
        axes.set_xlabel("time [s]")
        axes.set_ylabel("nominal stress [kPa]")
        tidy(axes, zero=False)
    for s, m in outcome.mullins[: 3 - k]:
        from materials.mullins import softening
        from materials.response import invariants

        axes = figure.add_subplot(grid[2, k])
        k += 1
        l = principal_stretches(s.mode, s.stretch)
        W = outcome.card.law.energy(*invariants(l), **outcome.card.parameters)
        model = predict(outcome.card.law, dict(outcome.card.parameters), l)
        model = model * softening(W, np.maximum.accumulate(W), m.r, m.m, m.beta)
        axes.plot(s.stretch, s.stress / 1e3, "o", ms=3, mfc="none", mec=INK, mew=0.7)
        axes.plot(s.stretch, model / 1e3, color=ACCENT, lw=1.8)
        axes.set_title("Mullins (Ogden-Roxburgh)", loc="left", fontsize=11, fontweight="bold")
        axes.set_xlabel("stretch [1]")
        axes.set_ylabel("nominal stress [kPa]")
        tidy(axes)
