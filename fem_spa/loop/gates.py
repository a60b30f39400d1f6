"""What a set of effects must pass besides explaining enough."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.folds import blocks, by_records
from fem_spa.loop.noise import Whitener
from fem_spa.loop.placebo import OF_THE_SESSION, as_good_elsewhere
from fem_spa.loop.search import FoldErrors, Trial, fold_errors

CARRIED_OVER = 0.5
"""Share of the fitted gain that must be there on records left out."""
ASIDE = 1.0
"""Offset of a record, as a share of the span, that puts what differs between records aside."""
ALONE = 0.7
"""Share of what is known of an effect that comes from one record, from which that record alone shows it."""


def gates(best: Trial, base: Trial, whiten: Whitener) -> tuple[str, ...]:
    """The reasons, in words, for which a set may not be named; none where it passes.

    Parameters
    ----------
    base : the base model alone
    whiten : with records' own offsets and gains as large as they are
    """
    data, chain = whiten.data, best.fit.chain
    session = any(EFFECTS[n].memory in OF_THE_SESSION for n in best.names)
    parts = blocks(data) if session else None
    errors, plain = (fold_errors(t, data, whiten, parts) for t in (best, base))
    failed = []
    if not by_records(data) and not _each_tells(best, base, whiten):
        failed.append("what is gained in the fit to one record is not there on the other")
    if by_records(data) and not _carried_over(errors, plain):
        failed.append("what is gained in the fit is not there on records left out of it")
    for effect, theta in zip(chain.effects, chain.thetas, strict=True):
        if not (theta[effect.amplitudes] > 1e-6).any():
            failed.append(f"{effect.name} is fitted as nothing")
    if not failed:
        failed = [
            f"{name} does as well with the history of other records or moments"
            for name in as_good_elsewhere(chain, data, whiten)
        ]
    return tuple(failed)


def _each_tells(best: Trial, base: Trial, whiten: Whitener) -> bool:
    """Of two records: whether what the fit to each gains is there within the other, its offset put aside."""
    data, noise = whiten.data, whiten.noise
    parts = [np.arange(run.part.start, run.part.stop) for run in data.runs if run.train]
    if len(parts) < 2:
        return True
    own = Whitener(
        data,
        replace(noise, offset=ASIDE * float(np.abs(whiten.response).max())),
        whiten.response,
        whiten.runs,
    )
    errors, plain = (fold_errors(t, data, own, parts) for t in (best, base))
    return _carried_over(errors, plain)


def _carried_over(errors: FoldErrors, base: FoldErrors) -> bool:
    """Whether enough of the gain is there on records left out.

    A record that alone shows an effect is excused where the others do not foretell it; where they do, it
    counts.
    """
    fitted, better = base.fitted - errors.fitted, base.left_out - errors.left_out
    judged = (errors.leverage < ALONE) | ((fitted > 0.0) & (better >= CARRIED_OVER * fitted))
    if not judged.any():
        return True
    gained = max(float(fitted[judged].sum()), 0.0)
    return bool(better[judged].sum() >= CARRIED_OVER * gained - 4.0 * errors.parameters)
