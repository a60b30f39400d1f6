"""Quantisation: the residual is a saw over the prediction; claimed where rounding the prediction brings
it closer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.decide import Decision
from fem_spa.loop.effects.quantisation import EFFECT
from fem_spa.loop.prepare import Case

TEETH = (4.0, 160.0)
"""Teeth of the saw over the span, fewest and most, that are looked for."""
LEAST_SHARE = 0.3
"""Share of the residual's variance that the saw's first harmonic must have (a pure saw has 61 %)."""
LEAST_STANDING = 0.12
"""Length of the mean phase of the readings on the lattice; evenly spread ones have none."""
LEAST_GAIN = 0.2
"""Share of the training error that rounding must take off."""
LEAST_STANDING_GAIN = 0.03
"""The same where the readings are known to stand on a lattice: of another law's misfit it takes little."""


def lattice_theta(
    chain: Chain, data: Data, known: float | None = None, least: float = LEAST_STANDING_GAIN
) -> np.ndarray | None:
    """(step, phase) of the effect on top of a chain, or None where no lattice shows that matters.

    `known`: step (SI) on which the readings stand (`teeth`); `least`: share of the training error that
    rounding must then take off.
    """
    if data.output.shape[1] != 1:
        return None
    rows = data.train & data.known
    response = chain.response(data, chain.thetas, chain.base.values)[rows, 0]
    share = response / chain.scale[0]
    residual = (data.output[rows, 0] - float(chain.offset[0])) / (chain.gain * chain.scale[0]) - share
    residual = residual - residual.mean()
    spread = float(np.var(residual))
    if spread <= 0.0 or np.ptp(share) <= 0.0:
        return None
    keep = slice(None, None, max(len(share) // 6000, 1))
    if known is not None:
        step = known / (chain.gain * float(chain.scale[0]))
        if not _carries_over(data, rows, share, residual, step):
            return None
        theta = _refined(share[keep], residual[keep], step)
        return theta if _better(chain, data, theta, least) else None
    teeth = np.arange(TEETH[0], TEETH[1], 0.1) / np.ptp(share)
    wave = np.exp(2j * np.pi * np.outer(teeth, share[keep]))
    power = 2.0 * np.abs(wave @ residual[keep]) ** 2 / len(share[keep]) ** 2 / spread
    best = int(np.argmax(power))
    if power[best] < LEAST_SHARE:
        return None
    theta = _refined(share[keep], residual[keep], 1.0 / teeth[best])
    if not _standing(chain, data, float(theta[0])):
        return None
    return theta if _better(chain, data, theta, LEAST_GAIN) else None


def _carries_over(data: Data, rows: np.ndarray, share: np.ndarray, residual: np.ndarray, step: float) -> bool:
    """Whether step and phase from the other training records bring each nearer, taken together."""
    record = data.place[0][rows]
    before = after = 0.0
    for one in np.unique(record):
        own, others = record == one, record != one
        if not others.any():
            return False
        keep = slice(None, None, max(int(others.sum()) // 3000, 1))
        size, phase = _refined(share[others][keep], residual[others][keep], step)
        saw = phase + size * np.round((share[own] - phase) / size) - share[own]
        left = residual[own] - saw
        before += float(np.sum((residual[own] - residual[own].mean()) ** 2))
        after += float(np.sum((left - left.mean()) ** 2))
    return after < (1.0 - LEAST_STANDING_GAIN) ** 2 * before


def _better(chain: Chain, data: Data, theta: np.ndarray, least: float) -> bool:
    """Whether rounding takes a share `least` off the training error."""
    rows = data.train & data.known
    rounded = chain.with_effects((*chain.effects, EFFECT), (*chain.thetas, theta))
    errors = [float(np.sqrt(np.mean((data.output - c.predict(data))[rows] ** 2))) for c in (chain, rounded)]
    return errors[1] < (1.0 - least) * errors[0]


def _standing(chain: Chain, data: Data, step: float) -> bool:
    """Whether the readings themselves stand on steps of this size, each record's with a phase of its own.

    A law of another form leaves waves over the prediction too, but the readings run through them evenly.
    Readings that hold at few places agree by chance (Rayleigh's test): the fewer, the more agreement is
    asked for.
    """
    size = step * chain.gain * chain.scale[0]
    prediction = chain.predict(data)[:, 0]
    together, places, rows = 0.0, 0.0, 0
    for run in data.runs:
        known = data.known[run.part]
        if not run.train or known.sum() < 8:
            continue
        y = data.output[run.part, 0][known]
        together += len(y) * float(np.abs(np.mean(np.exp(2j * np.pi * y / size)))) ** 2
        places += float(np.sum(np.abs(np.diff(prediction[run.part])))) / (0.5 * size) + 1.0
        rows += len(y)
    agreement = np.sqrt(together / max(rows, 1))
    count = sum(run.train for run in data.runs)
    return bool(agreement > max(LEAST_STANDING, 1.7 / np.sqrt(max(places / max(count, 1), 1.0))))


def _refined(share: np.ndarray, residual: np.ndarray, step: float) -> np.ndarray:
    """Step and phase that leave least, on grids around the first guess."""
    best, found = np.inf, np.array([step, 0.0])
    for size in step * np.linspace(0.97, 1.03, 25):
        for phase in size * np.linspace(0.0, 1.0, 20, endpoint=False):
            saw = phase + size * np.round((share - phase) / size) - share
            left = float(np.mean((residual - saw) ** 2))
            if left < best:
                best, found = left, np.array([size, phase])
    return found


def quantised(
    decision: Decision, after: Chain, case: Case, step: float | None, resting: float | None = None
) -> tuple[Decision, Chain]:
    """Quantisation on top of what was found, or in its place where the lattice alone explains as much.

    `step`: SI, of the lattice that the readings are known to stand on; `resting`: that of readings which rest
    at a few places (`teeth`).
    """
    rows = case.full.train & case.full.known

    def size(chain: Chain) -> float:
        return float(np.sqrt(np.mean((case.full.output - chain.predict(case.full))[rows] ** 2)))

    for chain, chosen in ((case.chain, ()), (after, decision.chosen)):
        theta = lattice_theta(chain, case.full)
        if theta is None and not chosen and resting is not None:
            theta = lattice_theta(chain, case.full, resting, LEAST_GAIN)
        if theta is None and chosen == decision.chosen and decision.verdict != "unexplained":
            theta = lattice_theta(chain, case.full, step) if step is not None else None
        if theta is None:
            continue
        rounded = chain.with_effects((*chain.effects, EFFECT), (*chain.thetas, theta))
        if not chosen and decision.chosen and size(rounded) > 1.1 * size(after):
            continue
        rivals = {n: decision.rivals.get(n, []) for n in chosen}
        verdict = decision.verdict if chosen else "attributed"
        done = replace(
            decision, verdict=verdict, chosen=(*chosen, "quantisation"), rivals=rivals, detected=True
        )
        return done, rounded
    return decision, after
