"""Hysteresis of the material, independent of rate: Prandtl-Ishlinskii, a sum of stops."""

import numpy as np

from fem_spa.loop.data import Data
from fem_spa.loop.effects.effect import Context, Effect, Param
from fem_spa.loop.operators import play
from fem_spa.loop.signatures.loops import GAP

RADII = (0.03, 0.08, 0.18, 0.36)
"""Thresholds as shares of the largest pressure, or of the response; their weights are free."""


def before(ctx: Context, pressure: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """q -> q - (1 - k) held(q): loops of one width in the pressure, `in the output` k."""
    weights, share, outside = theta[:-2], float(theta[-2]), float(theta[-1])
    if outside == 1.0 or not weights.any():
        return pressure
    held = [_held(ctx.data, column, weights, share) for column in (pressure / ctx.p_max).T]
    return np.asarray(pressure - ctx.p_max * (1.0 - outside) * np.stack(held, axis=1))


def after(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """s -> s - k held(s): loops of one width in the output."""
    weights, share, outside = theta[:-2], float(theta[-2]), float(theta[-1])
    if outside == 0.0 or not weights.any():
        return response
    held = [_held(ctx.data, column, weights, share) for column in ctx.share(response).T]
    return np.asarray(response - ctx.scale * outside * np.stack(held, axis=1))


def _held(data: Data, x: np.ndarray, weights: np.ndarray, share: float) -> np.ndarray:
    """(n,) what the stops hold back: sum_j w_j (x - play_j(x) - middle m_j(x)).

    A stop's loop over the whole range lies about a bent curve m_j. Whether a base curve has that bend already
    (it is the middle of the loops) or not (it is the first loading) no one knows: `middle` is its share.
    """
    out = np.zeros_like(x)
    for weight, radius in zip(weights, RADII, strict=True):
        if weight > 0.0:
            out += weight * (x - play(data, x, radius) - share * middle(x, radius))
    return out


def middle(s: np.ndarray, radius: float) -> np.ndarray:
    """(n,) the middle of what a stop holds back, rising and falling between 0 and 1."""
    up, down = (np.clip(s + shift, -radius, radius) for shift in (-radius, radius - 1.0))
    return np.asarray(0.5 * (up + down))


def starts(ctx: Context) -> list[list[np.ndarray]]:
    """Each threshold alone; the base the middle of the loops, or the first loading; in pressure or output."""
    kinds = ((1.0, 0.0), (0.0, 0.0), (1.0, 1.0))
    return [[np.concatenate([0.3 * row, kind]) for row in np.eye(len(RADII))] for kind in kinds]


EFFECT = Effect(
    name="hysteresis",
    family="rate-independent",
    slot="actuation",
    order=26,
    memory="rate-independent",
    parameters=(
        *(Param(f"weight at {r:g}", 0.0, 1.0, 0.1, "", True) for r in RADII),
        Param("middle", 0.0, 1.0, 0.5),
        Param("in the output", 0.0, 1.0, 0.5),
    ),
    apply=before,
    after=after,
    starts=starts,
    classmates=("friction", "dead-band"),
    experiment="rates",
    words="loops between rise and fall that do not shrink when driven slower",
    signature=GAP,
)
