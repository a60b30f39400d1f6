"""Homogeneous deformation of an incompressible law, in closed form: stress over stretch, and how it
changes with each parameter.

Conventions: stretch = length/rest length along the pulled direction; nominal stress = force / rest
area, true stress = force / present area; the free surface carries no stress. From W of the isochoric
invariants, tau_i = l_i dW/dl_i = 2 W1 l_i^2 + 2 W2 l_i^2 (I1 - l_i^2) and the true stresses differ by
sigma_1 - sigma_3 = tau_1 - tau_3 (R. W. Ogden, Non-linear Elastic Deformations, 1984, section 7.2).

    uniaxial     l, l^-1/2, l^-1/2        pulled along one direction
    equibiaxial  l, l, l^-2               pulled along two
    planar       l, 1, 1/l                pulled along one, the width held (pure shear)
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from materials.errors import MaterialError
from materials.laws import Array, Law
from materials.names import allowed

MODES = ("uniaxial", "equibiaxial", "planar")


def principal_stretches(mode: str, stretch: Array) -> Array:
    """Isochoric principal stretches (3, n), the pulled one first, the free one last.

    Raises MaterialError for an unknown mode or a stretch that is not positive.
    """
    l = np.atleast_1d(np.asarray(stretch, float))
    if not np.all(l > 0):
        raise MaterialError(f"stretch {l.min():g} is not possible; a stretch is length/rest length, above 0")
    if mode == "uniaxial":
        return np.stack([l, l**-0.5, l**-0.5])
    if mode == "equibiaxial":
        return np.stack([l, l, l**-2])
    if mode == "planar":
        return np.stack([l, np.ones_like(l), 1.0 / l])
    raise MaterialError(f'mode "{mode}" is not known; {allowed(mode, MODES)}')


def invariants(stretches: Array) -> tuple[Array, Array]:
    """I1, I2 of C for isochoric principal stretches (3, n)."""
    x = stretches**2
    return np.sum(x, axis=0), np.sum(1.0 / x, axis=0)


def kirchhoff(law: Law, parameters: Mapping[str, float], stretches: Array) -> Array:
    """tau_i = l_i dW/dl_i, Pa, (3, n); only differences between directions mean anything."""
    if law.principal is not None:
        return law.principal(stretches, **parameters)
    x = stretches**2
    I1, I2 = invariants(stretches)
    W1, W2 = law.derivatives(I1, I2, **parameters)[:2]
    return 2.0 * x * (W1 + W2 * (I1 - x))


def kirchhoff_by_parameter(law: Law, parameters: Mapping[str, float], stretches: Array) -> dict[str, Array]:
    """d tau_i to each parameter, (3, n): analytic where the law gives it, else central differences."""
    if law.principal_by_parameter is not None:
        return law.principal_by_parameter(stretches, **parameters)
    if law.by_parameter is not None:
        x = stretches**2
        I1, I2 = invariants(stretches)
        pairs = law.by_parameter(I1, I2, **parameters)
        return {name: 2.0 * x * (d1 + d2 * (I1 - x)) for name, (d1, d2) in pairs.items()}
    out = {}
    for name, value in parameters.items():
        h = 1e-5 * (abs(value) if value else max(map(abs, parameters.values())))
        up = kirchhoff(law, {**parameters, name: value + h}, stretches)
        down = kirchhoff(law, {**parameters, name: value - h}, stretches)
        out[name] = (up - down) / (2.0 * h)
    return out


def nominal_stress(law: Law, parameters: Mapping[str, float], mode: str, stretch: Array) -> Array:
    """Nominal stress in Pa of an incompressible specimen, (n,), over `stretch` (n,)."""
    l = principal_stretches(mode, stretch)
    tau = kirchhoff(law, parameters, l)
    return (tau[0] - tau[2]) / l[0]


def true_stress(law: Law, parameters: Mapping[str, float], mode: str, stretch: Array) -> Array:
    """True (Cauchy) stress in Pa, (n,), over `stretch` (n,)."""
    tau = kirchhoff(law, parameters, principal_stretches(mode, stretch))
    return tau[0] - tau[2]
