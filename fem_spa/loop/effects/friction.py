"""Friction: walls or fibres rub, the more the larger the load on them: plateaus after each reversal."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param
from fem_spa.loop.operators import sliding
from fem_spa.loop.signatures.loops import GAP

QUARTERS = (-1.150, -0.319, 0.319, 1.150)
"""Normal deviates in the middle of four equal parts of all places that rub."""


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """s -> s - the mean of what sticking places hold back: springs that slide at stick + rub |s|.

    A spring of stiffness `hold` (the actuator's own is 1) holds back `hold` of the motion until it slides.
    Places let go one after the other (Iwan, Journal of Applied Mechanics 33, 893, 1966): their stiffnesses
    are `hold` times a log-normal number, of the deviation `spread`. Above 1 the output runs on a little after
    a reversal.
    """
    stick, rub, hold, spread = theta
    if stick == 0.0 and rub == 0.0:
        return response
    s = ctx.share(response)
    out = s.copy()
    holds = hold * np.exp(spread * np.array(QUARTERS)) if spread > 0.0 else np.array([hold])
    for j in range(s.shape[1]):
        limit = stick + rub * np.abs(s[:, j])
        out[:, j] -= sum(sliding(ctx.data, s[:, j], h, limit, stick) for h in holds) / len(holds)
    return np.asarray(ctx.rest + ctx.scale * out)


EFFECT = Effect(
    name="friction",
    family="rate-independent",
    slot="load",
    order=56,
    memory="rate-independent",
    parameters=(
        Param("stick", 0.0, 1.0, 0.02, "of span", True),
        Param("rub", 0.0, 1.0, 0.02, "of the response", True),
        Param("hold", 0.1, 3.0, 0.7, "of the actuator's stiffness"),
        Param("spread", 0.0, 1.5, 0.5, "of the logarithm"),
    ),
    apply=apply,
    starts=lambda ctx: [
        [np.array([0.02, 0.0, hold, 0.5]), np.array([0.0, 0.02, hold, 0.5])] for hold in (0.3, 0.8, 2.0)
    ],
    classmates=("hysteresis", "dead-band"),
    experiment="rates",
    words="plateaus after reversals, of the same size at every rate",
    signature=GAP,
)
