"""Snap-through: the response jumps at one pressure up and at a lower one down."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.operators import lowpass, play
from fem_spa.loop.signatures.jumps import JUMP


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """s -> s + jump * (0..1), a steep step of a play: its middle at `at`, up and down `gap` apart."""
    jump, at, gap, width, settling = theta
    if jump == 0.0:
        return response
    s = ctx.share(response)
    out = s.copy()
    for j in range(s.shape[1]):
        lagged = play(ctx.data, s[:, j], 0.5 * gap)
        state = 0.5 * (1.0 + np.tanh((lagged - at) / width))
        out[:, j] += jump * (lowpass(ctx.data, state, settling) if settling > 1e-3 else state)
    return np.asarray(ctx.rest + ctx.scale * out)


EFFECT = Effect(
    name="snap-through",
    family="structure",
    slot="state",
    order=48,
    memory="rate-independent",
    parameters=(
        Param("jump", 0.0, 1.5, 0.1, "of span", True),
        Param("at", 0.05, 0.95, 0.5, "of span"),
        Param("gap", 0.0, 0.4, 0.08, "of span"),
        Param("width", 0.004, 0.05, 0.015, "of span"),
        Param("settling", 0.0, 2.0, 0.1, "s"),
    ),
    apply=apply,
    starts=lambda ctx: grid([0.1], [0.1 + 0.04 * k for k in range(21)], [0.03, 0.1, 0.22], [0.02], [0.1]),
    experiment="slow ramp",
    words="a jump, at a higher pressure up than down",
    signature=JUMP,
)
