"""Pressure lag: valve and line fill and empty with time constants of their own."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.operators import lag_up_down, lowpass


def apply(ctx: Context, pressure: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """First order, time constant `rise` up and `rise` times `fall` down."""
    rise, fall = theta
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
    parameters=(Param("rise", 0.0, 5.0, 0.15, "s", True), Param("fall", 0.4, 6.0, 1.5, "times rise")),
    apply=apply,
    starts=lambda ctx: grid([0.04, 0.15, 0.5, 1.5], [1.0, 2.2]),
    classmates=("viscous-lag", "sensor-lag"),
    experiment="measured pressure",
    words="late after changes of pressure, rise and fall unlike",
)
