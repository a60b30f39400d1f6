"""Extended tube: chains of finite length (Gc, delta) in a tube of neighbours (Ge, beta).

W = Gc/2 [(1 - d^2) D/(1 - d^2 D) + ln(1 - d^2 D)] + 2 Ge/beta^2 sum (l_i^-beta - 1), D = I1 - 3.
M. Kaliske, G. Heinrich, Rubber Chem. Technol. 72 (1999) 602, eq. 13 to 15. Beyond D = 1/delta^2 the
chains are fully drawn and everything is nan.
"""

from __future__ import annotations

import numpy as np

from materials.laws import Array, Law
from materials.laws.spectral import spectral_derivatives, spectral_energy


def _chain(D: Array, Gc: float, delta: float) -> tuple[Array, Array, Array]:
    """Energy of the chains and its first two derivatives to D."""
    q = delta * delta
    left = 1.0 - q * D
    left = np.where(left > 0.0, left, np.nan)
    W = 0.5 * Gc * ((1.0 - q) * D / left + np.log(left))
    first = 0.5 * Gc * ((1.0 - q) / left**2 - q / left)
    second = 0.5 * Gc * (2.0 * q * (1.0 - q) / left**3 - q * q / left**2)
    return W, first, second


def energy(I1: Array, I2: Array, *, Gc: float, delta: float, Ge: float, beta: float) -> Array:
    """W in Pa; I1, I2 >= 3 of any one shape; Gc, Ge in Pa, 0 <= delta < 1, 0 < beta <= 1."""
    tube = spectral_energy(I1, I2, lambda z, w: (2.0 * Ge / beta**2) * (np.exp(-0.5 * beta * w) - 1.0))
    return _chain(I1 - 3.0, Gc, delta)[0] + tube


def derivatives(
    I1: Array, I2: Array, *, Gc: float, delta: float, Ge: float, beta: float
) -> tuple[Array, Array, Array, Array, Array]:
    """W1, W2, W11, W12, W22 in Pa, shapes of I1."""
    _, first, second = _chain(I1 - 3.0, Gc, delta)
    W1, W2, W11, W12, W22 = spectral_derivatives(I1, I2, lambda z, w: (-Ge / beta) * np.exp(-0.5 * beta * w))
    return W1 + first, W2, W11 + second, W12, W22


def shear_modulus(*, Gc: float, delta: float, Ge: float, beta: float) -> float:
    """mu = Gc (1 - 2 delta^2) + Ge, Pa (the paper's Gc + Ge is its limit of small delta)."""
    return Gc * (1.0 - 2.0 * delta * delta) + Ge


def principal(stretch: Array, *, Gc: float, delta: float, Ge: float, beta: float) -> Array:
    """tau_i, Pa, for isochoric principal stretches (3, n)."""
    _, first, _ = _chain(np.sum(stretch**2, axis=0) - 3.0, Gc, delta)
    return 2.0 * stretch**2 * first - (2.0 * Ge / beta) * stretch**-beta


def principal_by_parameter(
    stretch: Array, *, Gc: float, delta: float, Ge: float, beta: float
) -> dict[str, Array]:
    """d tau to each parameter, (3, n)."""
    D = np.sum(stretch**2, axis=0) - 3.0
    q = delta * delta
    left = np.where(1.0 - q * D > 0.0, 1.0 - q * D, np.nan)
    _, first, _ = _chain(D, 1.0, delta)
    d_q = 0.5 * (-1.0 / left**2 + 2.0 * (1.0 - q) * D / left**3 - 1.0 / left - q * D / left**2)
    tube = stretch**-beta
    return {
        "Gc": 2.0 * stretch**2 * first,
        "delta": 2.0 * stretch**2 * (Gc * d_q * 2.0 * delta),
        "Ge": -(2.0 / beta) * tube,
        "beta": 2.0 * Ge / beta * tube * (1.0 / beta + np.log(stretch)),
    }


EXTENDED_TUBE = Law(
    "extended-tube",
    {"Gc": "Pa", "delta": "1", "Ge": "Pa", "beta": "1"},
    energy,
    derivatives,
    shear_modulus,
    limits={"Gc": (0.0, np.inf), "delta": (0.0, 0.7), "Ge": (0.0, np.inf), "beta": (1e-2, 1.0)},
    principal=principal,
    principal_by_parameter=principal_by_parameter,
    data_limits=lambda reach: {"delta": (0.0, min(0.7, (1.0001 * reach) ** -0.5))},
    starts=lambda mu, reach: [
        {"Gc": share * mu, "delta": min(0.5, k * reach**-0.5), "Ge": (1 - share) * mu, "beta": beta}
        for share in (0.3, 0.8)
        for k in (0.3, 0.8)
        for beta in (0.2, 0.8)
    ],
)
