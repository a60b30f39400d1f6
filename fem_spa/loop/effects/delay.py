"""Delay: everything comes later by a fixed time (transport in the line, a clock that is off)."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.operators import delayed
from fem_spa.loop.signatures.loops import LATER


def apply(ctx: Context, pressure: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Pressure of `delay` seconds ago."""
    if theta[0] == 0.0:
        return pressure
    return delayed(ctx.data, pressure, float(theta[0]))


EFFECT = Effect(
    name="delay",
    family="pneumatic",
    slot="input",
    order=14,
    memory="fading",
    parameters=(Param("delay", 0.0, 2.0, 0.05, "s", True),),
    apply=apply,
    starts=lambda ctx: grid([0.02, 0.035, 0.06, 0.09, 0.13, 0.18, 0.25, 0.35, 0.5, 0.7, 1.0]),
    experiment="steps",
    words="the whole motion comes later by the same time at every rate",
    signature=LATER,
)
