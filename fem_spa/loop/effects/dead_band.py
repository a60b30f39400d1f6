"""Dead-band: below a threshold the pressure does nothing (valve threshold, chamber that must first
unfold)."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid, soft_plus


def apply(ctx: Context, pressure: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """|p| loses the threshold; rounded over `width`."""
    threshold, width = theta
    if threshold == 0.0:
        return pressure
    p0, w = threshold * ctx.p_max, width * ctx.p_max
    size = soft_plus(np.abs(pressure) - p0, w) - soft_plus(-p0 * np.ones(1), w)
    return np.asarray(np.sign(pressure) * size)


EFFECT = Effect(
    name="dead-band",
    family="pneumatic",
    slot="input",
    order=12,
    memory="static",
    parameters=(
        Param("threshold", 0.0, 0.6, 0.08, "of pressure", True),
        Param("width", 0.004, 0.08, 0.01, "of pressure"),
    ),
    apply=apply,
    starts=lambda ctx: grid([0.02, 0.05, 0.1, 0.18, 0.3], [0.006, 0.03]),
    experiment="low ramp",
    words="no motion below a threshold of pressure",
)
