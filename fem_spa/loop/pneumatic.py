"""Measured pressure: what happens between command and actuator is found from it alone, before the output
is asked.

The base there is the command itself (gain and offset of the pressure sensor refitted), the effects those
of the
input. What is found is held while the output is searched, and kept only where the output is the better
for it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_spa.loop.base import Base
from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.decide import Decision, decide
from fem_spa.loop.effects.effect import Effect
from fem_spa.loop.prepare import before
from fem_spa.loop.search import search
from fem_spa.reduced.model import ReducedModel

SEEN_IN_PRESSURE = ("saturation", "dead-band", "delay", "pressure-lag", "leak")
"""Effects that a measured pressure shows."""
SETTLED_BY_PRESSURE = ("saturation", "pressure-lag", "leak")
"""Of those, the ones that the output need not be asked about then."""


@dataclass(frozen=True)
class Pneumatics:
    """What the measured pressure says.

    Attributes
    ----------
    decision : of the search between command and measured pressure
    chain : from command to measured pressure
    """

    decision: Decision
    effects: tuple[Effect, ...]
    thetas: tuple[np.ndarray, ...]


def pneumatics(
    model: ReducedModel, data: Data, effects: Sequence[Effect], seed: int, say: Callable[[str], None]
) -> Pneumatics | None:
    """Search between command and measured pressure; None where it was not logged."""
    if data.measured is None:
        return None
    names = tuple(f"pressure {j + 1}" for j in range(data.pressure.shape[1]))
    none = np.zeros(0)

    def respond(_: Data, pressure: np.ndarray, __: np.ndarray) -> np.ndarray:
        return pressure

    base = Base(model, names, ("Pa",) * len(names), True, (), none, none, none, respond)
    own = replace(data, output=data.measured, known=np.isfinite(data.measured).all(axis=1))
    chain = before(base, own)
    say("measured pressure")
    found = search(chain, own, [e for e in effects if e.name in SEEN_IN_PRESSURE], seed, say)
    decision = decide(chain, own, found, False, seed)
    if not decision.chosen:
        return Pneumatics(decision, (), ())
    best: Chain = decision.best.trial.fit.chain
    return Pneumatics(decision, best.effects, best.thetas)
