"""Hysteresis of the material, independent of rate: Prandtl-Ishlinskii, a sum of stops."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param
from fem_spa.loop.operators import play
from fem_spa.loop.signatures.loops import GAP

RADII = (0.03, 0.08, 0.18, 0.36)
"""Thresholds as shares of the response; their weights are free."""


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """s -> s - sum_j w_j (s - play_j(s) - middle m_j(s)): the response lags by what the stops hold back.

    A stop's loop over the whole range lies about a bent curve m_j. Whether a base curve has that bend already
    (it is the middle of the loops) or not (it is the first loading) no one knows: `middle` is its share.
    """
    weights, share = theta[:-1], float(theta[-1])
    if not weights.any():
        return response
    s = ctx.share(response)
    held = np.zeros_like(s)
    for weight, radius in zip(weights, RADII, strict=True):
        if weight > 0.0:
            for j in range(s.shape[1]):
                stop = s[:, j] - play(ctx.data, s[:, j], radius)
                held[:, j] += weight * (stop - share * middle(s[:, j], radius))
    return np.asarray(response - ctx.scale * held)


def middle(s: np.ndarray, radius: float) -> np.ndarray:
    """(n,) the middle of what a stop holds back, rising and falling between 0 and 1."""
    up, down = (np.clip(s + shift, -radius, radius) for shift in (-radius, radius - 1.0))
    return np.asarray(0.5 * (up + down))


def starts(ctx: Context) -> list[list[np.ndarray]]:
    """Each threshold alone; the base the middle of the loops, or the first loading."""
    return [[np.append(0.3 * row, share) for row in np.eye(len(RADII))] for share in (1.0, 0.0)]


EFFECT = Effect(
    name="hysteresis",
    family="rate-independent",
    slot="state",
    order=42,
    memory="rate-independent",
    parameters=(
        *(Param(f"weight at {r:g}", 0.0, 1.0, 0.1, "", True) for r in RADII),
        Param("middle", 0.0, 1.0, 0.5),
    ),
    apply=apply,
    starts=starts,
    classmates=("friction", "dead-band"),
    experiment="rates",
    words="loops between rise and fall that do not shrink when driven slower",
    signature=GAP,
)
