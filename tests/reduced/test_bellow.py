"""Bellow: the plate formula against its equation, lines and polynomials that come back, the linear range."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from fem_spa.errors import InputError
from fem_spa.reduced.bellow import PRINTED, fit_polynomial, linear_range, plate_rate, thrust


def test_thrust_as_printed() -> None:
    """Each size doubled in turn: linear in elongation and modulus, cubic in the wall, inverse in M, A,
    Z^2."""
    given = {
        "elongation": 9e-3,
        "modulus": 2e6,
        "wall": 1e-3,
        "convolutions": 8,
        "area": 4e-5,
        "diameter": 7e-3,
    }
    once = thrust(**given)  # type: ignore[arg-type]
    for name, power in zip(given, (1, 1, 3, -1, -1, -2), strict=True):
        twice = thrust(**given | {name: 2 * given[name]})  # type: ignore[arg-type]
        assert twice / once == pytest.approx(2.0**power)


@pytest.mark.parametrize("inner", [2e-3, 5e-3, 8e-3])
def test_the_plate_rate_solves_the_plate_equation(inner: float) -> None:
    """w' and the moment by a boundary value solver."""
    E, wall, outer, poisson, force = 2e6, 0.8e-3, 10e-3, 0.5, 1e-3
    D = E * wall**3 / (12 * (1 - poisson**2))

    def rates(r: np.ndarray, s: np.ndarray) -> np.ndarray:
        """s = w, w', w''; r w'' + w' - w'/r = ... with Q = F / (2 pi r)."""
        return np.array([s[1], s[2], -force / (2 * np.pi * r * D) - s[2] / r + s[1] / r**2])

    def ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.array([a[1], b[1], b[0]])

    r = np.linspace(inner / 2, outer / 2, 30)
    done = solve_bvp(rates, ends, r, np.zeros((3, r.size)), tol=1e-8)
    rate = force / abs(done.y[0, 0])
    assert plate_rate(E, wall, 1, outer, inner, poisson) == pytest.approx(rate / 2, rel=1e-5)
    assert plate_rate(E, wall, 8, outer, inner, poisson) == pytest.approx(rate / 16, rel=1e-5)


def test_the_plate_rate_is_that_of_the_handbook() -> None:
    """Timoshenko: 0.0237 F a^2 / (E h^3) for a / b = 2 and nu 0.3."""
    rate = plate_rate(1.0, 1.0, 1, 2.0, 1.0, 0.3)
    assert 1 / (2 * rate) == pytest.approx(0.0237, rel=5e-3)


def test_lines_and_polynomials_come_back() -> None:
    line = fit_polynomial(PRINTED[:, 1], PRINTED[:, 0], 1)
    assert line.coefficients[1] == pytest.approx(140e3 / 16e-3)
    assert line.inverse(line.at(np.array([-3e-3, 20e-3]))) == pytest.approx([-3e-3, 20e-3])
    p = np.linspace(-50e3, 90e3, 29)
    force = 2.0 + 4e-5 * p + 1e-10 * p**2
    noisy = force + 0.1 * np.random.default_rng(0).standard_normal(p.size)
    assert fit_polynomial(p, force, 2).coefficients == pytest.approx([2.0, 4e-5, 1e-10])
    fit = fit_polynomial(p, noisy, 2)
    assert 0.07 < fit.rmse < 0.13 and fit.r2 > 0.99 and fit.rmse < fit.residual
    assert fit.inverse(fit.at(p[3:5])) == pytest.approx(p[3:5])
    assert np.isnan(fit.inverse(np.array([100.0])))[0]


def test_the_linear_range_leaves_the_bends_out() -> None:
    """A line from -50 to 90 kPa, flattened beyond, as in Fig. 6."""
    p = np.linspace(-80e3, 120e3, 41)
    x = np.interp(p, [-80e3, -50e3, 90e3, 120e3], [-7.5e-3, -7e-3, 9e-3, 9.8e-3])
    line = linear_range(p, x)
    assert line.low == pytest.approx(-50e3, abs=10e3) and line.high == pytest.approx(90e3, abs=10e3)
    assert line.coefficients[1] == pytest.approx(16e-3 / 140e3, rel=0.03)
    assert linear_range(p, 3.0 * p).low == -80e3


def test_what_has_no_answer_is_refused() -> None:
    with pytest.raises(InputError, match="more points"):
        fit_polynomial(np.array([1.0, 1.0]), np.array([1.0, 2.0]), 1)
    with pytest.raises(InputError, match="no three neighbours"):
        linear_range(np.arange(4.0), np.array([0, 1, 0, 1.0]))
    x = np.linspace(-1, 1, 11)
    with pytest.raises(InputError, match="turns round"):
        fit_polynomial(x, x**2, 2).inverse(np.array([0.5]))
