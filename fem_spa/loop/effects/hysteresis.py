"""Hysteresis of the material, independent of rate: Prandtl-Ishlinskii, a sum of stops."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param
from fem_spa.loop.operators import play

RADII = (0.03, 0.08, 0.18, 0.36)
"""Thresholds as shares of the response; their weights are free."""


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """s -> s - sum_j w_j (s - play_j(s)): the response lags behind by what the stops hold back."""
    if not theta.any():
        return response
    s = ctx.share(response)
    held = np.zeros_like(s)
    for weight, radius in zip(theta, RADII, strict=True):
        if weight > 0.0:
            for j in range(s.shape[1]):
                held[:, j] += weight * (s[:, j] - play(ctx.data, s[:, j], radius))
    return np.asarray(response - ctx.scale * held)


EFFECT = Effect(
    name="hysteresis",
    family="rate-independent",
    slot="state",
    order=42,
    memory="rate-independent",
    parameters=tuple(Param(f"weight at {r:g}", 0.0, 1.0, 0.1, "", True) for r in RADII),
    apply=apply,
    starts=lambda ctx: [[0.3 * row for row in np.eye(len(RADII))]],
    classmates=("friction", "dead-band"),
    experiment="rates",
    words="loops between rise and fall that do not shrink when driven slower",
)
