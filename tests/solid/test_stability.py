"""States that do not stay by themselves are told from those that do."""

import math

import numpy as np
import pytest

from fem_spa.solid.linear import Pardiso, make_solver
from fem_spa.solid.newton import Constraint, Equilibrium, Factors
from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, Material, Problem, StepControl
from fem_spa.solid.space import build_space
from fem_spa.solid.stability import Stability
from fem_spa.solid.system import System
from geometry.ball import Ball
from materials.registry import law

MM = 1e-3
REST = 4 / 3 * math.pi * (10 * MM) ** 3


@pytest.fixture(scope="module")
def ball():
    """Loads -> an eighth of a thick neo-Hookean ball; its pressure has its extremum, 64.6 kPa, at 3.2 times
    the volume at rest."""
    mesh = Ball(inner_radius=10 * MM, outer_radius=13 * MM, share=8).mesh(4 * MM)
    body = {"body": Material(law("neo-hooke"), {"C10": 1e5})}
    problem = Problem(
        mesh, body, Loads([]), fixed=(), symmetry={f"symmetry {a}": a for a in "xyz"}, contact=False
    )
    if make_solver(System(problem, build_space(mesh)).pattern).name != Pardiso.name:
        pytest.skip("SuperLU does not count pivots")
    return lambda loads: Problem(
        mesh, body, loads, fixed=(), symmetry={f"symmetry {a}": a for a in "xyz"}, contact=False
    )


@pytest.mark.parametrize(
    "loads",
    [
        Loads([{"main": 60e3}]),
        Loads([{"main": 2.2 * REST}], control="volume"),
        Loads([{"main": 1.5}], control="gas-mass", atmosphere=1e5),
    ],
)
def test_a_stable_path_has_no_warning(ball, loads):
    # a count that takes pressure unknowns for modes, or a fixed number of them
    result = solve(ball(loads))
    assert result.status == "done" and result.unstable_step is None and not result.warnings


def test_past_the_limit_point_the_volume_alone_holds(ball):
    # no warning at all, or one for every state, or none until the path's end
    result = solve(ball(Loads([{"main": 5 * REST}], control="volume")))
    pressure = np.array([row.pressure["main"] for row in result.rows])
    first = int(np.argmax(np.diff(pressure) < 0)) + 1
    assert 0 < first < len(pressure) - 2 and result.unstable_step == first
    (words,) = result.warnings
    assert "enclosed volume alone" in words and f"step {first}" in words


def test_what_is_prescribed_decides(ball):
    # a border left out, or with the wrong sign: the same state snaps with pressure held, stays with volume
    # held, and with gas in it as the gas gives way less or more than the ball
    problem = ball(Loads([{"main": 5 * REST}], control="volume"))
    space = build_space(problem.mesh)
    seen = {}

    class Last:
        def __getattr__(self, name):
            return lambda *given: seen.update({name: given})

    result = solve(problem, StepControl(), observers=[Last()], space=space)
    state, row = seen["converged"][0], result.rows[-1]
    system = System(problem, space)
    x = np.concatenate([state.displacement.ravel(), state.pressure_field])
    pressure = np.array([row.pressure["main"]])
    found = Equilibrium(x, pressure, system.evaluate(x, pressure, 1.0), 0, True)
    assert found.evaluation.error < 1e-6
    rest = np.array([REST / 8])

    def told(control, atmosphere=0.0):
        constraint = Constraint(control, pressure, rest, atmosphere)
        factors = Factors(make_solver(system.pattern))
        factors.renew(system, x, pressure, constraint, found.evaluation)
        watch = Stability()
        words = watch.look(system, factors, found, constraint, [row])
        assert len(words) == 1
        return watch.held, watch.lost

    # volume that the ball takes for a pressure less: dV/dp, from two states of the path
    before = result.rows[-2]
    yielding = -(row.volume - before.volume) / (row.pressure["main"] - before.pressure["main"])
    assert told("pressure") == (None, row.step)
    assert told("volume") == (row.step, None)
    for gas, expected in ((0.5, (row.step, None)), (2.0, (None, row.step))):
        assert told("gas-mass", row.volume / (gas * yielding) - row.pressure["main"]) == expected
