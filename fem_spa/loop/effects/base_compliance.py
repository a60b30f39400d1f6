"""Base compliance: the clamp turns under the actuator's own moment, in proportion to the pressure."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.signatures.curves import PROPORTION


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """y -> y + c (pressure), along the response's own direction."""
    if theta[0] == 0.0:
        return response
    return np.asarray(response + theta[0] * ctx.scale * ctx.drive[:, None])


EFFECT = Effect(
    name="base-compliance",
    family="structure",
    slot="load",
    order=58,
    memory="static",
    parameters=(Param("turn", 0.0, 5.0, 0.05, "of span", True),),
    apply=apply,
    starts=lambda ctx: grid([0.05, 0.3, 2.0]),
    classmates=("contact", "stiffening", "wall-thickness", "sensor-nonlinearity"),
    experiment="base marker",
    words="a rigid turn of the whole actuator, in proportion to the pressure",
    signature=PROPORTION,
)
