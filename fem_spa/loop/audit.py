"""What is odd about a record before anything is fitted, and whether there is enough in them to ask
anything."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fem_spa.loop.data import spikes
from fem_spa.loop.records import Record

FEWEST_SAMPLES = 40
"""Training samples below which nothing is claimed."""
LARGEST_SKEW = 2.0
"""s within which an output is compared with its pressure."""
CLEARLY = 0.4
"""What is left of the mismatch (one less the correlation) where an output that runs ahead is put back."""


def remarks(record: Record) -> list[str]:
    """Notes of a record for the audit page: the reader's, and what its samples show."""
    notes = list(record.notes)
    steps = np.diff(record.time)
    if len(steps) < 2:
        return [*notes, "fewer than three samples"]
    typical = float(np.median(steps))
    gaps = int(np.sum(steps > 5.0 * typical))
    if gaps:
        notes.append(f"{gaps} gaps in time, the longest {steps.max():.3g} s; filled by lines")
    jitter = float(np.std(steps[steps <= 5.0 * typical]) / typical)
    if jitter > 0.05:
        notes.append(f"sampling jitters by {100 * jitter:.0f} % of its step; put on a uniform grid")
    for name, values in record.outputs.items():
        good = values[np.isfinite(values)]
        outliers = int(np.sum(spikes(good)))
        if outliers:
            notes.append(f"{outliers} outliers in {name} are left out")
        lattice = lattice_step(good)
        if lattice is not None and lattice > 2e-3 * np.ptp(good):
            share = 100.0 * lattice / float(np.ptp(good))
            notes.append(f"{name} stands on a lattice of {share:.2g} % of its range (quantisation)")
        top = float(np.mean(good >= good.max() - 1e-9 * np.ptp(good)))
        if np.ptp(good) > 0.0 and top > 0.03 and lattice is None:
            notes.append(f"{name} stands at its maximum in {100 * top:.0f} % of the samples (saturation?)")
        early = ahead(record.time, record.pressures, values)
        if early > 0.0:
            notes.append(f"{name} runs {early:.2g} s ahead of the pressure: do their clocks differ (skew)?")
    return notes


def ahead(time: np.ndarray, pressures: np.ndarray, output: np.ndarray) -> float:
    """s by which an output comes before its pressure, which no actuator does; 0 where it does not clearly.

    Parameters
    ----------
    time : (n,) s, increasing;  pressures : (n, m) Pa;  output : (n,), NaN where it is not known
    """
    good = np.isfinite(output)
    chamber = int(np.argmax(np.ptp(pressures, axis=0)))
    if good.sum() < FEWEST_SAMPLES or min(np.ptp(pressures[:, chamber]), np.ptp(output[good])) <= 0.0:
        return 0.0
    step = float(np.median(np.diff(time)))
    grid = np.arange(time[0], time[-1], step)
    p = np.interp(grid, time, pressures[:, chamber])
    y = np.interp(grid, time[good], output[good])
    most = min(round(LARGEST_SKEW / step), len(grid) // 4)
    lags = np.unique(np.linspace(-most, most, min(2 * most + 1, 401)).astype(int))
    sign = 1.0 if _alike(y, p) >= 0.0 else -1.0
    alike = [sign * (_alike(y[: len(y) - k], p[k:]) if k >= 0 else _alike(y[-k:], p[:k])) for k in lags]
    best = int(np.argmax(alike))
    mismatch = 1.0 - alike[best], 1.0 - sign * _alike(y, p)
    return float(lags[best] * step) if lags[best] >= 2 and mismatch[0] < CLEARLY * mismatch[1] else 0.0


def _alike(a: np.ndarray, b: np.ndarray) -> float:
    """Correlation."""
    a, b = a - a.mean(), b - b.mean()
    return float(a @ b) / max(float(np.sqrt((a @ a) * (b @ b))), 1e-300)


def lattice_step(values: np.ndarray) -> float | None:
    """The step of the lattice that all values stand on, where it is coarser than what numbers are
    written with."""
    levels = np.unique(values)
    if not 3 <= len(levels) < 0.5 * len(values) or len(values) < 30:
        return None
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-9 * np.ptp(levels)]
    step = float(np.percentile(gaps, 10))
    off = np.abs((levels - levels[0]) / step - np.round((levels - levels[0]) / step))
    return step if float(np.median(off)) < 0.05 else None


def insufficient(records: Sequence[Record], train: Sequence[bool], names: Sequence[str]) -> str | None:
    """Why nothing can be told from these records, or None."""
    fitted = [r for r, t in zip(records, train, strict=True) if t]
    samples = sum(len(r.time) for r in fitted)
    if samples < FEWEST_SAMPLES:
        return f"the training records have {samples} samples; {FEWEST_SAMPLES} are the least"
    pressures = np.concatenate([r.pressures for r in fitted])
    if float(np.ptp(pressures, axis=0).max()) <= 1e-3 * max(float(np.abs(pressures).max()), 1.0):
        return "the pressure is constant throughout: nothing is asked of the actuator"
    for name in names:
        values = np.concatenate([r.outputs[name] for r in fitted])
        values = values[np.isfinite(values)]
        if len(values) < FEWEST_SAMPLES:
            return f"the output {name} has {len(values)} samples"
    spans = []
    for name in names:
        values = np.concatenate([r.outputs[name] for r in fitted])
        spans.append(float(np.ptp(values[np.isfinite(values)])))
    if max(spans) <= 1e-12:
        return f"the output {', '.join(names)} is constant: the actuator or its sensor did not move"
    return None


def stranger(nominal: np.ndarray, refitted: np.ndarray, output: np.ndarray) -> str | None:
    """Why records and model are not of the same actuator (or unit), or None.

    Parameters
    ----------
    nominal, refitted : (n, d) predictions of the training rows before and after the refit;  output : measured
    """
    moves = [float(np.sqrt(np.sum(np.var(x, axis=0)))) for x in (nominal, refitted, output)]
    left = float(np.sum(np.var(output - refitted, axis=0)) / max(np.sum(np.var(output, axis=0)), 1e-300))
    if left > 0.6:
        return (
            f"the model, refitted, leaves {100 * left:.0f} % of the variance of the output: "
            "is it this actuator, and this column?"
        )
    centred = [x - x.mean(axis=0) for x in (nominal, refitted)]
    ratio = float(np.sum(centred[0] * centred[1]) / max(np.sum(centred[0] ** 2), 1e-300))
    if not 0.25 < ratio < 4.0 and moves[0] > 0.0:
        return (
            f"the model's output would have to be multiplied by {ratio:.3g} to fit: another actuator, "
            "or a wrong unit in a header?"
        )
    return None
