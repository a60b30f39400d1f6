"""Gent: W = -mu Jm/2 ln(1 - (I1 - 3)/Jm). A. N. Gent, Rubber Chem. Technol. 69 (1996) 59, eq. 3.

The chains are fully drawn at I1 - 3 = Jm; there and beyond, W and its derivatives are nan, which
the solver takes as a step too far.
"""

from __future__ import annotations

import numpy as np

from materials.laws import Array, Law


def _left(I1: Array, Jm: float) -> Array:
    """1 - (I1 - 3)/Jm, nan where the chains are fully drawn."""
    left = 1.0 - (I1 - 3.0) / Jm
    return np.where(left > 0.0, left, np.nan)


def energy(I1: Array, I2: Array, *, mu: float, Jm: float) -> Array:
    """W in Pa; I1, I2 >= 3 of any one shape, mu in Pa, Jm > 0."""
    return -0.5 * mu * Jm * np.log(_left(I1, Jm))


def derivatives(I1: Array, I2: Array, *, mu: float, Jm: float) -> tuple[Array, Array, Array, Array, Array]:
    """W1, W2, W11, W12, W22 in Pa, shapes of I1."""
    left = _left(I1, Jm)
    zero = np.zeros_like(left)
    return 0.5 * mu / left, zero, 0.5 * mu / (Jm * left**2), zero, zero


def shear_modulus(*, mu: float, Jm: float) -> float:
    """mu, Pa."""
    return mu


def by_parameter(I1: Array, I2: Array, *, mu: float, Jm: float) -> dict[str, tuple[Array, Array]]:
    """(dW1, dW2) to each parameter."""
    left = _left(I1, Jm)
    zero = np.zeros_like(left)
    return {"mu": (0.5 / left, zero), "Jm": (-0.5 * mu * (I1 - 3.0) / (Jm * left) ** 2, zero)}


GENT = Law(
    "gent",
    {"mu": "Pa", "Jm": "1"},
    energy,
    derivatives,
    shear_modulus,
    limits={"mu": (0.0, np.inf), "Jm": (1e-3, 1e6)},
    by_parameter=by_parameter,
    data_limits=lambda reach: {"Jm": (1.0001 * reach, 1e6)},
    starts=lambda mu, reach: [{"mu": 0.8 * mu, "Jm": k * reach} for k in (1.15, 2.0, 10.0)],
)
