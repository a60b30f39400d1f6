"""Sensor offset and sensor gain: in the library so that a report can say why they are never claimed."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param


def offset(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """y -> y + offset."""
    return np.asarray(response + theta[0] * ctx.scale)


def gain(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """y -> y (1 + gain)."""
    return np.asarray(response * (1.0 + theta[0]))


def _taken(_: Context) -> str:
    return "the refit of the base model takes it"


OFFSET = Effect(
    name="sensor-offset",
    family="sensor",
    slot="sensor",
    order=68,
    memory="static",
    parameters=(Param("offset", -1.0, 1.0, 0.0, "of span", True),),
    apply=offset,
    starts=lambda ctx: [],
    untestable=_taken,
    experiment="zero load",
    words="a constant on top of the reading",
)
GAIN = Effect(
    name="sensor-gain",
    family="sensor",
    slot="sensor",
    order=70,
    memory="static",
    parameters=(Param("gain", -0.5, 0.5, 0.0, "", True),),
    apply=gain,
    starts=lambda ctx: [],
    untestable=_taken,
    experiment="second sensor",
    words="a constant factor on the reading",
)
