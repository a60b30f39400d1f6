"""Snap-through: the response jumps at one pressure up and at a lower one down."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.operators import play


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """s -> s + jump * (0..1), a steep step of a play: its middle at `at`, up and down `gap` apart."""
    jump, at, gap = theta
    if jump == 0.0:
        return response
    s = ctx.share(response)
    out = s.copy()
    for j in range(s.shape[1]):
        lagged = play(ctx.data, s[:, j], 0.5 * gap)
        out[:, j] += jump * 0.5 * (1.0 + np.tanh((lagged - at) / 0.012))
    return np.asarray(ctx.rest + ctx.scale * out)


EFFECT = Effect(
    name="snap-through",
    family="structure",
    slot="state",
    order=48,
    memory="rate-independent",
    parameters=(
        Param("jump", 0.0, 0.6, 0.1, "of span", True),
        Param("at", 0.05, 0.95, 0.5, "of span"),
        Param("gap", 0.0, 0.3, 0.08, "of span"),
    ),
    apply=apply,
    starts=lambda ctx: grid([0.1], [0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85], [0.04, 0.15]),
    experiment="slow ramp",
    words="a jump, at a higher pressure up than down",
)
