"""Fatigue: each cycle leaves the actuator a little softer, or with a little less motion, and rest does not
bring it back."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.operators import travelled
from fem_spa.loop.signatures.history import CYCLES


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """s -> s (1 + (a - c) (N / N_all)^b), N cycles so far."""
    a, c, b = theta
    if a == 0.0 and c == 0.0:
        return response
    cycles = travelled(ctx.data, ctx.drive)
    return np.asarray(
        ctx.rest + (response - ctx.rest) * (1.0 + (a - c) * (cycles / ctx.cycles) ** b)[:, None]
    )


EFFECT = Effect(
    name="fatigue",
    family="history",
    slot="stiffness",
    order=34,
    memory="cycle",
    parameters=(
        Param("softening", 0.0, 3.0, 0.03, "", True),
        Param("loss", 0.0, 0.95, 0.03, "", True),
        Param("exponent", 0.1, 2.5, 1.0, ""),
    ),
    apply=apply,
    starts=lambda ctx: [*grid([0.05], [0.0], [0.3, 1.0, 2.0]), *grid([0.0], [0.05], [0.3, 1.0, 2.0])],
    classmates=("temperature", "sensor-drift"),
    experiment="rest",
    words="grows from cycle to cycle and does not recover",
    signature=CYCLES,
)
