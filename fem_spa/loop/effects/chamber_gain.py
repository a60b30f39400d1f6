"""Chamber gain: the chambers of one actuator do not do the same for the same pressure."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param
from fem_spa.loop.signatures.chambers import CHAMBER


def apply(ctx: Context, pressure: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Pressures times 1 + g_j; the common gain is the base model's."""
    if not theta.any():
        return pressure
    gains = np.zeros(pressure.shape[1])
    gains[: min(len(theta) // 2, len(gains))] = (theta[0::2] - theta[1::2])[: len(gains)]
    return np.asarray(pressure * (1.0 + gains))


def starts(ctx: Context) -> list[list[np.ndarray]]:
    """Each of the first chambers stronger and weaker."""
    count = min(ctx.data.pressure.shape[1] - 1, 3) if ctx.data.pressure.shape[1] < 4 else 3
    return [[0.1 * np.eye(6)[2 * j + k] for j in range(count) for k in (0, 1)]]


EFFECT = Effect(
    name="chamber-gain",
    family="asymmetry",
    slot="actuation",
    order=20,
    memory="static",
    parameters=tuple(
        Param(f"chamber {j} {word}", 0.0, 0.6, 0.1, "", True) for j in (1, 2, 3) for word in ("more", "less")
    ),
    apply=apply,
    starts=starts,
    untestable=lambda ctx: "one pressure only" if ctx.data.pressure.shape[1] < 2 else None,
    experiment="single chambers",
    words="one chamber does more than the others at the same pressure",
    signature=CHAMBER,
)
