"""Cross-coupling: the pressure of one chamber acts in its neighbours."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.signatures.chambers import NEIGHBOURS


def apply(ctx: Context, pressure: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Each pressure gets `share` of what its neighbours have above it, and `product` of their product."""
    share, product = theta
    if share == 0.0 and product == 0.0:
        return pressure
    m = pressure.shape[1]
    others = (pressure.sum(axis=1, keepdims=True) - pressure) / max(m - 1, 1)
    return np.asarray(pressure + share * others + product * pressure * others / ctx.p_max)


EFFECT = Effect(
    name="cross-coupling",
    family="asymmetry",
    slot="actuation",
    order=22,
    memory="static",
    parameters=(Param("share", 0.0, 0.5, 0.05, "", True), Param("product", 0.0, 0.5, 0.05, "", True)),
    apply=apply,
    starts=lambda ctx: [*grid([0.05], [0.0]), *grid([0.0], [0.05])],
    untestable=lambda ctx: "one pressure only" if ctx.data.pressure.shape[1] < 2 else None,
    experiment="single chambers",
    words="a chamber moves what only its neighbour is asked to move",
    signature=NEIGHBOURS,
)
