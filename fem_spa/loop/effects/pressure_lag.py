"""Pressure lag: valve and line fill and empty with time constants, or at rates, of their own."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.operators import lag_up_down, lowpass, rate_limited
from fem_spa.loop.signatures.loops import FILLING


def apply(ctx: Context, pressure: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """First order, time constant `rise` up and `rise` times `fall` down; the rate at most p_max in `slew` up,
    in `slew` times `fall` down (a choked orifice, a valve that takes its time a bar)."""
    rise, fall, slew = theta
    if slew > 0.0:
        up = ctx.p_max / float(slew)
        pressure = np.stack([rate_limited(ctx.data, c, up, up / float(fall)) for c in pressure.T], axis=1)
    if rise == 0.0:
        return pressure
    if fall == 1.0:
        return lowpass(ctx.data, pressure, float(rise))
    columns = [lag_up_down(ctx.data, column, float(rise), float(rise * fall)) for column in pressure.T]
    return np.stack(columns, axis=1)


EFFECT = Effect(
    name="pressure-lag",
    family="pneumatic",
    slot="input",
    order=16,
    memory="fading",
    parameters=(
        Param("rise", 0.0, 5.0, 0.15, "s", True),
        Param("fall", 0.4, 6.0, 1.5, "times rise"),
        Param("slew", 0.0, 10.0, 0.3, "s for the largest pressure", True),
    ),
    apply=apply,
    starts=lambda ctx: [
        *grid([0.04, 0.15, 0.5, 1.5], [1.0, 2.2], [0.0]),
        *grid([0.0], [1.0, 2.5], [0.25, 1.0]),
    ],
    classmates=("viscous-lag", "sensor-lag"),
    experiment="measured pressure",
    words="late after changes of pressure, rise and fall unlike",
    signature=FILLING,
)
