"""Ogden, one to three terms: W = sum of mu_p/alpha_p (l1^alpha_p + l2^alpha_p + l3^alpha_p - 3).

R. W. Ogden, Proc. R. Soc. A 326 (1972) 565, eq. 22. In this convention mu = 1/2 sum mu_p alpha_p;
Abaqus' mu_p is this mu_p alpha_p / 2. Each mu_p alpha_p >= 0 makes the law stable everywhere.
"""

from __future__ import annotations

import numpy as np

from materials.laws import Array, Law
from materials.laws.spectral import spectral_derivatives, spectral_energy

STEEPEST = 20.0
"""Largest |alpha|: steeper powers belong to no rubber and lose digits."""

_FLATTEST = 1e-3


def terms(parameters: dict[str, float]) -> list[tuple[float, float]]:
    """(mu_p, alpha_p) of the terms with mu_p != 0."""
    pairs = [(parameters.get(f"mu{p}", 0.0), parameters.get(f"alpha{p}", 2.0)) for p in (1, 2, 3)]
    return [(mu, a if abs(a) > _FLATTEST else np.copysign(_FLATTEST, a)) for mu, a in pairs if mu != 0.0]


def energy(I1: Array, I2: Array, **parameters: float) -> Array:
    """W in Pa; I1, I2 >= 3 of any one shape, mu_p in Pa, |alpha_p| <= 20."""
    pairs = terms(parameters)

    def f(z: Array, w: Array) -> Array:
        return sum(((mu / a) * (np.exp(0.5 * a * w) - 1.0) for mu, a in pairs), np.zeros_like(w))

    return spectral_energy(I1, I2, f)


def derivatives(I1: Array, I2: Array, **parameters: float) -> tuple[Array, Array, Array, Array, Array]:
    """W1, W2, W11, W12, W22 in Pa, shapes of I1."""
    pairs = terms(parameters)

    def zdf(z: Array, w: Array) -> Array:
        return sum(((0.5 * mu) * np.exp(0.5 * a * w) for mu, a in pairs), np.zeros_like(w))

    return spectral_derivatives(I1, I2, zdf)


def shear_modulus(**parameters: float) -> float:
    """mu = 1/2 sum mu_p alpha_p, Pa."""
    return 0.5 * sum(mu * a for mu, a in terms(parameters))


def principal(stretch: Array, **parameters: float) -> Array:
    """tau_i = sum mu_p l_i^alpha_p, Pa, for isochoric principal stretches (3, n)."""
    log = np.log(stretch)
    return sum((mu * np.expm1(a * log) for mu, a in terms(parameters)), np.zeros_like(log))


def principal_by_parameter(stretch: Array, **parameters: float) -> dict[str, Array]:
    """d tau / d mu_p and d tau / d alpha_p, (3, n)."""
    log = np.log(stretch)
    out: dict[str, Array] = {}
    for p in (1, 2, 3):
        if f"mu{p}" in parameters:
            a = parameters[f"alpha{p}"]
            out[f"mu{p}"] = np.expm1(a * log)
            out[f"alpha{p}"] = parameters[f"mu{p}"] * log * np.exp(a * log)
    return out


def starts(mu: float, reach: float) -> list[dict[str, float]]:
    """One start; the fit finds better ones by trying exponents (see materials/ogden_starts.py)."""
    return [{"mu1": mu, "alpha1": 2.0, "mu2": 1e-3 * mu, "alpha2": 5.0, "mu3": -0.1 * mu, "alpha3": -2.0}]


_EXPONENT = (-STEEPEST, STEEPEST)

OGDEN = Law(
    "ogden",
    {"mu1": "Pa", "alpha1": "1", "mu2": "Pa", "alpha2": "1", "mu3": "Pa", "alpha3": "1"},
    energy,
    derivatives,
    shear_modulus,
    optional={"mu2": 0.0, "alpha2": 2.0, "mu3": 0.0, "alpha3": 2.0},
    limits={"alpha1": _EXPONENT, "alpha2": _EXPONENT, "alpha3": _EXPONENT},
    principal=principal,
    principal_by_parameter=principal_by_parameter,
    variants={
        "ogden-1": ("mu1", "alpha1"),
        "ogden-2": ("mu1", "alpha1", "mu2", "alpha2"),
        "ogden-3": ("mu1", "alpha1", "mu2", "alpha2", "mu3", "alpha3"),
    },
    starts=starts,
)
