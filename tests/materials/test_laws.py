"""Every law of the registry: energy, first and second derivatives agree; rest is free of stress."""

from __future__ import annotations

from decimal import Decimal, getcontext

import numpy as np
import pytest
from material_samples import parameters

from materials.errors import MaterialError
from materials.laws import LAWS
from materials.laws.spectral import outer_roots, spectral_derivatives, spectral_energy
from materials.registry import law, resolve, small_strain


def isochoric(F: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """I1, I2 of the isochoric C for F of shape (3, 3, n)."""
    C = np.einsum("kin,kjn->ijn", F, F)
    J = np.linalg.det(np.moveaxis(F, -1, 0))
    C = C * J ** (-2.0 / 3.0)
    I1 = np.einsum("iin->n", C)
    return I1, 0.5 * (I1**2 - np.einsum("ijn,jin->n", C, C))


def deformations(n: int = 40) -> np.ndarray:
    rng = np.random.default_rng(3)
    return np.eye(3)[:, :, None] + 0.25 * rng.standard_normal((3, 3, n))


@pytest.mark.parametrize("name", LAWS)
def test_derivatives_are_those_of_the_energy(name: str) -> None:
    """Central differences with Richardson extrapolation, relative 1e-6 of the largest entry's scale."""
    p, L = parameters(name), LAWS[name]
    I1, I2 = isochoric(deformations())
    keep = (I1 > 3.02) & (I2 > 3.02) & (I1 < 8.0)
    I1, I2 = I1[keep], I2[keep]
    assert I1.size > 20

    def difference(f, axis: int) -> np.ndarray:  # type: ignore[no-untyped-def]
        def once(h: float) -> np.ndarray:
            d1, d2 = (h, 0.0) if axis == 1 else (0.0, h)
            return (f(I1 + d1, I2 + d2) - f(I1 - d1, I2 - d2)) / (2 * h)

        h = 4e-4
        return (4 * once(h / 2) - once(h)) / 3

    W1, W2, W11, W12, W22 = L.derivatives(I1, I2, **p)
    first = [lambda a, b, k=k: L.derivatives(a, b, **p)[k] for k in (0, 1)]
    mu = L.shear_modulus(**p)
    pairs = [
        (W1, difference(lambda a, b: L.energy(a, b, **p), 1)),
        (W2, difference(lambda a, b: L.energy(a, b, **p), 2)),
        (W11, difference(first[0], 1)),
        (W12, difference(first[0], 2)),
        (W12, difference(first[1], 1)),
        (W22, difference(first[1], 2)),
    ]
    for exact, numeric in pairs:
        assert np.max(np.abs(exact - numeric) / np.maximum(np.abs(exact), mu)) < 1e-6


@pytest.mark.parametrize("name", LAWS)
def test_rest_has_no_energy_no_stress_and_the_stated_modulus(name: str) -> None:
    p, L = parameters(name), LAWS[name]
    mu = L.shear_modulus(**p)
    three = np.array([3.0])
    assert abs(L.energy(three, three, **p)[0]) < 1e-9 * mu
    derivatives = L.derivatives(three, three, **p)
    assert all(np.isfinite(d).all() for d in derivatives)
    assert 2 * (derivatives[0] + derivatives[1])[0] == pytest.approx(mu, rel=1e-9)
    # Simple shear g: W = mu g^2 / 2 + O(g^4); I1 = I2 = 3 + g^2.
    g = 1e-2
    W = L.energy(three + g**2, three + g**2, **p)[0]
    assert W == pytest.approx(0.5 * mu * g**2, rel=1e-3)
    # Isochoric uniaxial stretch: stress dW/dl vanishes at rest.
    stretch = 1.0 + 1e-5 * np.array([-1.0, 1.0])
    W = L.energy(stretch**2 + 2 / stretch, 2 * stretch + stretch**-2, **p)
    assert abs(W[1] - W[0]) / 2e-5 < 1e-4 * mu


@pytest.mark.parametrize("name", LAWS)
def test_energy_does_not_see_a_rotation(name: str) -> None:
    p, L = parameters(name), LAWS[name]
    F = deformations(12)
    Q, _ = np.linalg.qr(np.random.default_rng(5).standard_normal((3, 3)))
    Q = Q * np.sign(np.linalg.det(Q))
    before = L.energy(*isochoric(F), **p)
    assert np.allclose(L.energy(*isochoric(np.einsum("ij,jkn->ikn", Q, F)), **p), before, rtol=1e-11)
    assert np.allclose(L.energy(*isochoric(np.einsum("ijn,jk->ikn", F, Q)), **p), before, rtol=1e-11)


@pytest.mark.parametrize("name", LAWS)
def test_shape_of_the_arguments_is_kept(name: str) -> None:
    p, L = parameters(name), LAWS[name]
    I = np.full((2, 3, 4), 3.3)
    assert L.energy(I, I, **p).shape == I.shape
    assert all(d.shape == I.shape for d in L.derivatives(I, I, **p))


def test_known_values() -> None:
    """Hand-computed energies and moduli, so that a consistent slip of a factor is seen."""
    one = np.array([4.0]), np.array([5.0])
    assert LAWS["neo-hooke"].energy(*one, C10=2.0)[0] == 2.0
    assert LAWS["mooney-rivlin"].energy(*one, C10=2.0, C01=3.0)[0] == 8.0
    assert LAWS["yeoh"].energy(one[0] + 1, one[1], C10=1.0, C20=1.0, C30=1.0)[0] == 14.0
    assert LAWS["linear"].shear_modulus(E=3.0, nu=0.5) == 1.0
    # Hencky in isochoric uniaxial stretch l: W = mu (3/2) (ln l)^2.
    l = 2.5
    W = LAWS["linear"].energy(np.array([l**2 + 2 / l]), np.array([2 * l + l**-2]), E=3.0, nu=0.5)
    assert W[0] == pytest.approx(1.5 * np.log(l) ** 2, rel=1e-12)


def exact_power(l1: float, l2: float, s: float) -> tuple[float, ...]:
    """I1, I2 and the five derivatives of W = sum x^s / s from the roots themselves, 120 digits.

    Equal roots are set 1e-18 apart, which changes the result by about as much.
    """
    getcontext().prec = 120
    a, b, e, s_ = Decimal(l1) ** 2, Decimal(l2) ** 2, Decimal(10) ** -18, Decimal(s)
    a *= 1 + 3 * e
    b *= 1 - 5 * e
    x = [a, b, 1 / (a * b)]

    def single(k: int) -> Decimal:
        total = Decimal(0)
        for i in range(3):
            total += x[i] ** (k + s_ - 1) / ((x[i] - x[i - 1]) * (x[i] - x[i - 2]))
        return total

    def double(k: int) -> Decimal:
        total, n = Decimal(0), k + s_ - 1
        for i in range(3):
            u, v = x[i] - x[i - 1], x[i] - x[i - 2]
            total += n * x[i] ** (n - 1) / (u * v) ** 2 - 2 * x[i] ** n * (u + v) / (u * v) ** 3
        return total

    I1, I2 = sum(x), x[0] * x[1] + x[1] * x[2] + x[2] * x[0]
    return tuple(float(v) for v in (I1, I2, single(2), -single(1), double(4), -double(3), double(2)))


@pytest.mark.parametrize("s", [0.65, 2.5, 5.0, -2.5])
@pytest.mark.parametrize(
    "l1, l2",
    [
        (1, 1),
        (1.0001, 1),
        (1.1, 0.95),
        (1.5, 1.2),
        (2, 2),
        (2, 2**-0.5),
        (7, 7**-0.5),
        (5, 5),
        (0.2, 1),
        (0.3, 0.3**-0.5),
    ],
)
def test_spectral_derivatives_against_high_precision(l1: float, l2: float, s: float) -> None:
    I1, I2, *exact = exact_power(l1, l2, s)
    got = spectral_derivatives(np.array([I1]), np.array([I2]), lambda z, w: np.exp(s * w))
    for value, reference in zip(got, exact, strict=True):
        assert value[0] == pytest.approx(reference, rel=1e-8)


def test_spectral_derivatives_of_i1_and_i2_themselves() -> None:
    """f = x gives W = I1; f = 1/x gives W = I2 (det = 1)."""
    I1, I2 = isochoric(deformations())
    one, zero = np.ones_like(I1), np.zeros_like(I1)
    for s, expected in ((1.0, (one, zero, zero, zero, zero)), (-1.0, (zero, one, zero, zero, zero))):
        got = spectral_derivatives(I1, I2, lambda z, w, s=s: s * np.exp(s * w))
        for value, reference in zip(got, expected, strict=True):
            assert np.allclose(value, reference, atol=1e-9)
    assert np.allclose(spectral_energy(I1, I2, lambda z, w: z), I1, rtol=1e-12)
    assert np.allclose(spectral_energy(I1, I2, lambda z, w: 1 / z), I2, rtol=1e-12)


def test_outer_roots_are_the_extreme_principal_values() -> None:
    F = deformations()
    I1, I2 = isochoric(F)
    J = np.linalg.det(np.moveaxis(F, -1, 0))
    x = np.linalg.eigvalsh(np.moveaxis(np.einsum("kin,kjn->ijn", F, F) * J ** (-2 / 3), -1, 0))
    high, low = outer_roots(I1, I2)
    assert np.allclose(high, x[:, 2], rtol=1e-6)
    assert np.allclose(low, x[:, 0], rtol=1e-6)


def test_non_finite_invariants_give_nan_not_garbage() -> None:
    out = spectral_derivatives(np.array([3.0, np.nan]), np.array([3.0, 3.0]), lambda z, w: w)
    assert all(np.isfinite(v[0]) and np.isnan(v[1]) for v in out)


def test_small_strain_constants() -> None:
    c = small_strain(LAWS["linear"], {"E": 3e6, "nu": 0.4})
    assert (c.mu, c.K, c.nu, c.E) == pytest.approx((3e6 / 2.8, 5e6, 0.4, 3e6))
    c = small_strain(LAWS["yeoh"], {"C10": 1.1e5})
    assert (c.mu, c.nu, c.E) == pytest.approx((2.2e5, 0.5, 6.6e5))
    with pytest.raises(MaterialError, match="Poisson"):
        small_strain(LAWS["neo-hooke"], {"C10": 1e6}, bulk=1e5)


@pytest.mark.parametrize(
    "name, given, words",
    [
        ("yeoh", {"C10": 5.0}, "softer than any gel"),
        ("yeoh", {"C10": 1e13}, "stiffer than steel"),
        ("yeoh", {"C20": 1e4}, "needs C10"),
        ("yeoh", {"C10": 1e5, "C40": 1.0}, 'no parameter "C40"'),
        ("mooney-rivlin", {"C10": 1e5, "C01": -2e5}, "must be positive"),
        ("neo-hooke", {"C10": float("nan")}, "finite"),
        ("linear", {"E": 1e6, "nu": 0.6}, "nu is 0.6"),
    ],
)
def test_unbelievable_parameters_are_refused(name: str, given: dict[str, float], words: str) -> None:
    with pytest.raises(MaterialError, match=words) as caught:
        resolve(LAWS[name], given)
    assert "\n" not in str(caught.value)


def test_misspelt_law_names_the_nearest() -> None:
    with pytest.raises(MaterialError, match='did you mean "neo-hooke"'):
        law("neohooke")
