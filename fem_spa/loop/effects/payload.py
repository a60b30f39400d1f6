"""Payload: a mass at the tip."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.effects.gravity import turn as body
from fem_spa.loop.effects.gravity import untestable as same_orientation
from fem_spa.loop.effects.weight import weighed
from fem_spa.loop.signatures.loads import pulled
from fem_spa.loop.signatures.statistic import Seen


def loads(ctx: Context) -> np.ndarray:
    """(n,) payload as a share of the largest; one where none is stated."""
    most = float(ctx.data.payload.max())
    return ctx.data.payload / most if most > 0.0 else np.ones(len(ctx.data.clock))


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Turn by a weight at the tip, in proportion to the payload where it is stated."""
    if theta[0] == 0.0:
        return response
    return weighed(ctx, response, theta[0] * loads(ctx), tip=True)


def untestable(ctx: Context) -> str | None:
    """Stated as zero throughout: there is none."""
    train = ctx.data.train
    if "payload" in ctx.physical:
        return "the payload is the model's own" if ctx.data.payload.max() > 0.0 else None
    if ctx.data.weighed and float(ctx.data.payload[train].max()) == 0.0:
        return "every training record states a payload of zero"
    if ctx.data.weighed and len(np.unique(ctx.data.payload[train])) > 1:
        return None
    return same_orientation(ctx)


def turn(seen: Seen, share: float) -> np.ndarray:
    """(n, d) turn by such a payload, SI."""
    response = seen.response / seen.gain
    size = share * loads(seen.context)
    return np.asarray(seen.gain * (weighed(seen.context, response, size, tip=True) - response))


EFFECT = Effect(
    name="payload",
    family="load",
    slot="load",
    order=52,
    memory="static",
    parameters=(Param("weight", 0.0, 3.0, 0.05, "of span", True),),
    apply=apply,
    starts=lambda ctx: grid([0.03, 0.2, 0.6]),
    classmates=("gravity",),
    untestable=untestable,
    experiment="known masses",
    words="scales with the mass at the tip",
    signature=pulled("payload", turn, body),
)
