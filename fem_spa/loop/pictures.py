"""The pictures of a diagnosis: what was measured, what is left, over what, and what the records can show."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fem_spa.loop.operators import play
from fem_spa.loop.report_json import unit_size
from fem_spa.output.style import ACCENT, GREY, INK, SECOND, figure, tidy

if TYPE_CHECKING:
    from fem_spa.loop.diagnose import Study
    from fem_spa.loop.records import Record
    from fem_spa.loop.rival_curves import Foretold

MOST = 4000
"""Points drawn of one record."""


def drawn(drawing: Any) -> bytes:
    """PNG of a figure."""
    buffer = io.BytesIO()
    drawing.savefig(buffer, format="png", dpi=110)
    return buffer.getvalue()


def _shown(study: Study) -> int:
    """The record that tells most: held out, with the largest error before."""
    records, train = study.case.split.records, study.case.split.train
    names = study.after.base.names
    best, most = 0, -1.0
    for i, (record, fit) in enumerate(zip(records, train, strict=True)):
        measured = np.stack([record.outputs[name] for name in names], axis=1)
        error = float(np.nanmean((measured - study.before_rows[i]) ** 2))
        if (not fit or all(train)) and error > most:
            best, most = i, error
    return best


def motion(study: Study) -> bytes:
    """Measured, before and after over time, and the residuals beneath; one held-out record."""
    i = _shown(study)
    record, names = study.case.split.records[i], study.after.base.names
    unit = record.units[names[0]]
    size = unit_size(unit, names[0])
    every = slice(None, None, max(len(record.time) // MOST, 1))
    t = record.time[every] - record.time[0]
    drawing = figure(10.5, 5.6)
    upper, lower = drawing.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
    changed = bool(study.decision.chosen)
    for j, name in enumerate(names):
        line = {"linestyle": ("-", "--", ":")[j % 3]}
        word = f" {name}" if len(names) > 1 else ""
        y = record.outputs[name][every] / size
        b, a = study.before_rows[i][every, j] / size, study.after_rows[i][every, j] / size
        upper.plot(t, y, color=INK, linewidth=1.6, label=f"measured{word}", **line)
        upper.plot(t, b, color=SECOND, linewidth=1.1, label=f"model before{word}", **line)
        lower.plot(t, y - b, color=SECOND, linewidth=0.9, label="before")
        if changed:
            upper.plot(t, a, color=ACCENT, linewidth=1.1, label=f"model after{word}", **line)
            lower.plot(t, y - a, color=ACCENT, linewidth=0.9, label="after")
    role = "used for the fit" if study.case.split.train[i] else "not used for the fit"
    upper.set_title(f"{record.name}, {role}", loc="left")
    upper.set_ylabel(f"{names[0] if len(names) == 1 else 'tip'} [{unit}]")
    upper.legend(frameon=False, fontsize=9, ncols=3)
    lower.set_ylabel(f"measured less\nmodel [{unit}]")
    lower.set_xlabel("time [s]")
    tidy(upper, False)
    tidy(lower)
    return drawn(drawing)


def measured_beside(record: Record, names: Sequence[str], rows: np.ndarray) -> bytes:
    """One record's outputs and the model's, (n, d) in SI, over time."""
    unit = record.units[names[0]]
    every = slice(None, None, max(len(record.time) // MOST, 1))
    t = record.time[every] - record.time[0]
    drawing = figure(10.5, 4.0)
    axes = drawing.subplots(1, 1)
    for j, name in enumerate(names):
        size = unit_size(record.units[name], name)
        line = {"linestyle": ("-", "--", ":")[j % 3]}
        word = f" {name}" if len(names) > 1 else ""
        axes.plot(t, record.outputs[name][every] / size, color=INK, label=f"measured{word}", **line)
        axes.plot(t, rows[every, j] / size, color=SECOND, linewidth=1.1, label=f"model{word}", **line)
    axes.set_title(record.name, loc="left")
    axes.set_ylabel(f"{names[0] if len(names) == 1 else 'tip'} [{unit}]")
    axes.set_xlabel("time [s]")
    axes.legend(frameon=False, fontsize=9)
    tidy(axes)
    return drawn(drawing)


def foretold_picture(told: Foretold, names: Sequence[str], unit: str, size: float, title: str) -> bytes:
    """The next experiment: what each explanation foretells, how far apart, and how readings scatter."""
    drawing = figure(10.5, 6.0)
    upper, lower, command = drawing.subplots(3, 1, sharex=True, height_ratios=(2.0, 1.2, 0.7))
    colours = [ACCENT, SECOND, GREY, "#7a5195", "#2f8f6b", "#b8860b"]
    labels = list(told.curves)
    first = told.curves[labels[0]]
    j = int(
        np.argmax(
            [
                max(np.abs(c[:, k] - first[:, k]).max() for c in told.curves.values())
                for k in range(len(names))
            ]
        )
    )
    band = told.noise / size
    for k, label in enumerate(labels):
        y, colour = told.curves[label][:, j] / size, colours[k % len(colours)]
        upper.plot(told.time, y, color=colour, linewidth=1.2, label=label)
        off = y - first[:, j] / size
        lower.plot(told.time, off, color=colour, linewidth=1.0)
        lower.fill_between(told.time, off - band, off + band, color=colour, alpha=0.15, linewidth=0)
    command.plot(told.time, told.pressure / 1e3, color=INK, linewidth=1.0)
    upper.set_title(title, loc="left")
    upper.set_ylabel(f"{names[j]} [{unit}]")
    upper.legend(frameon=False, fontsize=9, ncols=3)
    lower.set_ylabel(
        f"less that of\n{labels[0]} [{unit}]" if len(labels[0]) < 18 else f"less the first [{unit}]"
    )
    command.set_ylabel("pressure\n[kPa]")
    command.set_xlabel("time [s]  (bands: one standard deviation of the readings)")
    for axes in (upper, lower, command):
        tidy(axes, axes is not upper)
    return drawn(drawing)


def _which(names: Sequence[str], j: int) -> str:
    """The output that a picture is of, where there are several: the one with most to show."""
    return f", {names[j]}" if len(names) > 1 else ""


def loops(study: Study) -> bytes:
    """Residual over pressure, by the direction of motion; before and after, all training rows."""
    data, chain, names = study.case.data, study.case.chain, study.after.base.names
    record = study.case.split.records[0]
    unit = record.units[names[0]]
    size = unit_size(unit, names[0])
    q = chain.context(data).drive * chain.p_max / 1e3
    rising = (q - play(data, q, 0.01 * chain.p_max / 1e3)) > 0.0
    rows = data.train & data.known
    j = int(np.argmax(np.mean((data.output - chain.predict(data))[rows] ** 2, axis=0)))
    changed = bool(study.decision.chosen)
    drawing = figure(10.5 if changed else 6.4, 4.4)
    panels = np.atleast_1d(drawing.subplots(1, 2 if changed else 1, sharey=True))
    for axes, (word, model) in zip(panels, (("before", chain), ("after", study.after)), strict=False):
        left = (data.output - model.predict(data))[:, j] / size
        for mask, color, label in ((rising, ACCENT, "pressure rising"), (~rising, SECOND, "falling")):
            pick = np.nonzero(rows & mask)[0]
            pick = pick[:: max(len(pick) // 2500, 1)]
            axes.plot(q[pick], left[pick], ".", markersize=2.2, color=color, label=label)
        axes.set_title(f"What the model leaves, {word}", loc="left")
        axes.set_xlabel("pressure [kPa]")
        tidy(axes)
    panels[0].set_ylabel(f"measured less model{_which(names, j)} [{unit}]")
    panels[0].legend(frameon=False, fontsize=9, markerscale=5)
    return drawn(drawing)


def rates(study: Study) -> bytes:
    """Loops of each record, coloured by its rate, and how the remainder's memory dies away."""
    data, chain, names = study.case.data, study.case.chain, study.after.base.names
    record = study.case.split.records[0]
    unit = record.units[names[0]]
    size = unit_size(unit, names[0])
    q = chain.context(data).drive * chain.p_max / 1e3
    both = data.output - chain.predict(data)
    j = int(np.argmax(np.mean(both[data.train & data.known] ** 2, axis=0)))
    left = both[:, j] / size
    after = (data.output - study.after.predict(data))[:, j] / size
    speeds = []
    for run in data.runs:
        moving = np.abs(np.diff(q[run.part])) / run.step
        speeds.append(float(np.mean(moving[moving > 0.0])) if (moving > 0.0).any() else 0.0)
    order = np.argsort(speeds)
    drawing = figure(10.5, 4.2)
    one, two = drawing.subplots(1, 2)
    from matplotlib import colormaps

    for place, i in enumerate(order):
        run = data.runs[i]
        part = slice(run.part.start, run.part.stop, max((run.part.stop - run.part.start) // 1500, 1))
        colour = colormaps["viridis"](place / max(len(order) - 1, 1) * 0.9)
        one.plot(q[part], left[part], color=colour, linewidth=0.8, label=f"{speeds[i]:.3g} kPa/s")
        for values, style in ((left, "-"), (after, ":")):
            e = values[run.part] - values[run.part].mean()
            lags = min(len(e) // 2, 400)
            power = float(np.mean(e * e)) or 1.0
            acf = [float(np.mean(e[k:] * e[: len(e) - k])) / power for k in range(0, lags, 4)]
            two.plot(run.step * np.arange(0, lags, 4), acf, style, color=colour, linewidth=0.8)
    one.set_title("Loops by rate, before", loc="left")
    one.set_xlabel("pressure [kPa]")
    one.set_ylabel(f"measured less model{_which(names, j)} [{unit}]")
    one.legend(frameon=False, fontsize=8, title="mean rate", title_fontsize=8)
    two.set_title("Memory of the remainder", loc="left")
    two.set_xlabel("lag [s]  (solid before, dotted after)")
    two.set_ylabel("autocorrelation")
    tidy(one)
    tidy(two)
    return drawn(drawing)


def certificate_picture(study: Study) -> bytes:
    """Which effects these records could tell apart, whatever was measured: dark means alike."""
    card = study.certificate
    k = len(card.names)
    drawing = figure(8.6, 7.4)
    axes = drawing.subplots(1, 1)
    image = axes.imshow(card.distance, cmap="magma", vmin=0.0, vmax=1.0)
    axes.set_xticks(range(k), card.names, rotation=90, fontsize=8)
    axes.set_yticks(range(k), card.names, fontsize=8)
    axes.set_xlabel("this effect instead", color=GREY)
    axes.set_ylabel("true effect", color=GREY)
    axes.set_title("What of an effect another one cannot imitate", loc="left")
    bar = drawing.colorbar(image, ax=axes, fraction=0.04)
    bar.set_label("0: alike, 1: nothing in common", color=GREY)
    return drawn(drawing)
