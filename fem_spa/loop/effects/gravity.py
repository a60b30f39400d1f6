"""Gravity: the actuator's own weight bends it, another way in another orientation."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.effects.weight import weighed
from fem_spa.loop.signatures.loads import pulled
from fem_spa.loop.signatures.statistic import Seen


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Turn by the body's weight."""
    if theta[0] == 0.0:
        return response
    return weighed(ctx, response, np.full(len(response), theta[0]), tip=False)


def orientations(ctx: Context) -> int:
    """How many orientations the training records have, 5 degrees apart."""
    return len({round(float(phi) / 0.0873) for phi in np.unique(ctx.data.orientation[ctx.data.train])})


def untestable(ctx: Context) -> str | None:
    """Without an angle, one orientation is an offset."""
    if "gravity" in ctx.physical:
        return None
    if ctx.physical:
        return "the model has it already"
    if "angle" not in ctx.names and orientations(ctx) < 2:
        return "one orientation only: weight is a constant offset there"
    return None


def turn(seen: Seen, share: float) -> np.ndarray:
    """(n, d) turn by such a weight of the body, SI."""
    response = seen.response / seen.gain
    size = np.full(len(response), share)
    return np.asarray(seen.gain * (weighed(seen.context, response, size, tip=False) - response))


EFFECT = Effect(
    name="gravity",
    family="load",
    slot="load",
    order=50,
    memory="static",
    parameters=(Param("weight", 0.0, 3.0, 0.05, "of span", True),),
    apply=apply,
    starts=lambda ctx: grid([0.03, 0.2, 0.6]),
    classmates=("payload",),
    untestable=untestable,
    experiment="flip",
    words="goes with the sine of the inclination, and changes sign with the mounting",
    signature=pulled("gravity", turn),
)
