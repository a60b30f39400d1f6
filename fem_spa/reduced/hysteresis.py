"""Bouc-Wen hysteresis of a spring: (6) and (7) of the zig-zag paper, from force to displacement.

(7): F = k u + c u' + k z. (6), which gives z, is printed without the modulus of the velocity,

    z' = A u' - beta u' |z| z^(n-1) - alpha u' z^n,

so that z' is u' times a function of z alone: z is then a function of u, and a cycle closes without area. Bouc
and Wen's law, used here, has it (Wen, J. Eng. Mech. Div. ASCE 102 (1976) 249):

    dz = A du - beta |du| |z|^(n-1) z - alpha du |z|^n.

It is integrated in w = u + z, the spring's share of the force, not in time: dz/dw = f / (1 + f) with f =
dz/du, by an exponential step that is exact for n = 1 and stable for any size, cut finely enough to be
accurate, whatever the sampling. z tends to (A / (alpha + beta))^(1/n). With c = 0 the answer depends on
the order of forces only, not on time. At rest before the first sample.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from fem_spa.errors import InputError

MOST = 0.05
"""Largest part of the way to its limit that z goes in one step."""


@dataclass(frozen=True)
class BoucWen:
    """Parameters of (6): A without unit, beta and alpha in 1/unit of u to the n, n >= 1.

    Raises
    ------
    InputError : not finite, n < 1, A < 0, beta < 0, or alpha outside -beta to beta,
        where a cycle would give energy
    """

    A: float
    beta: float
    alpha: float
    n: float = 1.0

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.A, self.beta, self.alpha, self.n))):
            raise InputError("given a Bouc-Wen parameter that is not a finite number")
        if self.n < 1 or self.A < 0 or self.beta < 0 or abs(self.alpha) > self.beta:
            raise InputError(
                f"given Bouc-Wen A {self.A:g}, beta {self.beta:g}, alpha {self.alpha:g}, n {self.n:g}; "
                "needed: A >= 0, beta >= 0, -beta <= alpha <= beta, n >= 1"
            )

    @property
    def limit(self) -> float:
        """Largest z under monotone loading, in the unit of u; inf where nothing limits it."""
        both = self.alpha + self.beta
        return math.inf if both <= 0 else (self.A / both) ** (1 / self.n)


def displacement(
    time: np.ndarray, force: np.ndarray, stiffness: float, damping: float, law: BoucWen
) -> tuple[np.ndarray, np.ndarray]:
    """u and z (n,) of (6), (7) under a force (n,) that runs linearly between times (n,) s.

    Parameters
    ----------
    stiffness : k > 0, force a unit of u;  damping : c >= 0
    """
    return _respond(
        np.asarray(time, float),
        np.asarray(force, float) / stiffness,
        damping / stiffness,
        law.A,
        law.beta,
        law.alpha,
        law.n,
    )


@njit(cache=True)
def _slope(z, sign, A, beta, alpha, n):
    """f = dz/du where u goes in the direction of `sign`."""
    side = 1.0 if z > 0.0 else -1.0 if z < 0.0 else 0.0
    return A - (beta * sign * side + alpha) * abs(z) ** n


@njit(cache=True)
def _grow(z, dw, A, beta, alpha, n):
    """z after w = u + z has changed by dw, all in one direction."""
    if dw == 0.0:
        return z
    sign = 1.0 if dw > 0.0 else -1.0
    both = alpha + beta
    limit = (A / both) ** (1.0 / n) if both > 0.0 else math.inf
    size = max(abs(z), limit) if limit < math.inf else abs(z) + abs(dw)
    steps = math.ceil(n * (beta + abs(alpha)) * size ** (n - 1.0) * abs(dw) / MOST)
    steps = min(max(steps, 1), 2000)
    h = dw / steps
    for _ in range(steps):
        f = _slope(z, sign, A, beta, alpha, n)
        side = 1.0 if z > 0.0 or (z == 0.0 and sign > 0.0) else -1.0
        df = -n * (beta * sign + alpha * side) * (abs(z) ** (n - 1.0) if z != 0.0 or n > 1.0 else 1.0)
        x = df / (1.0 + f) ** 2 * h
        share = math.expm1(min(x, 50.0)) / x if abs(x) > 1e-9 else 1.0 + 0.5 * x
        after = z + f / (1.0 + f) * share * h
        if sign > 0.0:  # z goes towards its limit and not beyond
            after = min(max(after, z), max(z, limit))
        else:
            after = max(min(after, z), min(z, -limit))
        z = after
    return z


@njit(cache=True)
def _respond(time, aim, lag, A, beta, alpha, n):
    """u, z (n,) for aim = F / k (n,): lag u' = aim - u - z; with lag 0 u + z = aim."""
    u, z = np.zeros(aim.size), np.zeros(aim.size)
    w, at_z = 0.0, 0.0
    if lag == 0.0:
        for k in range(aim.size):
            at_z = _grow(at_z, aim[k] - w, A, beta, alpha, n)
            w = aim[k]
            u[k], z[k] = w - at_z, at_z
        return u, z
    for k in range(1, aim.size):
        dt, change = time[k] - time[k - 1], aim[k] - aim[k - 1]
        pieces = math.ceil(min(dt / lag, 40.0) / 0.1)
        h = dt / pieces
        for i in range(pieces):
            g = aim[k - 1] + change * i / pieces
            way = g + change / pieces - w
            f = _slope(at_z, 1.0 if way >= 0.0 else -1.0, A, beta, alpha, n)
            inner = f / (1.0 + f)
            step, after = 0.0, at_z
            for _ in range(3):  # lag (1 - dz/dw) w' = aim - w, with dz/dw of the step itself
                x = h / (lag * (1.0 - inner))
                ramp = 1.0 + math.expm1(-x) / x if x > 1e-6 else 0.5 * x
                step = -(g - w) * math.expm1(-x) + change / pieces * ramp
                after = _grow(at_z, step, A, beta, alpha, n)
                inner = (after - at_z) / step if step != 0.0 else inner
            w += step
            at_z = after
        u[k], z[k] = w - at_z, at_z
    return u, z
