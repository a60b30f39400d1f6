"""How Newton's method converges: quadratically with new factors, to the same state with kept ones."""

import numpy as np
import pytest

from fem_spa.solid.linear import make_solver
from fem_spa.solid.newton import Constraint, Factors, solve_equilibrium
from fem_spa.solid.problem import Layer, Loads
from fem_spa.solid.space import build_space
from fem_spa.solid.system import System


def walk(system, control, targets, **options):
    """Last equilibrium of a few steps, each from the state before."""
    rest = system.evaluate(system.rest(), np.zeros(2), 0.0).volume
    factors = Factors(make_solver(system.pattern))
    x, pressure = system.rest(), np.zeros(2)
    for target in targets:
        scaled = np.asarray(target) * (rest if control == "volume" else 1.0)
        constraint = Constraint(control, scaled, rest, 101325.0)
        found = solve_equilibrium(system, factors, x, pressure, constraint, 1.0, max_iterations=40, **options)
        assert found.converged, found.why
        x, pressure = found.x, found.pressure
    factors.solver.free()
    return found


CONTROLS = {
    "pressure": [[1e4, 5e3], [2e4, 1e4]],
    "volume": [[1.1, 1.05], [1.25, 1.1]],
    "gas-mass": [[1.2, 1.1], [1.4, 1.2]],
}


@pytest.mark.parametrize("control", CONTROLS)
def test_quadratic_at_the_end_of_a_step(finger_problem, control):
    # catches a tangent that is only nearly right: then the exponent falls to one
    problem = finger_problem(Loads([], gravity=(0.0, 0.0, -9.81)), density=1080.0)
    system = System(problem, build_space(problem.mesh))
    history = walk(system, control, CONTROLS[control], tolerance=1e-11, renew_always=True).history
    error = np.array(history)
    error = error[error > 1e-13]
    fall = np.log(error[1:] / error[:-1])
    # the exponent of the last step above round-off that began well inside the quadratic zone
    exponents = [
        fall[k + 1] / fall[k]
        for k in range(len(fall) - 1)
        if error[k + 1] < 1e-2 and error[k + 2] > 1e-12 and fall[k] < 0
    ]
    assert exponents, history
    assert exponents[-1] > 1.8, history


@pytest.mark.parametrize("control", CONTROLS)
def test_kept_factors_lead_to_the_same_state(finger_problem, control):
    # catches updates of the kept factors that converge elsewhere, or stop early
    problem = finger_problem(Loads([], gravity=(0.0, 0.0, -9.81)), density=1080.0)
    system = System(problem, build_space(problem.mesh))
    full = walk(system, control, CONTROLS[control], tolerance=1e-10, renew_always=True)
    kept = walk(system, control, CONTROLS[control], tolerance=1e-10)
    size = np.abs(system.displacement(full.x)).max()
    np.testing.assert_allclose(
        system.displacement(kept.x), system.displacement(full.x), rtol=0, atol=1e-8 * size
    )
    np.testing.assert_allclose(kept.pressure, full.pressure, rtol=1e-8)


def test_membrane_too(finger_problem):
    problem = finger_problem(Loads([]), layers={"paper": Layer(1e9, 2e-4)})
    system = System(problem, build_space(problem.mesh))
    full = walk(system, "pressure", CONTROLS["pressure"], tolerance=1e-10, renew_always=True)
    kept = walk(system, "pressure", CONTROLS["pressure"], tolerance=1e-10)
    size = np.abs(system.displacement(full.x)).max()
    np.testing.assert_allclose(
        system.displacement(kept.x), system.displacement(full.x), rtol=0, atol=1e-8 * size
    )


def test_both_linear_solvers_agree(verification, finger_problem):
    # catches a wrong reading of the upper triangle by either
    pytest.importorskip("pypardiso")
    problem = finger_problem(Loads([]))
    system = System(problem, build_space(problem.mesh))
    found = [
        verification.settle(system, system.rest(), [1.5e4, 1e4], tolerance=1e-11, backend=backend)
        for backend in ("pardiso", "superlu")
    ]
    u, p = (
        [system.displacement(f.x) for f in found],
        [f.x[system.n_u :] for f in found],
    )
    np.testing.assert_allclose(u[0], u[1], rtol=0, atol=1e-8 * np.abs(u[1]).max())
    np.testing.assert_allclose(p[0], p[1], rtol=0, atol=1e-8 * np.abs(p[1]).max())
