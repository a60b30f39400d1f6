"""Saturation: the supply gives no more than a certain pressure."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid, soft_plus
from fem_spa.loop.signatures.curves import PLATEAU


def apply(ctx: Context, pressure: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Pressure above (1 - cut) of the largest is not reached; rounded over `width`."""
    cut, width = theta
    if cut == 0.0:
        return pressure
    top, w = (1.0 - cut) * ctx.p_max, width * ctx.p_max
    return np.asarray(pressure - soft_plus(pressure - top, w) + soft_plus(-top * np.ones(1), w))


EFFECT = Effect(
    name="saturation",
    family="pneumatic",
    slot="input",
    order=10,
    memory="static",
    parameters=(
        Param("cut", 0.0, 0.6, 0.15, "of pressure", True),
        Param("width", 0.004, 0.12, 0.02, "of pressure"),
    ),
    apply=apply,
    starts=lambda ctx: grid([0.05, 0.12, 0.2, 0.3, 0.45], [0.01, 0.05]),
    experiment="overdrive",
    words="a plateau at the largest pressures",
    signature=PLATEAU,
)
