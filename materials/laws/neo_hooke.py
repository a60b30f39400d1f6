"""Neo-Hooke: W = C10 (I1 - 3). R. S. Rivlin, Phil. Trans. R. Soc. A 240 (1948) 459; Treloar (1943)."""

from __future__ import annotations

import numpy as np

from materials.laws import Array, Law


def energy(I1: Array, I2: Array, *, C10: float) -> Array:
    """W in Pa; I1, I2 >= 3 of any one shape, C10 in Pa."""
    return C10 * (I1 - 3.0)


def derivatives(I1: Array, I2: Array, *, C10: float) -> tuple[Array, Array, Array, Array, Array]:
    """W1, W2, W11, W12, W22 in Pa, shapes of I1."""
    zero = np.zeros_like(I1)
    return zero + C10, zero, zero, zero, zero


def shear_modulus(*, C10: float) -> float:
    """mu = 2 C10, Pa."""
    return 2.0 * C10


def by_parameter(I1: Array, I2: Array, *, C10: float) -> dict[str, tuple[Array, Array]]:
    """(dW1, dW2) to each parameter."""
    return {"C10": (np.ones_like(I1), np.zeros_like(I1))}


NEO_HOOKE = Law(
    "neo-hooke",
    {"C10": "Pa"},
    energy,
    derivatives,
    shear_modulus,
    limits={"C10": (0.0, np.inf)},
    by_parameter=by_parameter,
    linear=True,
    starts=lambda mu, reach: [{"C10": mu / 2}],
)
