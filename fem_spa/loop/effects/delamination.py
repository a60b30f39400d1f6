"""Delamination: at one moment the strain-limiting layer lets go, and the gain is another from then on."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param
from fem_spa.loop.signatures.history import STEP


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """s -> s (1 - loss after `moment`, as a share of all time)."""
    loss, gain, moment = theta
    if loss == 0.0 and gain == 0.0:
        return response
    time = (ctx.data.clock - ctx.data.clock[0]) / ctx.seconds
    after = np.clip((time - moment) / 1e-3, 0.0, 1.0)
    return np.asarray(ctx.rest + (response - ctx.rest) * (1.0 + (gain - loss) * after)[:, None])


def starts(ctx: Context) -> list[list[np.ndarray]]:
    """Moments at which the drive is at a new or old maximum of its record, both signs."""
    drive, time = np.abs(ctx.drive), (ctx.data.clock - ctx.data.clock[0]) / ctx.seconds
    moments = []
    for run in ctx.data.runs:
        if not run.train:
            continue
        x = drive[run.part]
        for part in np.array_split(np.arange(len(x)), 6):
            peak = part[int(np.argmax(x[part]))]
            if x[peak] > 0.5 * x.max():
                moments.append(float(time[run.part.start + peak]))
    moments = [m for m in moments if 0.02 < m < 0.98]
    return [[np.array([a, b, m])] for m in moments for a, b in ((0.1, 0.0), (0.0, 0.1))]


EFFECT = Effect(
    name="delamination",
    family="history",
    slot="stiffness",
    order=38,
    memory="max-history",
    parameters=(
        Param("loss", 0.0, 0.95, 0.1, "", True),
        Param("increase", 0.0, 2.0, 0.1, "", True),
        Param("moment", 0.0, 1.0, 0.5, "of all time"),
    ),
    apply=apply,
    starts=starts,
    experiment="repeat first record",
    words="one step in the gain, at one moment, that stays",
    signature=STEP,
)
