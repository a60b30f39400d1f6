"""Creep: part of the response comes late, with a spectrum of times, and goes late after unloading."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param
from fem_spa.loop.operators import lowpass
from fem_spa.loop.signatures.rests import ONWARD

TIMES = (0.8, 4.0, 20.0, 100.0)
"""s: retardation times of the Prony series; their shares are free."""


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """y -> y + sum_i g_i (lag of tau_i) y."""
    out = response
    for share, tau in zip(theta, TIMES, strict=True):
        if share > 0.0:
            out = out + share * (lowpass(ctx.data, response, tau, ctx.rest) - ctx.rest)
    return np.asarray(out)


def starts(ctx: Context) -> list[list[np.ndarray]]:
    """All times that the records are long enough for."""
    use = [i for i, tau in enumerate(TIMES) if tau < 1.5 * ctx.data.longest] or [0]
    return [[0.1 * np.eye(len(TIMES))[i] for i in use]]


EFFECT = Effect(
    name="creep",
    family="viscoelastic",
    slot="state",
    order=40,
    memory="fading",
    parameters=tuple(Param(f"share at {tau:g} s", 0.0, 3.0, 0.05, "", True) for tau in TIMES),
    apply=apply,
    starts=starts,
    experiment="hold and recovery",
    words="goes on moving in holds, and comes back late after unloading",
    signature=ONWARD,
)
