"""Quantisation: the sensor gives whole steps only."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param
from fem_spa.loop.signatures.jumps import SAW


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """The nearest of phase + k step."""
    step, phase = float(theta[0]), float(theta[1])
    if step == 0.0:
        return response
    share = response / ctx.scale
    return np.asarray(ctx.scale * (phase + step * np.round((share - phase) / step)))


EFFECT = Effect(
    name="quantisation",
    family="sensor",
    slot="sensor",
    order=66,
    memory="static",
    parameters=(Param("step", 0.0, 0.3, 0.01, "of span", True), Param("phase", 0.0, 0.3, 0.0, "of span")),
    apply=apply,
    starts=lambda ctx: [],
    experiment="second sensor",
    words="readings stand on a lattice of whole steps",
    signature=SAW,
)
