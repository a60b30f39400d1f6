"""Jumps: of the motion at one place, later on the way back; of the reading, from step to step."""

from __future__ import annotations

import numpy as np

from fem_spa.loop.operators import play
from fem_spa.loop.signatures.shapes import direction, hats, late, none, together, weight
from fem_spa.loop.signatures.statistic import Contrast, Seen, Statistic

PLACES = tuple(0.1 + 0.05 * k for k in range(17))
GAPS = (0.03, 0.1, 0.22)
"""Shares of the motion at which a jump is looked for, and by how much it comes back later."""
SHARP = 0.03
"""Share of the motion over which a jump goes."""


def jump(seen: Seen) -> tuple[Contrast, ...]:
    """A jump up at a higher place than down; what any smooth curve, gap or lateness does is put aside."""
    data, s, record = seen.context.data, seen.share, seen.record
    beside = together(hats(seen, 5), direction(seen) * weight(seen), late(seen, 0.3) * seen.scale)
    found = []
    for gap in GAPS:
        lagged = np.stack([play(data, s[:, j], 0.5 * gap) for j in range(s.shape[1])], axis=1)
        for at in PLACES:
            there = 0.5 * (1.0 + np.tanh((np.abs(lagged) - at) / SHARP)) * np.sign(s) * weight(seen)
            found.append(Contrast(there, beside, record, f"at {100 * at:.0f} % of the motion"))
    return tuple(found)


def saw(seen: Seen) -> tuple[Contrast, ...] | str:
    """Size of the steps: the saw that rounding to the lattice leaves over the prediction."""
    if seen.theta is None or seen.sensed is None:
        return "the readings stand on no lattice"
    size, phase = float(seen.theta[0]), float(seen.theta[1])
    context = seen.context
    share = seen.sensed / context.scale
    saw = phase + size * np.round((share - phase) / size) - share
    return (Contrast(saw / size * weight(seen), none(seen), seen.record),)


JUMP = Statistic("jump of the motion at one place, later on the way back", 1, jump)
SAW = Statistic("steps on which the readings stand", 1, saw)
