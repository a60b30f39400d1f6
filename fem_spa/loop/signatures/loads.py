"""Weights: a turn with the inclination, in proportion to the mass at the tip."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fem_spa.loop.signatures.shapes import hats, none, together
from fem_spa.loop.signatures.statistic import Contrast, Seen, Statistic

SIZE = 0.02
"""Share of the span, or of the load itself where the base carries it, whose answer is taken for linear."""
Turn = Callable[[Seen, float], np.ndarray]


def pulled(name: str, turn: Turn, beside: Turn | None = None) -> Statistic:
    """A weight.

    turn : (what is seen, share of the span) -> (n, d) turn by such a weight, SI
    beside : of another one, which does not count where the records tell them apart
    """

    def contrasts(seen: Seen) -> tuple[Contrast, ...] | str:
        data = seen.context.data
        if name in seen.context.physical:
            pattern = (seen.loaded(name, np.array([SIZE])) - seen.response) / SIZE
            size = np.abs(pattern[seen.rows]).max()
            if size < 1e-9 * seen.scale.max():
                return "the model does not answer to it"
            return (Contrast(pattern / size, none(seen)),)
        pattern = turn(seen, SIZE) / SIZE / seen.scale.max()
        rows = seen.rows
        poses = set(zip(data.orientation[rows].round(2), data.payload[rows], strict=True))
        static = hats(seen) if len(poses) > 1 else none(seen)
        if beside is not None and len({mass for _, mass in poses}) > 1:
            static = together(static, beside(seen, SIZE) / SIZE)
        return (Contrast(pattern, static),)

    words = {
        "gravity": "turn with the inclination as weight turns it, at most",
        "payload": "turn with the mass at the tip, at most",
    }
    return Statistic(words[name], 1, contrasts)
