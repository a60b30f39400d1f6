"""Sensor drift: the reading wanders with time, whatever the actuator does."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.signatures.history import TIME


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """y -> y + (up - down) (t / t_all)^b."""
    up, down, b = theta
    if up == 0.0 and down == 0.0:
        return response
    clock = ctx.data.clock - ctx.data.clock[0]
    return np.asarray(response + ctx.scale * (up - down) * ((clock / ctx.seconds) ** b)[:, None])


EFFECT = Effect(
    name="sensor-drift",
    family="sensor",
    slot="sensor",
    order=64,
    memory="time",
    parameters=(
        Param("up", 0.0, 1.0, 0.03, "of span", True),
        Param("down", 0.0, 1.0, 0.03, "of span", True),
        Param("exponent", 0.3, 2.0, 1.0, ""),
    ),
    apply=apply,
    starts=lambda ctx: [*grid([0.03], [0.0], [0.5, 1.0]), *grid([0.0], [0.03], [0.5, 1.0])],
    classmates=("fatigue", "temperature"),
    experiment="zero load",
    words="the reading at rest wanders with time",
    signature=TIME,
)
