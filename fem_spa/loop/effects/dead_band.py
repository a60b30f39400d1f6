"""Dead-band: below a threshold the pressure does nothing (valve threshold, chamber that must first
unfold)."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid, soft_plus


def apply(ctx: Context, pressure: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """|p| loses the threshold, rounded over `width`; above it a share `back` of what was lost is there
    again."""
    threshold, back, width = theta
    if threshold == 0.0:
        return pressure
    p0, w = threshold * ctx.p_max, width * ctx.p_max
    beyond = np.abs(pressure) - p0
    size = soft_plus(beyond, w) - soft_plus(-p0 * np.ones(1), w)
    open_share = 0.5 * (1.0 + np.tanh(beyond / w)) - 0.5 * (1.0 + np.tanh(-p0 / w))
    return np.asarray(np.sign(pressure) * (size + back * p0 * open_share))


EFFECT = Effect(
    name="dead-band",
    family="pneumatic",
    slot="input",
    order=12,
    memory="static",
    parameters=(
        Param("threshold", 0.0, 0.6, 0.08, "of pressure", True),
        Param("back", 0.0, 1.0, 0.0, "of the threshold"),
        Param("width", 0.004, 0.08, 0.01, "of pressure"),
    ),
    apply=apply,
    starts=lambda ctx: grid([0.02, 0.05, 0.1, 0.18, 0.3], [0.0, 1.0], [0.015]),
    experiment="low ramp",
    words="no motion below a threshold of pressure",
)
