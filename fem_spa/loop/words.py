"""What the machine found, in words a person reads first; `signature` says what an unexplained remainder
looks like."""

from __future__ import annotations

import numpy as np

from fem_spa.loop.effects.effect import Context
from fem_spa.loop.learner import Learned
from fem_spa.loop.operators import holding, play

LEAST_TONE = 0.006
"""Share of the span from which a steady tone in the remainder is worth saying."""


def signature(context: Context, residual: np.ndarray, learned: Learned) -> str:
    """Plain words for an (n, d) residual of the base, from descriptors on the training rows."""
    data = context.data
    train = data.train
    e = (
        residual[:, 0] / context.scale[0]
        if residual.shape[1] == 1
        else (np.linalg.norm(residual, axis=1) / np.linalg.norm(context.scale))
    )
    q = context.drive
    clauses = []
    direction = np.sign(q - play(data, q, 0.02))
    parts = {
        "depends on the direction of motion (a loop between rise and fall)": _between(e, direction, train),
        "is bound to the pressure itself, the same up and down": _binned(e, q, train),
        "depends on the cycle or the time that has passed": _binned(e, data.clock, train),
    }
    hold = holding(data, q)
    for words, share in sorted(parts.items(), key=lambda item: -item[1]):
        if share > 0.15:
            clauses.append(f"{words} ({100 * share:.0f} % of its variance)")
    top = [name for name, share in learned.shares.items() if share > 0.12 and name != "pressure"][:3]
    if top and learned.gain > 0.05:
        clauses.append("a flexible learner predicts it best from " + ", ".join(top))
    if hold[train].any() and (~hold & train).any():
        ratio = float(np.std(e[train & hold]) / max(np.std(e[train & ~hold]), 1e-12))
        if ratio < 0.6:
            clauses.append("it is small while the command is held")
        elif ratio > 1.6:
            clauses.append("it is largest while the command is held")
    period = periodic(context, residual)
    if period is not None:
        clauses.append(f"it oscillates with a period of about {period:.3g} s, whatever is commanded")
    if not clauses:
        clauses.append("it follows none of pressure, direction, rate, time or cycle alone")
    size = 100.0 * float(np.sqrt(np.mean(e[train] ** 2)))
    return f"the remainder ({size:.2g} % of span) " + "; ".join(clauses)


def _between(e: np.ndarray, label: np.ndarray, train: np.ndarray) -> float:
    """Share of the variance between labels."""
    whole = float(np.var(e[train])) or 1.0
    means = [
        (np.mean(e[train & (label == v)]), np.sum(train & (label == v))) for v in np.unique(label[train])
    ]
    centre = float(np.mean(e[train]))
    return float(sum(n * (m - centre) ** 2 for m, n in means) / max(np.sum(train), 1) / whole)


def _binned(e: np.ndarray, x: np.ndarray, train: np.ndarray, bins: int = 12) -> float:
    """Share of the variance between bins of x."""
    edges = np.quantile(x[train], np.linspace(0.0, 1.0, bins + 1)[1:-1])
    return _between(e, np.digitize(x, edges).astype(float), train)


def periodic(context: Context, residual: np.ndarray) -> float | None:
    """s: period of a line that carries a third of the residual in most training records and is not the
    drive's."""
    data = context.data
    found, weight = [], []
    for run in data.runs:
        n = run.part.stop - run.part.start
        if not run.train or n < 64:
            continue
        e = residual[run.part, 0] - residual[run.part, 0].mean()
        u = context.drive[run.part] - context.drive[run.part].mean()
        window = np.hanning(n)
        power = np.abs(np.fft.rfft(e * window)) ** 2
        drive = np.abs(np.fft.rfft(u * window)) ** 2
        k = int(np.argmax(power[2:])) + 2
        share = power[max(k - 2, 1) : k + 3].sum() / max(power[1:].sum(), 1e-300)
        own = drive[max(k - 2, 1) : k + 3].sum() / max(drive[1:].sum(), 1e-300)
        found.append(n * run.step / k)
        weight.append(share > 0.4 and own < 0.2 * share)
    good = np.array(found)[np.array(weight, bool)] if found else np.zeros(0)
    if len(good) < 2 or len(good) < 0.6 * len(found) or np.ptp(good) > 0.25 * np.median(good):
        return None
    return float(np.median(good))


SENTENCE = {
    "attributed": "The records are consistent with {effects} that the model lacks.",
    "ambiguous": "The records are consistent with {effects}, but as well with {rivals}.",
    "unexplained": "Something predictable is missing; no effect of the library accounts for it.",
    "none": "Nothing beyond noise: the model, refitted, explains these records.",
    "insufficient": "These records cannot tell: {why}.",
}
