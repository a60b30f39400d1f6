"""Where a law is stable: Drucker's postulate for incompressible deformation.

d(tau) : d(ln U) > 0 for every isochoric increment, that is, the Hessian of W to two of the three
logarithmic principal strains is positive definite (R. Hill, J. Mech. Phys. Solids 16 (1968) 229;
Abaqus Theory Manual 4.6.2). A law can follow a tensile test closely and fail this in another mode.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from materials.laws import Array, Law
from materials.laws.spectral import outer_roots
from materials.response import MODES, invariants, principal_stretches


def hessian(law: Law, parameters: Mapping[str, float], stretches: Array) -> tuple[Array, Array, Array]:
    """(A11, A12, A22), Pa: Hessian of W to (ln l1, ln l2) at l3 = 1/(l1 l2), for stretches (3, n)."""
    x = stretches**2
    I1, I2 = invariants(stretches)
    W1, W2, W11, W12, W22 = law.derivatives(I1, I2, **parameters)
    y = 1.0 / x
    a1, a2 = 2.0 * (x[0] - x[2]), 2.0 * (x[1] - x[2])
    b1, b2 = -2.0 * (y[0] - y[2]), -2.0 * (y[1] - y[2])
    A11 = (
        W11 * a1 * a1 + 2.0 * W12 * a1 * b1 + W22 * b1 * b1 + 4.0 * (W1 * (x[0] + x[2]) + W2 * (y[0] + y[2]))
    )
    A22 = (
        W11 * a2 * a2 + 2.0 * W12 * a2 * b2 + W22 * b2 * b2 + 4.0 * (W1 * (x[1] + x[2]) + W2 * (y[1] + y[2]))
    )
    A12 = W11 * a1 * a2 + W12 * (a1 * b2 + a2 * b1) + W22 * b1 * b2 + 4.0 * (W1 * x[2] + W2 * y[2])
    return A11, A12, A22


def margin(law: Law, parameters: Mapping[str, float], stretches: Array) -> Array:
    """Smallest eigenvalue of the Hessian over the shear modulus, (n,): positive is stable, nan is past
    the end of the law (fully drawn chains)."""
    A11, A12, A22 = hessian(law, parameters, stretches)
    mean = 0.5 * (A11 + A22)
    return (mean - np.sqrt((0.5 * (A11 - A22)) ** 2 + A12**2)) / law.shear_modulus(**parameters)


def margin_at(law: Law, parameters: Mapping[str, float], I1: Array, I2: Array) -> Array:
    """`margin` for isochoric invariants of any one shape: what a solver asks of its elements."""
    shape = np.shape(I1)
    high, low = outer_roots(np.ravel(I1), np.ravel(I2))
    stretches = np.sqrt(np.stack([high, 1.0 / (high * low), low]))
    return margin(law, parameters, stretches).reshape(shape)


def stable_range(
    law: Law,
    parameters: Mapping[str, float],
    mode: str,
    low: float = 0.3,
    high: float = 5.0,
    points: int = 400,
) -> tuple[float, float]:
    """Stretches around 1, within [low, high], between which the law is stable in `mode`.

    The end is the last stable stretch, found to 1e-4 by bisection; `low` or `high` where the law is
    stable all the way.
    """
    ends = []
    for end in (low, high):
        grid = np.geomspace(1.0, end, points)
        ok = _stable(law, parameters, mode, grid)
        if ok.all():
            ends.append(float(end))
            continue
        first = int(np.argmin(ok))
        if first == 0:
            ends.append(1.0)
            continue
        good, bad = grid[first - 1], grid[first]
        while abs(bad - good) > 1e-4:
            middle = 0.5 * (good + bad)
            if _stable(law, parameters, mode, np.array([middle]))[0]:
                good = middle
            else:
                bad = middle
        ends.append(float(good))
    return ends[0], ends[1]


def _stable(law: Law, parameters: Mapping[str, float], mode: str, stretch: Array) -> Array:
    with np.errstate(all="ignore"):
        return margin(law, parameters, principal_stretches(mode, stretch)) > 0.0


def reach_stretch(mode: str, reach: float) -> tuple[float, float]:
    """The stretches, below and above 1, at which I1 - 3 is `reach` in `mode`."""
    ends = []
    for far in (1e-3, 1e3):
        a, b = 0.0, float(np.log(far))
        for _ in range(80):
            middle = 0.5 * (a + b)
            I1, _ = invariants(principal_stretches(mode, np.exp(np.array([middle]))))
            a, b = (middle, b) if I1[0] - 3.0 < reach else (a, middle)
        ends.append(float(np.exp(a)))
    return ends[0], ends[1]


def scan(
    law: Law, parameters: Mapping[str, float], asked: Mapping[str, tuple[float, float]], points: int = 120
) -> tuple[bool, dict[str, tuple[float, float]]]:
    """Whether the law is stable in every mode over `asked` (mode -> (low, high) of the stretch), and the
    part of each range, around 1, in which it is."""
    ranges = {mode: stable_range(law, parameters, mode, *asked[mode], points=points) for mode in MODES}
    return all(ranges[mode] == tuple(asked[mode]) for mode in MODES), ranges
