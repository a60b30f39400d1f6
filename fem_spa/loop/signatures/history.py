"""What comes with the past: below the largest load so far, over cycles, time, temperature, at one moment."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fem_spa.loop.operators import running_max, travelled
from fem_spa.loop.signatures.shapes import direction, hats, together, weight
from fem_spa.loop.signatures.statistic import Contrast, Seen, Statistic

MOMENTS = 36
"""Moments at which a step is looked for."""


def _time(seen: Seen) -> np.ndarray:
    """(n, 1) time, one at the end."""
    clock = seen.context.data.clock
    return np.asarray((clock - clock[0])[:, None] / seen.context.seconds)


def below(seen: Seen) -> tuple[Contrast, ...] | str:
    """Motion at a load below the largest so far, against the same load when it is the largest."""
    context = seen.context
    s = seen.share
    size = np.abs(s[:, 0]) if s.shape[1] == 1 else np.sqrt(np.mean(s**2, axis=1))
    start = 1.0 if context.data.fresh == 0.0 else 0.0
    under = (size < 0.97 * running_max(context.data, size, start))[:, None]
    rows = seen.rows
    if under[rows].all() or not under[rows].any():
        return "no load is there both as the largest so far and below it"
    turn = direction(seen) * weight(seen)
    bump = 3.0 * s * (1.0 - 0.75 * np.abs(s))
    trend = s * travelled(context.data, context.drive)[:, None] / context.cycles * seen.scale
    beside = together(hats(seen), turn, turn * np.abs(s), trend)
    return (Contrast(under * bump * weight(seen), beside),)


def cycles(seen: Seen) -> tuple[Contrast, ...]:
    """Gain from first to last cycle, a wandering zero put aside."""
    context = seen.context
    count = travelled(context.data, context.drive)[:, None] / context.cycles
    return (Contrast(seen.share * count * weight(seen), _apart(seen)),)


def time(seen: Seen) -> tuple[Contrast, ...]:
    """Zero from first to last sample, a change of gain put aside."""
    grown = seen.share * _time(seen) * weight(seen)
    return (Contrast(np.broadcast_to(_time(seen), grown.shape) * weight(seen), together(hats(seen), grown)),)


def _apart(seen: Seen) -> np.ndarray:
    """A static curve, and a zero that wanders with time."""
    wander = np.broadcast_to(_time(seen), seen.share.shape) * weight(seen)
    return together(hats(seen), wander)


def warmed(warmth: Callable[[Seen], np.ndarray]) -> Statistic:
    """Gain with temperature; `warmth` (n,) as it was logged, or of a body that warms as it is driven."""

    def contrasts(seen: Seen) -> tuple[Contrast, ...]:
        felt = warmth(seen)
        low, high = felt[seen.rows].min(), felt[seen.rows].max()
        warmer = (felt - low)[:, None] / max(high - low, 1e-12)
        return (Contrast(seen.share * warmer * weight(seen), _apart(seen)),)

    return Statistic("change of the motion from coldest to warmest, at full motion", 0, contrasts)


def step(seen: Seen) -> tuple[Contrast, ...]:
    """Gain after one moment against before; what changes steadily is put aside."""
    s, t = seen.share, _time(seen)
    rows = np.nonzero(seen.rows)[0]
    beside = together(_apart(seen), s * t * seen.scale)
    clock = seen.context.data.clock - seen.context.data.clock[0]
    found = []
    for k in np.linspace(0, len(rows) - 1, MOMENTS + 2)[1:-1].astype(int):
        after = np.clip(clock - clock[rows[k]] + 0.5 * seen.context.data.runs[0].step, 0.0, None) > 0.0
        pattern = s * after[:, None] * weight(seen)
        found.append(Contrast(pattern, beside, None, f"at {clock[rows[k]]:.0f} s"))
    return tuple(found)


BELOW = Statistic("more motion below the largest load so far than at it, at most", 1, below)
CYCLES = Statistic("change of the motion from first to last cycle, at full motion", 0, cycles)
TIME = Statistic("reading at rest, from first to last sample", 0, time)
STEP = Statistic("change of the motion at one moment, at full motion", 0, step)
