"""Homogeneous modes against textbook formulas, numerical derivatives, and the stability scan."""

from __future__ import annotations

import numpy as np
import pytest
from material_samples import parameters

from materials.errors import MaterialError
from materials.laws import LAWS
from materials.response import (
    MODES,
    invariants,
    kirchhoff,
    kirchhoff_by_parameter,
    nominal_stress,
    principal_stretches,
    true_stress,
)
from materials.stability import margin, margin_at, scan, stable_range

STRETCH = np.array([0.6, 0.9, 1.0, 1.2, 1.7, 2.2])


def test_textbook_formulas() -> None:
    """Mooney-Rivlin (Treloar, The Physics of Rubber Elasticity, 1975, chapter 5), Ogden (1972) and Gent."""
    l, a, b = STRETCH, 1.1e5, 1e4
    law, p = LAWS["mooney-rivlin"], {"C10": a, "C01": b}
    assert np.allclose(nominal_stress(law, p, "uniaxial", l), 2 * (l - l**-2) * (a + b / l))
    assert np.allclose(nominal_stress(law, p, "equibiaxial", l), 2 * (l - l**-5) * (a + b * l**2))
    assert np.allclose(nominal_stress(law, p, "planar", l), 2 * (l - l**-3) * (a + b))
    mu, alpha = 2e5, 3.3
    law, q = LAWS["ogden"], {"mu1": mu, "alpha1": alpha}
    assert np.allclose(nominal_stress(law, q, "uniaxial", l), mu * (l ** (alpha - 1) - l ** (-1 - alpha / 2)))
    assert np.allclose(
        nominal_stress(law, q, "equibiaxial", l), mu * (l ** (alpha - 1) - l ** (-1 - 2 * alpha))
    )
    assert np.allclose(nominal_stress(law, q, "planar", l), mu * (l ** (alpha - 1) - l ** (-1 - alpha)))
    assert np.allclose(true_stress(law, q, "planar", l), l * nominal_stress(law, q, "planar", l))
    law, g = LAWS["gent"], {"mu": mu, "Jm": 30.0}
    D = l**2 + 2 / l - 3
    assert np.allclose(nominal_stress(law, g, "uniaxial", l), mu * 30 / (30 - D) * (l - l**-2))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", LAWS)
def test_stress_is_the_derivative_of_the_energy(name: str, mode: str) -> None:
    law, p = LAWS[name], parameters(name)
    pulled = 2.0 if mode == "equibiaxial" else 1.0

    def W(l: np.ndarray) -> np.ndarray:
        return law.energy(*invariants(principal_stretches(mode, l)), **p)

    def difference(h: float) -> np.ndarray:
        return (W(STRETCH + h) - W(STRETCH - h)) / (2 * h) / pulled

    numeric = (4 * difference(5e-4) - difference(1e-3)) / 3
    assert np.allclose(
        nominal_stress(law, p, mode, STRETCH), numeric, rtol=1e-7, atol=1e-7 * law.shear_modulus(**p)
    )


@pytest.mark.parametrize("name", LAWS)
def test_parameter_derivatives(name: str) -> None:
    law, p = LAWS[name], parameters(name)
    l = principal_stretches("planar", STRETCH)
    exact = kirchhoff_by_parameter(law, p, l)
    for key, value in p.items():
        h = 1e-5 * (abs(value) or 1.0)
        if law.limits.get(key, (0, np.inf))[1] < value + h:
            continue  # nu = 0.5 is the end of its range
        up, down = (kirchhoff(law, {**p, key: value + s * h}, l) for s in (1, -1))
        numeric = (up[0] - up[2] - down[0] + down[2]) / (2 * h)
        got = exact[key][0] - exact[key][2]
        assert np.allclose(got, numeric, rtol=1e-6, atol=1e-7 * np.abs(numeric).max() + 1e-9)


def test_a_law_without_parameter_derivatives_gets_them_numerically() -> None:
    from dataclasses import replace

    law, p = LAWS["gent"], parameters("gent")
    l = principal_stretches("uniaxial", STRETCH)
    exact, numeric = (kirchhoff_by_parameter(m, p, l) for m in (law, replace(law, by_parameter=None)))
    for key in p:
        assert np.allclose(exact[key], numeric[key], rtol=1e-6)


def test_wrong_mode_and_wrong_stretch() -> None:
    with pytest.raises(MaterialError, match='did you mean "uniaxial"'):
        principal_stretches("uniaxal", np.array([1.0]))
    with pytest.raises(MaterialError, match="not possible"):
        principal_stretches("planar", np.array([-0.1, 1.0]))


def test_hessian_against_differences_of_the_energy() -> None:
    law, p = LAWS["ogden"], parameters("ogden")
    e0 = np.array([0.4, -0.1])

    def W(e: np.ndarray) -> float:
        l = np.exp(np.array([e[0], e[1], -e[0] - e[1]]))[:, None]
        return float(law.energy(*invariants(l), **p)[0])

    h, A = 1e-3, np.zeros((2, 2))
    for i in range(2):
        for j in range(2):
            d, k = np.eye(2)[i] * h, np.eye(2)[j] * h
            A[i, j] = (W(e0 + d + k) - W(e0 + d - k) - W(e0 - d + k) + W(e0 - d - k)) / (4 * h * h)
    expected = np.linalg.eigvalsh(A)[0] / law.shear_modulus(**p)
    stretches = np.exp(np.array([e0[0], e0[1], -e0.sum()]))[:, None]
    assert margin(law, p, stretches)[0] == pytest.approx(expected, rel=1e-4)
    assert margin_at(law, p, *invariants(stretches))[0] == pytest.approx(expected, rel=1e-4)


def test_stable_laws_are_stable() -> None:
    for name in ("neo-hooke", "mooney-rivlin", "yeoh", "ogden", "linear"):
        assert scan(LAWS[name], parameters(name), dict.fromkeys(MODES, (0.4, 4.0)))[0], name


def test_mooney_rivlin_with_a_negative_constant_is_unstable_where_theory_says() -> None:
    """C10 = 1, C01 = -0.1, equibiaxial: the Hessian's two eigenvectors are (1, 1) and (1, -1); the
    smaller eigenvalue 4 (C10 l^2 + C01 l^-2) along (1, -1) stays positive, the other along (1, 1) is
    4 [C10 (l^2 + 2 l^-4) + C01 (l^-2 + 2 l^4)], which vanishes at the end of the stable range."""
    law, p = LAWS["mooney-rivlin"], {"C10": 2e5, "C01": -2e4}
    _, high = stable_range(law, p, "equibiaxial", 0.3, 4.0)
    along = lambda l: 2e5 * (l**2 + 2 * l**-4) - 2e4 * (l**-2 + 2 * l**4)  # noqa: E731
    assert 1.5 < high < 2.6
    assert abs(along(high)) < 2e-3 * along(1.0)
    stable, ranges = scan(law, p, dict.fromkeys(MODES, (0.5, 3.0)))
    assert not stable
    assert ranges["equibiaxial"][1] == pytest.approx(high, abs=1e-3)


def test_gent_is_stable_up_to_its_end_only() -> None:
    law, p = LAWS["gent"], {"mu": 1e5, "Jm": 5.0}
    _, high = stable_range(law, p, "uniaxial", 0.5, 6.0)
    assert high**2 + 2 / high - 3 == pytest.approx(5.0, abs=2e-3)
