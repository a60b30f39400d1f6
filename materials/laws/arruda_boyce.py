"""Arruda-Boyce (eight chains): W = mu_r sum of c_i/N^(i-1) (I1^i - 3^i), i = 1..5.

E. M. Arruda, M. C. Boyce, J. Mech. Phys. Solids 41 (1993) 389, eq. 14: the series of the inverse
Langevin function to five terms. N is the number of links of a chain, mu_r = n k T.
"""

from __future__ import annotations

import numpy as np

from materials.laws import Array, Law

SERIES = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)


def energy(I1: Array, I2: Array, *, mu: float, N: float) -> Array:
    """W in Pa; I1, I2 >= 3 of any one shape, mu (of the rubber, n k T) in Pa, N > 1."""
    return mu * sum((c / N ** (i - 1) * (I1**i - 3.0**i) for i, c in enumerate(SERIES, 1)), np.zeros_like(I1))


def derivatives(I1: Array, I2: Array, *, mu: float, N: float) -> tuple[Array, Array, Array, Array, Array]:
    """W1, W2, W11, W12, W22 in Pa, shapes of I1."""
    first = mu * sum(i * c * (I1 / N) ** (i - 1) for i, c in enumerate(SERIES, 1))
    second = mu / N * sum(i * (i - 1) * c * (I1 / N) ** (i - 2) for i, c in enumerate(SERIES, 1) if i > 1)
    zero = np.zeros_like(I1)
    return first + zero, zero, second + zero, zero, zero


def shear_modulus(*, mu: float, N: float) -> float:
    """mu (1 + 3/(5N) + 99/(175N^2) + ...), Pa: larger than n k T."""
    return 2.0 * mu * sum(i * c * (3.0 / N) ** (i - 1) for i, c in enumerate(SERIES, 1))


def by_parameter(I1: Array, I2: Array, *, mu: float, N: float) -> dict[str, tuple[Array, Array]]:
    """(dW1, dW2) to each parameter."""
    zero = np.zeros_like(I1)
    d_mu = sum(i * c * (I1 / N) ** (i - 1) for i, c in enumerate(SERIES, 1)) + zero
    d_N = -mu / N * sum(i * (i - 1) * c * (I1 / N) ** (i - 1) for i, c in enumerate(SERIES, 1)) + zero
    return {"mu": (d_mu, zero), "N": (d_N, zero)}


ARRUDA_BOYCE = Law(
    "arruda-boyce",
    {"mu": "Pa", "N": "1"},
    energy,
    derivatives,
    shear_modulus,
    limits={"mu": (0.0, np.inf), "N": (1.0, 1e6)},
    by_parameter=by_parameter,
    starts=lambda mu, reach: [
        {"mu": 0.8 * mu, "N": max(1.1, k * (reach + 3.0) / 3.0)} for k in (0.5, 1.5, 10.0)
    ],
)
