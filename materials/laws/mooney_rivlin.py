"""Mooney-Rivlin: W = C10 (I1 - 3) + C01 (I2 - 3). M. Mooney, J. Appl. Phys. 11 (1940) 582, eq. 13."""

from __future__ import annotations

import numpy as np

from materials.laws import Array, Law


def energy(I1: Array, I2: Array, *, C10: float, C01: float) -> Array:
    """W in Pa; I1, I2 >= 3 of any one shape, C10 and C01 in Pa, C10 + C01 > 0."""
    return C10 * (I1 - 3.0) + C01 * (I2 - 3.0)


def derivatives(I1: Array, I2: Array, *, C10: float, C01: float) -> tuple[Array, Array, Array, Array, Array]:
    """W1, W2, W11, W12, W22 in Pa, shapes of I1."""
    zero = np.zeros_like(I1)
    return zero + C10, zero + C01, zero, zero, zero


def shear_modulus(*, C10: float, C01: float) -> float:
    """mu = 2 (C10 + C01), Pa."""
    return 2.0 * (C10 + C01)


def by_parameter(I1: Array, I2: Array, *, C10: float, C01: float) -> dict[str, tuple[Array, Array]]:
    """(dW1, dW2) to each parameter."""
    one, zero = np.ones_like(I1), np.zeros_like(I1)
    return {"C10": (one, zero), "C01": (zero, one)}


MOONEY_RIVLIN = Law(
    "mooney-rivlin",
    {"C10": "Pa", "C01": "Pa"},
    energy,
    derivatives,
    shear_modulus,
    by_parameter=by_parameter,
    linear=True,
    starts=lambda mu, reach: [{"C10": 0.4 * mu, "C01": 0.1 * mu}],
)
