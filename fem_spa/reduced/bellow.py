"""The bellow-driven actuator: thrust, calibration lines of pressure and range sensor, blocking force.

Hashem et al., bellow-driven, self-sensing actuator. Thrust: (1); calibration: P = L x + g (Fig. 6) and S =
L x + f (Fig. 10), each over the range in which a line holds to 2 %; blocking force: a polynomial of second
order (Fig. 7). Printed of the lines: -7 mm at -50 kPa and 9 mm at 90 kPa; of the force: 0.2 N and 6 N at
the same pressures.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fem_spa.errors import InputError

HEIGHT, WALL, OUTER, INNER, CONVOLUTIONS = 15e-3, 0.8e-3, 10e-3, 5e-3, 8
"""m; deformable height, wall, diameters; section IV."""
PRINTED = np.array([[-50e3, -7e-3, 0.2], [90e3, 9e-3, 6.0]])
"""Pressure (Pa), displacement (m) and blocking force (N) at the ends of the linear range."""


def thrust(
    elongation: float, modulus: float, wall: float, convolutions: int, area: float, diameter: float
) -> float:
    """(1): pressure (Pa) that holds a bellow at an elongation, P = e E w^3 / (2 M A Z^2).

    Parameters
    ----------
    elongation, wall, diameter : m, the last the mean diameter Z;  modulus : Pa;  area : effective, m^2

    Z stands where the spring rate of a bellow has the depth of its convolutions; with the paper's own
    sizes (1) gives a few hundred Pa for 9 mm. `plate_rate` is the rate derived from plates; the study
    shows both.
    """
    return elongation * modulus * wall**3 / (2 * convolutions * area * diameter**2)


def plate_rate(
    modulus: float, wall: float, convolutions: int, outer: float, inner: float, poisson: float = 0.5
) -> float:
    """Spring rate (N/m) of a bellow as 2 M annular plates in series whose edges do not tilt.

    One plate, a = outer / 2, b = inner / 2, x = b / a, D = E w^3 / (12 (1 - nu^2)): from
    d/dr[(1/r) d/dr(r w')] = Q / D with Q = F / (2 pi r) and w'(a) = w'(b) = 0,

        F / deflection = 4 pi D / a^2 / [ (1 - x^2) / 4 - x^2 ln^2 x / (1 - x^2) ]

    which is Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, section 17 (0.0237 F a^2 / (E
    w^3) at x = 1/2, nu = 0.3).
    """
    a, x = outer / 2, inner / outer
    stiffness = modulus * wall**3 / (12 * (1 - poisson**2))
    shape = (1 - x**2) / 4 - x**2 * math.log(x) ** 2 / (1 - x**2)
    return 4 * math.pi * stiffness / a**2 / shape / (2 * convolutions)


@dataclass(frozen=True)
class Polynomial:
    """A polynomial through measured points, with what is left.

    Attributes
    ----------
    coefficients : rising powers, SI
    low, high : range of the points
    residual : largest distance of a point;  rmse : root of the mean squared one, degrees of freedom counted
    r2 : coefficient of determination
    """

    coefficients: tuple[float, ...]
    low: float
    high: float
    residual: float
    rmse: float
    r2: float

    def at(self, x: np.ndarray) -> np.ndarray:
        """Value at x (any shape), SI."""
        return np.asarray(np.polynomial.polynomial.polyval(np.asarray(x, float), self.coefficients))

    def inverse(self, y: np.ndarray) -> np.ndarray:
        """x at which the value is y (any shape), within the range or, for a line, anywhere; nan where
        there is none.

        Raises
        ------
        InputError : the polynomial turns round within its range, so that there are two answers
        """
        wanted = np.asarray(y, float)
        if len(self.coefficients) == 2:
            return (wanted - self.coefficients[0]) / self.coefficients[1]
        curve = np.polynomial.Polynomial(self.coefficients)
        roots = np.asarray(curve.deriv().roots(), complex)
        turns = [r.real for r in roots if abs(r.imag) < 1e-12 and self.low < r.real < self.high]
        if turns:
            raise InputError(
                f"the polynomial turns round at {turns[0]:g}; it cannot be inverted over its range"
            )
        answers = np.full(wanted.shape, np.nan)
        slack = 1e-9 * (self.high - self.low)
        for place in np.ndindex(wanted.shape):
            for root in np.asarray((curve - float(wanted[place])).roots(), complex):
                if abs(root.imag) < 1e-12 and self.low - slack <= root.real <= self.high + slack:
                    answers[place] = root.real
        return answers


def fit_polynomial(x: np.ndarray, y: np.ndarray, degree: int) -> Polynomial:
    """Least squares; degree 1 for the calibration lines, 2 for the blocking force.

    Parameters
    ----------
    x, y : (n,) SI; rows that are not finite are left out

    Raises
    ------
    InputError : fewer different x than coefficients
    """
    keep = np.isfinite(x) & np.isfinite(y)
    u, v = np.asarray(x, float)[keep], np.asarray(y, float)[keep]
    if np.unique(u).size <= degree:
        raise InputError(
            f"given {np.unique(u).size} different values for degree {degree}; more points are needed"
        )
    found = np.polynomial.Polynomial.fit(u, v, degree)
    left = v - found(u)
    total = float(np.sum((v - v.mean()) ** 2))
    free = max(u.size - degree - 1, 1)
    return Polynomial(
        tuple(float(c) for c in found.convert().coef),
        float(u.min()),
        float(u.max()),
        float(np.max(np.abs(left))),
        float(np.sqrt(left @ left / free)),
        1.0 - float(left @ left) / total if total > 0 else math.nan,
    )


def linear_range(x: np.ndarray, y: np.ndarray, share: float = 0.02) -> Polynomial:
    """The longest stretch of x over which a line holds to `share` of the y it covers, and that line.

    The paper's rule for its calibrations: "above 2 % of displacement error is out of the linear regression
    range".

    Parameters
    ----------
    x, y : (n,) SI, at least three different x

    Raises
    ------
    InputError : fewer than three points, or no three neighbours on a line
    """
    order = np.argsort(x, kind="stable")
    u, v = np.asarray(x, float)[order], np.asarray(y, float)[order]
    ends = sorted(((u[j] - u[i], i, j) for i in range(u.size) for j in range(i + 2, u.size)), reverse=True)
    for width, i, j in ends:
        part = slice(i, j + 1)
        if width > 0 and np.unique(u[part]).size > 2:
            line = fit_polynomial(u[part], v[part], 1)
            if line.residual <= share * float(np.ptp(v[part])):
                return line
    raise InputError(f"given {u.size} points: no three neighbours lie on a line to {100 * share:g} %")
