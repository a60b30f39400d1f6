"""Sensor lag: the sensor (its filter) follows late."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.operators import staged_lag
from fem_spa.loop.signatures.loops import READ_LATE


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Lag of the reading: one stage, and two equal faster ones where a single stage is too sudden."""
    return staged_lag(ctx.data, response, theta, ctx.rest)


EFFECT = Effect(
    name="sensor-lag",
    family="sensor",
    slot="sensor",
    order=62,
    memory="fading",
    parameters=(
        Param("time constant", 0.0, 5.0, 0.15, "s", True),
        Param("further stages", 0.0, 2.0, 0.05, "s", True),
    ),
    apply=apply,
    starts=lambda ctx: [*grid([0.03, 0.1, 0.3, 0.9, 2.5], [0.0]), *grid([0.0], [0.05, 0.3])],
    classmates=("viscous-lag", "pressure-lag"),
    experiment="second sensor",
    words="late after every change, loops that shrink when driven slower",
    signature=READ_LATE,
)
