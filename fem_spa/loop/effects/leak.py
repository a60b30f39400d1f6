"""Leak: while the valve is shut (command held) the pressure droops; when it opens again it is restored."""

import itertools

import numpy as np
from scipy.signal import lfilter

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.operators import holding
from fem_spa.loop.signatures.rests import DROOP

RESTORE = 0.3
"""s in which an open valve restores what was lost."""


def apply(ctx: Context, pressure: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Loss grows at `rate` of the pressure that is left while the command stands, else it is restored."""
    rate = float(theta[0])
    if rate == 0.0:
        return pressure
    return np.stack([_one(ctx, column, rate) for column in pressure.T], axis=1)


def _one(ctx: Context, pressure: np.ndarray, rate: float) -> np.ndarray:
    still = holding(ctx.data, pressure)
    lost = np.zeros_like(pressure)
    for run in ctx.data.runs:
        a, b = run.part.start, run.part.stop
        edges = np.concatenate([[a], a + 1 + np.nonzero(np.diff(still[a:b].astype(int)))[0], [b]])
        state = 0.0
        for i0, i1 in itertools.pairwise(edges):
            n = i1 - i0
            if still[i0]:
                decay = np.exp(-rate * run.step)
                drive = pressure[i0:i1] * (1.0 - decay)
            else:
                decay, drive = np.exp(-run.step / RESTORE), np.zeros(n)
            lost[i0:i1] = lfilter([1.0], [1.0, -decay], drive, zi=np.array([decay * state]))[0]
            state = lost[i1 - 1]
    return pressure - lost


def untestable(ctx: Context) -> str | None:
    """Held commands are needed."""
    data = ctx.data
    still = np.zeros(len(data.clock), bool)
    for column in data.pressure.T:
        still |= holding(data, column)
    seconds = sum(float(np.sum(still[r.part])) * r.step for r in data.runs if r.train)
    return None if seconds > 2.0 else "no command is held long enough for a droop"


EFFECT = Effect(
    name="leak",
    family="pneumatic",
    slot="input",
    order=18,
    memory="fading",
    parameters=(Param("rate", 0.0, 0.3, 0.001, "1/s", True),),
    apply=apply,
    starts=lambda ctx: grid([3e-4, 2e-3, 1e-2]),
    untestable=untestable,
    experiment="closed valve",
    words="droops while the command is held, and is back when it moves on",
    signature=DROOP,
)
