"""The variables in which a law is fitted: scaled, bounded, and such that the shear modulus stays positive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from materials.laws import Array, Law

LEAST_MODULUS = 0.01
"""The small-strain shear modulus of a fit is at least this share of the tests' rough one."""


@dataclass(frozen=True)
class Variables:
    """Map between v, the variables of the fit, and the free parameters.

    Parameters
    ----------
    names : free parameters, in order
    scale : SI size of one unit of each
    low, high : bounds of v
    to : v -> scaled parameters;  jac : v -> d(scaled parameters)/dv;  back : its inverse
    """

    names: tuple[str, ...]
    scale: Array
    low: Array
    high: Array
    to: Callable[[Array], Array]
    jac: Callable[[Array], Array]
    back: Callable[[Array], Array]

    def values(self, v: Array) -> Array:
        """Free parameters, SI."""
        return self.to(v) * self.scale

    def jacobian(self, v: Array) -> Array:
        """d(free parameters)/dv, (n, n)."""
        return self.jac(v) * self.scale[:, None]

    def variables(self, values: Array) -> Array:
        """v of free parameters."""
        return self.back(values / self.scale)

    def clip(self, v: Array) -> Array:
        """v strictly inside the bounds, as the search wants its start."""
        span = np.where(np.isfinite(self.high - self.low), self.high - self.low, 1.0)
        return np.clip(v, self.low + 1e-9 * span, self.high - 1e-9 * span)

    def inside(self, values: Array) -> bool:
        """Whether the bounds hold."""
        v = self.variables(values)
        return bool(np.all(v > self.low) and np.all(v < self.high))

    def at_bound(self, values: Array) -> tuple[str, ...]:
        """Names of the variables within 1e-6 of a bound."""
        v = self.variables(values)
        size = np.maximum(1.0, np.abs(v))
        near = (v - self.low < 1e-6 * size) | (self.high - v < 1e-6 * size)
        return tuple(name for name, yes in zip(self.names, near, strict=True) if yes)


def variables_of(law: Law, free: tuple[str, ...], modulus: float, reach: float) -> Variables:
    """The variables of `law` for data of shear modulus about `modulus` (Pa) and I1 - 3 up to `reach`."""
    scale = np.array([modulus if law.parameters[name] == "Pa" else 1.0 for name in free])
    limits = {**law.limits, **(law.data_limits(reach) if law.data_limits else {})}
    low = np.array([limits.get(name, (-np.inf, np.inf))[0] for name in free]) / scale
    high = np.array([limits.get(name, (-np.inf, np.inf))[1] for name in free]) / scale
    if law.name == "mooney-rivlin":
        return _mooney_rivlin(free, scale)
    if law.name == "ogden":
        return _ogden(free, scale, high)
    n = len(free)
    if free and low[0] == 0.0 and law.parameters[free[0]] == "Pa" and not law.optional.get(free[0]):
        low[0] = LEAST_MODULUS / 3.0  # the modulus itself: positive, not only non-negative
    return Variables(free, scale, low, high, lambda v: v, lambda v: np.eye(n), lambda p: p)


def _mooney_rivlin(free: tuple[str, ...], scale: Array) -> Variables:
    """v = (C10 + C01, C01), the first positive: mu = 2 (C10 + C01)."""
    forward = np.array([[1.0, -1.0], [0.0, 1.0]])
    backward = np.array([[1.0, 1.0], [0.0, 1.0]])
    low, high = np.array([LEAST_MODULUS / 2.0, -np.inf]), np.full(2, np.inf)
    return Variables(free, scale, low, high, lambda v: forward @ v, lambda v: forward, lambda p: backward @ p)


def _ogden(free: tuple[str, ...], scale: Array, high: Array) -> Variables:
    """v = (mu_p alpha_p / 2, alpha_p, ...), each first >= 0: mu = sum of the firsts, and Drucker-stable."""
    n = len(free)
    low, top = np.tile([0.0, -high[1]], n // 2), np.tile([np.inf, high[1]], n // 2)

    def exponent(a: Array) -> Array:
        return np.where(np.abs(a) > 1e-3, a, np.where(a < 0, -1e-3, 1e-3))

    def to(v: Array) -> Array:
        p = v.copy()
        p[1::2] = exponent(v[1::2])
        p[0::2] = 2.0 * v[0::2] / p[1::2]
        return p

    def jac(v: Array) -> Array:
        J = np.eye(n)
        a = exponent(v[1::2])
        for k in range(n // 2):
            J[2 * k, 2 * k] = 2.0 / a[k]
            J[2 * k, 2 * k + 1] = -2.0 * v[2 * k] / a[k] ** 2
        return J

    def back(p: Array) -> Array:
        v = p.copy()
        v[0::2] = 0.5 * p[0::2] * p[1::2]
        return v

    return Variables(free, scale, low, top, to, jac, back)
