"""Sensor nonlinearity: the sensor's curve bends; independent of how the motion came about."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param
from fem_spa.loop.signatures.curves import BENDS


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """s -> s + (a - b)(s^2 - s) + (c - d)(s^3 - s)."""
    if not theta.any():
        return response
    s = ctx.share(response)
    a, b, c, d = theta
    return np.asarray(response + ctx.scale * ((a - b) * (s * s - s) + (c - d) * (s**3 - s)))


EFFECT = Effect(
    name="sensor-nonlinearity",
    family="sensor",
    slot="sensor",
    order=60,
    memory="static",
    parameters=tuple(
        Param(name, 0.0, 2.0, 0.05, "", True) for name in ("square up", "square down", "cube up", "cube down")
    ),
    apply=apply,
    starts=lambda ctx: [[0.05 * row for row in np.eye(4)]],
    classmates=("contact", "stiffening", "wall-thickness", "base-compliance"),
    experiment="second sensor",
    words="the reading is bent against the motion, the same at every rate and in every record",
    signature=BENDS,
)
