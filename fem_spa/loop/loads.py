"""Gravity and payload that a model has not, switched on in the model itself: what all such bases share."""

from __future__ import annotations

import numpy as np

from fem_spa.loop.base import Switches
from fem_spa.loop.data import Data

PAYLOAD = 0.02
"""kg: the payload of size one."""
SOFT = 0.5
"""rad/(N m): the compliance of a clamp of size one."""
SWITCHED = "the {} with {} switched on"


def loads(data: Data, switches: Switches) -> dict[str, np.ndarray]:
    """Load -> (n,) its size: gravity as it is fitted, a payload in proportion to what is stated."""
    found = {}
    most = float(data.payload.max())
    for name in ("gravity", "payload"):
        if name not in switches:
            continue
        each = data.payload / most if name == "payload" and most > 0.0 else np.ones(len(data.clock))
        found[name] = float(switches[name][0]) * each
    return found


def quadratic(w: np.ndarray, bare: np.ndarray, half: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """What a load of size w adds, from the answers without it, with half of size one, with size one."""
    half, whole = half - bare, whole - bare
    return np.asarray(w * (4.0 * half - whole) + w * w * (2.0 * whole - 4.0 * half))
