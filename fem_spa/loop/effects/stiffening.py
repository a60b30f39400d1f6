"""Stiffening: the rubber stiffens with stretch, so the response flattens smoothly."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.signatures.curves import BEND


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """s -> s / (1 + a |s|^n)."""
    a, n = theta
    if a == 0.0:
        return response
    s = ctx.share(response)
    return np.asarray(ctx.rest + ctx.scale * s / (1.0 + a * np.abs(s) ** n))


EFFECT = Effect(
    name="stiffening",
    family="structure",
    slot="stiffness",
    order=30,
    memory="static",
    parameters=(Param("amount", 0.0, 20.0, 0.1, "", True), Param("exponent", 1.0, 6.0, 2.0, "")),
    apply=apply,
    starts=lambda ctx: grid([0.1, 0.4, 2.0], [1.0, 2.0, 4.0]),
    classmates=("contact", "wall-thickness", "sensor-nonlinearity", "base-compliance"),
    experiment="second sensor",
    words="the response flattens smoothly towards large motion, the same up and down",
    signature=BEND,
)
