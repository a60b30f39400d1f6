"""Loops between rise and fall: a gap that stays when driven slower, a lateness that makes one that goes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fem_spa.loop.operators import delayed, lowpass
from fem_spa.loop.signatures.measure import left_over
from fem_spa.loop.signatures.shapes import direction, hats, late, together, weight
from fem_spa.loop.signatures.statistic import Contrast, Seen, Statistic

LATE = (0.2, 1.0)
"""s: lags whose loops are put aside where the records have the rates to tell them from a gap."""
TYPICAL = 0.3
"""s: lag of the pattern of lateness."""
LEAST_APART = 0.15
"""Share of a pattern's squares from which it is told from the other one; one rate leaves less."""


def gap(seen: Seen) -> tuple[Contrast, ...]:
    """Rising less falling at equal motion; what is late in proportion to the speed does not count."""
    pattern = -0.5 * direction(seen) * weight(seen)
    static = hats(seen)
    lags = together(*(late(seen, tau) * seen.scale for tau in LATE))
    apart = Contrast(pattern, together(static, lags), seen.record)
    if left_over(apart, seen) > LEAST_APART:
        return (apart,)
    return (Contrast(pattern, static, seen.record),)


def lateness(seen: Seen) -> tuple[Contrast, ...]:
    """Seconds by which the motion is behind, the gap between directions put aside."""
    return _behind(seen, late(seen, TYPICAL) / TYPICAL * seen.scale)


def lateness_of_pressure(seen: Seen) -> tuple[Contrast, ...]:
    """The same of the pressure, through the base."""
    data = seen.context.data
    behind = seen.respond(lowpass(data, data.pressure, TYPICAL)) - seen.response
    return _behind(seen, behind / TYPICAL)


def shift(seen: Seen) -> tuple[Contrast, ...]:
    """Seconds by which the motion as a whole comes later."""
    data = seen.context.data
    by = max(0.1, min(run.step for run in data.runs))
    return _behind(seen, (delayed(data, seen.response, by) - seen.response) / by)


def _behind(seen: Seen, pattern: np.ndarray) -> tuple[Contrast, ...]:
    static = hats(seen)
    apart = Contrast(pattern, together(static, direction(seen) * weight(seen)), seen.record)
    if left_over(apart, seen) > LEAST_APART:
        return (apart,)
    return (Contrast(pattern, static, seen.record),)


def swings(periods: Callable[[Seen], list[tuple[float, np.ndarray]]]) -> Statistic:
    """Overshoot and ringing: what no lateness explains.

    periods : (s, (n, d) response of a free mass less the base's) of the periods that are looked at
    """

    def contrasts(seen: Seen) -> tuple[Contrast, ...] | str:
        lags = together(*(late(seen, tau) * seen.scale for tau in (0.1, 0.4, 1.6)))
        beside, record = together(hats(seen), lags, direction(seen) * weight(seen)), seen.record
        found = []
        for period, pattern in periods(seen):
            size = np.abs(pattern[seen.rows]).max()
            if size > 1e-6 * seen.scale.max():
                found.append(Contrast(pattern / size, beside, record, f"swings of {period:.2g} s"))
        return tuple(found) or "nothing moves fast enough to swing"

    return Statistic("swing after quick changes that no lateness explains, at most", 1, contrasts)


GAP = Statistic("gap between rise and fall at equal motion, whatever the rate", 1, gap)
BEHIND = Statistic("time by which the motion is behind, in proportion to its speed", 1, lateness, "s")
READ_LATE = Statistic("time by which the reading is behind the motion", 1, lateness, "s")
FILLING = Statistic("time by which the pressure's action is behind the command", 1, lateness_of_pressure, "s")
LATER = Statistic("time by which the whole motion comes later", 1, shift, "s")
