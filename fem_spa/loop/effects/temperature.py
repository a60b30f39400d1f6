"""Temperature: the rubber's stiffness follows its temperature, logged or as it warms while it works."""

import numpy as np
from scipy.ndimage import uniform_filter1d

from fem_spa.loop.effects.effect import Context, Effect, Param, grid
from fem_spa.loop.operators import lowpass
from fem_spa.loop.signatures.history import warmed

WARMING = 300.0
"""s in which an unlogged body warms, in its mark."""
LOG_SMOOTHED = 20.0
"""s over which a logged temperature is averaged: a body does not follow the grain of its thermometer."""


def warmth(ctx: Context, tau: float) -> np.ndarray:
    """(n,) deviation of temperature: in 10 K where it was logged, else of a body heated while it is
    driven."""
    logged = ctx.data.temperature
    if logged is not None:
        slow = np.empty_like(logged)
        for run in ctx.data.runs:
            rows = max(int(LOG_SMOOTHED / run.step), 1)
            slow[run.part] = uniform_filter1d(logged[run.part], rows, mode="nearest")
        return np.asarray((slow - slow[0]) / 10.0)
    return lowpass(ctx.data, np.minimum(np.abs(ctx.drive) * 2.0, 1.0), tau)


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """s -> s (1 + (softer - stiffer) warmth)."""
    softer, stiffer, tau = theta
    if softer == 0.0 and stiffer == 0.0:
        return response
    factor = 1.0 + (softer - stiffer) * warmth(ctx, float(tau))
    return np.asarray(ctx.rest + (response - ctx.rest) * factor[:, None])


def starts(ctx: Context) -> list[list[np.ndarray]]:
    """Both signs; without a log over a decade of warming times."""
    taus = [300.0] if ctx.data.temperature is not None else [60.0, 300.0, 1500.0]
    return [*grid([0.05], [0.0], taus), *grid([0.0], [0.05], taus)]


def untestable(ctx: Context) -> str | None:
    """A log that hardly moves shows nothing."""
    logged = ctx.data.temperature
    if logged is not None and float(np.ptp(logged[ctx.data.train])) < 0.5:
        return "the logged temperature moves by less than 0.5 K"
    return None


EFFECT = Effect(
    name="temperature",
    family="history",
    slot="stiffness",
    order=36,
    memory="time",
    parameters=(
        Param("softer", 0.0, 2.0, 0.03, "", True),
        Param("stiffer", 0.0, 0.95, 0.03, "", True),
        Param("warming time", 20.0, 5000.0, 300.0, "s"),
    ),
    apply=apply,
    starts=starts,
    classmates=("fatigue", "sensor-drift"),
    untestable=untestable,
    experiment="warm-up",
    words="gain follows the temperature",
    signature=warmed(lambda seen: warmth(seen.context, WARMING)),
)
