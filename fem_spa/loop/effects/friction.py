"""Friction: walls or fibres rub, the more the larger the load on them: plateaus after each reversal."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param
from fem_spa.loop.operators import play


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """s -> s - (stick + rub |s|) times the held-back share, +1 moving up, -1 down, turning within `way`."""
    stick, rub, way = theta
    if stick == 0.0 and rub == 0.0:
        return response
    s = ctx.share(response)
    out = s.copy()
    for j in range(s.shape[1]):
        held = (s[:, j] - play(ctx.data, s[:, j], way)) / way
        out[:, j] -= (stick + rub * np.abs(s[:, j])) * held
    return np.asarray(ctx.rest + ctx.scale * out)


EFFECT = Effect(
    name="friction",
    family="rate-independent",
    slot="load",
    order=56,
    memory="rate-independent",
    parameters=(
        Param("stick", 0.0, 1.0, 0.02, "of span", True),
        Param("rub", 0.0, 1.0, 0.02, "", True),
        Param("way", 0.004, 0.2, 0.02, "of span"),
    ),
    apply=apply,
    starts=lambda ctx: [
        [np.array([0.02, 0.0, way]), np.array([0.0, 0.02, way])] for way in (0.008, 0.025, 0.07)
    ],
    classmates=("hysteresis", "dead-band"),
    experiment="rates",
    words="plateaus after reversals, of the same size at every rate",
)
