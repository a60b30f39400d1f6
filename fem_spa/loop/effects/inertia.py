"""Inertia: the moving mass overshoots and rings."""

import numpy as np
from scipy.signal import cont2discrete, lfilter

from fem_spa.loop.effects.effect import Context, Effect, Param
from fem_spa.loop.signatures.loops import swings
from fem_spa.loop.signatures.statistic import Seen


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Second order, period `period` (zero: none), damping ratio `damping`; starts at rest in each record."""
    period, damping = (float(x) for x in theta)
    if period == 0.0:
        return response
    omega = 2.0 * np.pi / period
    out = np.empty_like(response)
    system = ([omega**2], [1.0, 2.0 * damping * omega, omega**2])
    filters = {step: cont2discrete(system, step, method="foh") for step in {r.step for r in ctx.data.runs}}
    for run in ctx.data.runs:
        b, a, _ = filters[run.step]
        x = response[run.part] - ctx.rest
        out[run.part] = ctx.rest + lfilter(b.ravel(), a, x, axis=0)
    return out


def untestable(ctx: Context) -> str | None:
    """The rows must resolve a period."""
    step = min(r.step for r in ctx.data.runs)
    return None if step < 0.15 else f"samples {step:.2g} s apart are too far for oscillations"


def _periods(ctx: Context) -> list[float]:
    step = min(r.step for r in ctx.data.runs)
    return [t for t in (0.08, 0.12, 0.18, 0.27, 0.4, 0.6, 0.9, 1.4) if t > 4.0 * step]


def starts(ctx: Context) -> list[list[np.ndarray]]:
    """Periods that the sampling resolves."""
    return [[np.array([t, z])] for t in _periods(ctx) for z in (0.15, 0.45)]


def ringing(seen: Seen) -> list[tuple[float, np.ndarray]]:
    """Period (s) and (n, d) what a mass of it adds to the response, SI."""
    response = seen.response / seen.gain
    swung = ((t, apply(seen.context, response, np.array([t, 0.3]))) for t in _periods(seen.context))
    return [(t, np.asarray(seen.gain * (moved - response))) for t, moved in swung]


EFFECT = Effect(
    name="inertia",
    family="rate",
    slot="state",
    order=46,
    memory="fading",
    parameters=(Param("period", 0.0, 4.0, 0.3, "s", True), Param("damping", 0.01, 0.6, 0.3, "")),
    apply=apply,
    starts=starts,
    untestable=untestable,
    experiment="steps",
    words="overshoots and rings after steps",
    signature=swings(ringing),
)
