"""GMRES against direct solutions of small systems; how many iterations it takes where theory knows."""

from __future__ import annotations

import numpy as np
import pytest

from fem_spa.solid.gmres import gmres

N = 40


def same(v):
    return v.copy()


@pytest.fixture
def system():
    """A matrix that is neither symmetric nor definite, and a right-hand side."""
    rng = np.random.default_rng(3)
    return rng.normal(size=(N, N)) + np.diag(np.linspace(-9.0, 20.0, N)), rng.normal(size=N)


def test_the_direct_solution(system):
    """Within as many iterations as there are unknowns; the residual that it tells is the true one."""
    A, b = system
    found = gmres(lambda v: A @ v, same, b, 1e-12, N)
    np.testing.assert_allclose(found.solution, np.linalg.solve(A, b), rtol=0, atol=1e-10)
    assert found.iterations <= N and found.residual <= 1e-12


def test_an_iteration_for_each_eigenvalue(system):
    """Catches a basis that is not orthogonal, and one iteration too many."""
    rotation = np.linalg.qr(system[0])[0]
    A = rotation @ np.diag(np.repeat([-2.0, 1.0, 5.0, 7.0], N // 4)) @ rotation.T
    assert gmres(lambda v: A @ v, same, system[1], 1e-10, N).iterations == 4


def test_the_preconditioner_stands_on_the_right(system):
    """With the inverse it is one iteration; with half of it the solution is the same."""
    A, b = system
    inverse = np.linalg.inv(A)
    found = gmres(lambda v: A @ v, lambda v: 0.5 * inverse @ v, b, 1e-10, N)
    assert found.iterations == 1
    np.testing.assert_allclose(found.solution, np.linalg.solve(A, b), rtol=0, atol=1e-10)


def test_where_it_does_not_converge_the_residual_says_so(system):
    A, b = system
    found = gmres(lambda v: A @ v, same, b, 1e-12, 5)
    assert found.iterations == 5 and found.residual > 1e-6
    assert found.residual == pytest.approx(np.linalg.norm(A @ found.solution - b) / np.linalg.norm(b))
    lost = gmres(lambda v: A @ v, lambda v: np.full(N, np.nan), b, 1e-12, N)
    assert not lost.residual <= 1e-12 and np.all(lost.solution == 0.0)


def test_a_singular_matrix_and_nothing_to_solve(system):
    """Catches a division by zero in both."""
    b = np.eye(N)[0]
    assert gmres(lambda v: 0.0 * v, same, b, 1e-12, N).residual == pytest.approx(1.0)
    nothing = gmres(lambda v: v, same, 0.0 * b, 1e-12, N)
    assert nothing.iterations == 0 and np.all(nothing.solution == 0.0)
