"""Contact: walls touch, or lift off, at one state: the slope changes there."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid, soft_plus
from fem_spa.loop.signatures.curves import HINGE


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """s -> s + (steeper - flatter) max(s - at, 0), rounded over `width`."""
    flatter, steeper, at, width = theta
    if flatter == 0.0 and steeper == 0.0:
        return response
    s = ctx.share(response)
    bend = soft_plus(s - at, width) - soft_plus(-at * np.ones(1), width)
    return np.asarray(response + ctx.scale * (steeper - flatter) * bend)


EFFECT = Effect(
    name="contact",
    family="structure",
    slot="load",
    order=54,
    memory="static",
    parameters=(
        Param("flatter", 0.0, 0.95, 0.3, "", True),
        Param("steeper", 0.0, 2.0, 0.3, "", True),
        Param("at", 0.05, 0.95, 0.5, "of span"),
        Param("width", 0.005, 0.12, 0.02, "of span"),
    ),
    apply=apply,
    starts=lambda ctx: [
        *grid([0.3], [0.0], [0.15, 0.3, 0.45, 0.6, 0.75, 0.88], [0.02]),
        *grid([0.0], [0.3], [0.15, 0.3, 0.45, 0.6, 0.75, 0.88], [0.02]),
    ],
    classmates=("stiffening", "wall-thickness", "sensor-nonlinearity", "base-compliance"),
    experiment="known masses",
    words="the slope changes at one state, the same up and down",
    signature=HINGE,
)
