"""Drift while the command stands: on in the direction of the last change, or back towards no pressure."""

from __future__ import annotations

import numpy as np

from fem_spa.loop.operators import lowpass
from fem_spa.loop.signatures.shapes import direction, hats, holds, none, together, weight
from fem_spa.loop.signatures.statistic import Contrast, Seen, Statistic

SHORTEST = 2.5
"""s a command must stand."""
SETTLED = 0.8
"""s after which lags are over, mostly, and drift counts."""
BEFORE = 5.0
"""s over which the motion before a hold is remembered."""
MEMORIES = (4.0, 20.0, 100.0)
"""s over which motion is remembered, where nothing is held."""


def _standing(seen: Seen) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) number of the hold or -1, (n,) s since it began, (n, d) last change of the response before it."""
    data, s = seen.context.data, seen.share
    label, since = holds(data, data.pressure, SHORTEST)
    change = s - lowpass(data, s, BEFORE)
    first = np.zeros_like(s)
    starts = np.nonzero((label >= 0) & (since == 0.0))[0]
    for row in starts:
        first[label == label[row]] = change[row]
    label = np.where(since >= SETTLED, label, -1)
    return label, since, first


def onward(seen: Seen) -> tuple[Contrast, ...] | str:
    """On in the direction of the last change, with the logarithm of time; after unloading, too."""
    label, since, first = _standing(seen)
    if not np.any(np.abs(first[seen.rows & (label >= 0)]) > 0.05):
        return _remembered(seen)
    pattern = first * np.log10(np.maximum(since, SETTLED) / SETTLED)[:, None] * weight(seen)
    return (Contrast(pattern, none(seen), label),)


def _remembered(seen: Seen) -> tuple[Contrast, ...] | str:
    """Without holds: what goes with the mean of the motion so far, a gap between directions put aside."""
    data, s = seen.context.data, seen.share
    beside, record = together(hats(seen), direction(seen) * weight(seen)), seen.record
    return tuple(
        Contrast(lowpass(data, s, tau) * weight(seen), beside, record, f"without holds, over {tau:g} s")
        for tau in MEMORIES
        if tau < 1.5 * data.longest
    )


def droop(seen: Seen) -> tuple[Contrast, ...] | str:
    """Towards no pressure while it stands above none, whichever way it came there; by the minute."""
    label, since, _ = _standing(seen)
    label = np.where(np.abs(seen.context.drive) > 0.02, label, -1)
    if not np.any(label[seen.rows] >= 0):
        return "no command is held above zero pressure"
    pattern = -seen.share * since[:, None] / 60.0 * weight(seen)
    return (Contrast(pattern, none(seen), label),)


ONWARD = Statistic(
    "drift in holds, on in the direction of the last change: from one second to ten, a full change", 1, onward
)
DROOP = Statistic("droop towards no pressure while held: in a minute, at full motion", 1, droop)
