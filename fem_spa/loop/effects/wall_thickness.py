"""Wall thickness: another wall needs another pressure for the same shape: the curve's pressure axis is
scaled."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.signatures.curves import AXIS


def apply(ctx: Context, pressure: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Pressure divided by what the wall is stiffer: 1 + thicker - thinner."""
    thicker, thinner = theta
    if thicker == 0.0 and thinner == 0.0:
        return pressure
    return np.asarray(pressure / (1.0 + thicker - thinner))


EFFECT = Effect(
    name="wall-thickness",
    family="structure",
    slot="actuation",
    order=24,
    memory="static",
    parameters=(Param("stiffer", 0.0, 2.0, 0.1, "", True), Param("softer", 0.0, 0.7, 0.1, "", True)),
    apply=apply,
    starts=lambda ctx: [*grid([0.1, 0.3], [0.0]), *grid([0.0], [0.1, 0.25])],
    classmates=("contact", "stiffening", "sensor-nonlinearity", "base-compliance"),
    experiment="second specimen",
    words="another shape of the curve, the same up and down and at every rate",
    signature=AXIS,
)
