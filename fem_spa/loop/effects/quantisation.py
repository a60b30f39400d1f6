"""Quantisation: the sensor gives whole steps only."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """The nearest whole step."""
    step = float(theta[0])
    if step == 0.0:
        return response
    return np.asarray(step * ctx.scale * np.round(response / (step * ctx.scale)))


EFFECT = Effect(
    name="quantisation",
    family="sensor",
    slot="sensor",
    order=66,
    memory="static",
    parameters=(Param("step", 0.0, 0.2, 0.01, "of span", True),),
    apply=apply,
    starts=lambda ctx: [],
    experiment="second sensor",
    words="readings stand on a lattice of whole steps",
)
