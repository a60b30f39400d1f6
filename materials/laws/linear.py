"""Linear elasticity that survives finite rotation: Hencky's law, W = mu |dev ln U|^2 (isochoric part).

For comparison with the papers that use E and nu only. Stress is linear in the logarithmic strain;
for small strains it is Hooke's law. H. Hencky, Z. techn. Phys. 9 (1928) 215; P. Neff et al.,
Arch. Rational Mech. Anal. 222 (2016) 507, eq. 1.3.
"""

from __future__ import annotations

import numpy as np

from materials.laws import Array, Law
from materials.laws.spectral import spectral_derivatives, spectral_energy


def energy(I1: Array, I2: Array, *, E: float, nu: float = 0.5) -> Array:
    """W in Pa: sum over principal values x of mu/4 (ln x)^2; I1, I2 >= 3, E in Pa, nu in [0, 0.5]."""
    mu = shear_modulus(E=E, nu=nu)
    return spectral_energy(I1, I2, lambda z, w: (0.25 * mu) * w * w)


def derivatives(
    I1: Array, I2: Array, *, E: float, nu: float = 0.5
) -> tuple[Array, Array, Array, Array, Array]:
    """W1, W2, W11, W12, W22 in Pa, shapes of I1."""
    mu = shear_modulus(E=E, nu=nu)
    return spectral_derivatives(I1, I2, lambda z, w: (0.5 * mu) * w)


def shear_modulus(*, E: float, nu: float = 0.5) -> float:
    """mu = E / (2 (1 + nu)), Pa."""
    return E / (2.0 * (1.0 + nu))


def bulk(*, E: float, nu: float = 0.5) -> float:
    """K = E / (3 (1 - 2 nu)), Pa; infinite at nu = 0.5."""
    return float("inf") if nu == 0.5 else E / (3.0 * (1.0 - 2.0 * nu))


def principal(stretch: Array, *, E: float, nu: float = 0.5) -> Array:
    """tau_i = 2 mu ln l_i, Pa, for isochoric principal stretches (3, n)."""
    return 2.0 * shear_modulus(E=E, nu=nu) * np.log(stretch)


def principal_by_parameter(stretch: Array, *, E: float, nu: float = 0.5) -> dict[str, Array]:
    """d tau/dE and d tau/dnu, (3, n)."""
    log = np.log(stretch)
    return {"E": log / (1.0 + nu), "nu": -E * log / (1.0 + nu) ** 2}


LINEAR = Law(
    "linear",
    {"E": "Pa", "nu": "1"},
    energy,
    derivatives,
    shear_modulus,
    optional={"nu": 0.5},
    bulk=bulk,
    limits={"E": (0.0, np.inf), "nu": (0.0, 0.5)},
    principal=principal,
    principal_by_parameter=principal_by_parameter,
    variants={"linear": ("E",)},
    linear=True,
    starts=lambda mu, reach: [{"E": 3 * mu, "nu": 0.5}],
)
