"""calibration.png: what was measured, the model before and after, and what remains."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fem_spa.calibration.observation import UNITS, Run
from fem_spa.calibration.outcome import Outcome
from fem_spa.output.style import ACCENT, GREY, SECOND, figure, tidy, write_picture
from fem_spa.reduced.tables import factor

_MOST = 4000


def draw(outcome: Outcome, path: Path) -> None:
    """Measured and calculated output over pressure (of what moves: over time), beside it what remains."""
    over_time = outcome.kind != "finite elements" and not all(run.static for run, *_ in outcome.runs)
    name = outcome.outputs[0]
    unit = UNITS[name]
    picture = figure(12.0, 4.8)
    left, right = picture.subplots(1, 2, width_ratios=(1.35, 1.0))
    shown: set[str] = set()

    def label(text: str) -> str | None:
        first = text not in shown
        shown.add(text)
        return text if first else None

    begin = 0.0
    for (run, role, _, _), (before, after) in zip(outcome.runs, outcome.predicted, strict=True):
        keep = slice(None, None, max(1, int(run.use.sum()) // _MOST))
        x = _across(run, over_time)[keep] + begin
        y = run.outputs[name][run.use][keep] / factor(unit)
        old, new = before[keep, 0] / factor(unit), after[keep, 0] / factor(unit)
        colour = SECOND if role == "heldout" else GREY
        word = "held out" if role == "heldout" else "fitted"
        marks = "-" if over_time else "."
        left.plot(x, y, marks, color=colour, ms=6, lw=2.5, alpha=0.55, label=label(f"measured, {word}"))
        order = np.arange(len(x)) if over_time else np.argsort(x, kind="stable")
        left.plot(x[order], old[order], "--", color=GREY, lw=1.2, label=label("model before"))
        left.plot(x[order], new[order], "-", color=ACCENT, lw=1.5, label=label("model after"))
        right.plot(x, new - y, ".", color=colour, ms=3, label=label(f"after, {word}"))
        right.plot(x, old - y, ".", color="#cbd5e1", ms=2, zorder=1, label=label("before"))
        begin = float(x[-1]) if over_time and len(x) else 0.0
    words = "time, records one after the other [s]" if over_time else "pressure [kPa]"
    if not over_time and outcome.runs[0][0].drive.pressure.shape[1] > 1:
        words = "largest pressure [kPa]"
    left.set(title="Measured and calculated", xlabel=words, ylabel=f"{name} [{unit}]")
    right.set(title="What remains", xlabel=words, ylabel=f"calculated - measured [{unit}]")
    for axes in (left, right):
        tidy(axes)
        axes.legend(frameon=False, fontsize=9)
    write_picture(path, picture, 110)


def _across(run: Run, over_time: bool) -> np.ndarray:
    if over_time:
        return run.drive.time[run.use] - run.drive.time[0]
    pressure = run.drive.pressure[run.use]
    return np.take_along_axis(pressure, np.argmax(np.abs(pressure), axis=1)[:, None], axis=1)[:, 0] / 1e3
