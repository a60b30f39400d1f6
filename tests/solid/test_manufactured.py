"""Orders of convergence on manufactured solutions: 3 for u and 2 for p in L2."""

import math

import numpy as np
import pytest

CASES = {
    "incompressible": (math.inf, False),
    "incompressible, curved": (math.inf, True),
    "compressible": (4.4e6, False),
}


@pytest.mark.parametrize("bulk", [math.inf, 4.4e6])
def test_the_manufactured_map_is_what_it_says(verification, bulk):
    # the test's own basis: F is the slope of the map, det F = 1, the body force is -Div P
    exact = verification.Manufactured(bulk)
    X = np.random.default_rng(0).random((40, 3)) * verification.SIDE
    h = 1e-4 * verification.SIDE
    slope = np.stack(
        [(exact.position(X + h * e) - exact.position(X - h * e)) / (2 * h) for e in np.eye(3)], axis=-1
    )
    np.testing.assert_allclose(exact.gradient(X), slope, atol=1e-7)
    J = np.linalg.det(exact.gradient(X))
    if math.isinf(bulk):
        np.testing.assert_allclose(J, 1, atol=1e-14)
    else:
        assert np.ptp(J) > 0.02
    coarse = -sum(
        (exact.stress(X + h * e)[..., j] - exact.stress(X - h * e)[..., j]) / (2 * h)
        for j, e in enumerate(np.eye(3))
    )
    force = exact.force(X)
    np.testing.assert_allclose(force, coarse, atol=1e-5 * np.abs(force).max())


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_rates(verification, case):
    # catches an inconsistent element: wrong quadrature, an unstable or locking pair, lost curvature
    bulk, curved = CASES[case]
    rows = verification.rates((6, 9, 12), bulk, curved)
    for _, _, of_u, _, of_p in rows[1:]:
        assert abs(of_u - 3) < 0.15, rows
        assert abs(of_p - 2) < 0.15, rows


@pytest.mark.parametrize("case", CASES)
def test_rates_on_coarse_meshes(verification, case):
    bulk, curved = CASES[case]
    rows = verification.rates((3, 4, 6), bulk, curved)
    for _, _, of_u, _, of_p in rows[1:]:
        assert 2.7 < of_u < 3.5, rows
        assert 1.85 < of_p < 2.3, rows
