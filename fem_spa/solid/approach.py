"""Walls on their way to one another: predictions that do not pass through, and where they first touch."""

from __future__ import annotations

import numpy as np

from fem_spa.solid.predictor import Predictor
from fem_spa.solid.system import System

_BISECTIONS = 8


def not_through(system: System, before: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The predicted x, or a part of the way from `before` to it on which no wall goes far into another."""
    if system.contact is None:
        return x
    for _ in range(4):
        touching = system.contact.evaluate(system.space.points + system.displacement(x))
        if touching.inside <= system.depth_allowed:
            break
        x = 0.5 * (before + x)
    return x


def touches(system: System, x: np.ndarray) -> bool:
    """Whether anything would touch at x; leaves the state last evaluated alone."""
    assert system.contact is not None
    return system.contact.evaluate(system.space.points + system.displacement(x)).highest > 0.0


def first_touch(system: System, predictor: Predictor, walked: float, step: float) -> float:
    """Part of a step at whose end walls touch, and before which they do not, at which they first do.

    The states before touching are continued as the predictor has them; where that does not touch at all,
    the answer is the end of the step.
    """
    lo, hi = 0.0, 1.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (lo + hi)
        if touches(system, predictor.predict(walked + middle * step)[0]):
            hi = middle
        else:
            lo = middle
    return hi
