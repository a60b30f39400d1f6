"""Dead-band: below a threshold the pressure does nothing (chamber that must first unfold), or the valve
waits until the command is off by some pressure, at every reversal."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid, soft_plus
from fem_spa.loop.operators import play
from fem_spa.loop.signatures.curves import THRESHOLD


def apply(ctx: Context, pressure: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """|p| loses the threshold, rounded over `width`; above it a share `back` of what was lost is there
    again. Before that the valve follows with a backlash of half width `play`."""
    threshold, back, width, slack = theta
    if slack > 0.0:
        columns = [play(ctx.data, column, slack * ctx.p_max) for column in pressure.T]
        pressure = np.stack(columns, axis=1)
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
        Param("play", 0.0, 0.3, 0.02, "of pressure", True),
    ),
    apply=apply,
    starts=lambda ctx: [
        *grid([0.02, 0.05, 0.1, 0.18, 0.3], [0.0, 1.0], [0.015], [0.0]),
        *grid([0.0], [0.0], [0.015], [0.01, 0.03, 0.08]),
    ],
    classmates=("hysteresis", "friction"),
    experiment="low ramp",
    words="no motion below a threshold of pressure, or for some pressure after each reversal",
    signature=THRESHOLD,
)
