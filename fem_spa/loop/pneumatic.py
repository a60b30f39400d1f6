"""Measured pressure: what happens between command and actuator is found from it alone, before the output
is asked.

The base there is the command itself (gain and offset of the pressure sensor refitted), the effects those
of the input. What is found is held while the output is searched, and kept only where the output is the better
for it. What the measured pressure shows beyond the law that was found is taken off the output before that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

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
WIDTHS = (0.0, 0.7, 1.5, 3.0, 6.0)
"""Rows over which the pressure sensor's own noise may be smoothed."""
OUTSTANDING = 3.5
"""Standard deviations beyond which it is no noise, and is not smoothed."""


@dataclass(frozen=True)
class Pneumatics:
    """What the measured pressure says.

    Attributes
    ----------
    decision : of the search between command and measured pressure
    effects, thetas : that were found there
    chain : from command to measured pressure, those in it
    """

    decision: Decision
    chain: Chain
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
        return Pneumatics(decision, chain, (), ())
    best: Chain = decision.best.trial.fit.chain
    return Pneumatics(decision, best, best.effects, best.thetas)


def beyond(air: Pneumatics, chain: Chain, data: Data, used: bool) -> np.ndarray:
    """(n, d) SI, what the measured pressure adds to the output beyond the pressure that the search uses.

    The law that was found is never the true one; what it misses moves the output all the same. The width of
    the smoothing (and whether to correct at all) is the one that leaves least of the output's changes from
    row to row on the training records.

    Parameters
    ----------
    chain : the refitted base alone
    used : whether what was found in the pressure stands before the base
    """
    none = np.zeros_like(data.output)
    if data.measured is None or chain.base.slow or air.decision.verdict == "unexplained":
        return none
    pressure = data.pressure
    if used:
        pressure = air.chain.response(data, air.thetas, air.chain.base.values)
    excess = (data.measured - air.chain.offset) / air.chain.gain - pressure
    excess = np.where(np.isfinite(excess), excess, 0.0)
    noise = 1.4826 * np.median(np.abs(excess[data.train]), axis=0)
    plain = chain.base.respond(data, pressure, chain.base.values)
    best, least = none, _roughness(data, data.output - chain.gain * plain)
    for width in WIDTHS:
        moved = excess.copy()
        for run in data.runs if width > 0.0 else ():
            small = np.clip(excess[run.part], -OUTSTANDING * noise, OUTSTANDING * noise)
            moved[run.part] += gaussian_filter1d(small, width, axis=0) - small
        response = chain.base.respond(data, pressure + moved, chain.base.values)
        more = np.asarray(chain.gain * (response - plain))
        rough = _roughness(data, data.output - chain.gain * plain - more)
        if rough < least:
            best, least = more, rough
    return best


def _roughness(data: Data, residual: np.ndarray) -> float:
    """Sum of squares of the changes from row to row of the training records."""
    total = 0.0
    for run in data.runs:
        if run.train:
            both = data.known[run.part][1:] & data.known[run.part][:-1]
            total += float(np.sum(np.diff(residual[run.part], axis=0)[both] ** 2))
    return total
