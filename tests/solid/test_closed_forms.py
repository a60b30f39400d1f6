"""Closed forms: the cases of benchmarks/verification, held to their bounds."""

import numpy as np
import pytest

from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, Problem
from fem_spa.solid.space import build_space
from materials.response import MODES

MM = 1e-3
NAMES = ["arruda-boyce", "extended-tube", "gent", "linear", "mooney-rivlin", "neo-hooke", "ogden", "yeoh"]


def test_every_law_is_there(verification):
    from materials.laws import LAWS

    assert sorted(LAWS) == NAMES == sorted(verification.SAMPLES)


@pytest.mark.parametrize(("name", "degrees"), [("neo-hooke", 60.0), ("mooney-rivlin", 75.0), ("yeoh", 90.0)])
def test_flexure_of_a_block(verification, name, degrees):
    # catches wrong bending stiffness: locking, a wrong second invariant, hardening forgotten
    check = verification.flexure(name, degrees)
    assert check.error < check.bound


def test_thick_sphere_through_its_limit_point(verification):
    # catches a wrong follower pressure, border or volume; a walk that stops at the peak
    checks, result = verification.sphere()
    for check in checks:
        assert check.error < check.bound, check.measure
    pressure = np.array([row.pressure["main"] for row in result.rows])
    assert pressure[-1] < 0.9 * pressure.max()
    assert np.all(np.diff([row.volume for row in result.rows]) > 0)


@pytest.mark.parametrize("name", ["mooney-rivlin", "yeoh"])
def test_thick_tube_in_plane_strain(verification, name):
    check = verification.cylinder(name)
    assert check.error < check.bound


def test_heavy_hanging_bar(verification):
    # catches a wrong weight, and gravity's sign
    check = verification.hanging_bar()
    assert check.error < check.bound


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", NAMES)
def test_homogeneous_modes(verification, name, mode):
    # catches a law whose stress is not the closed form's, in pull and in push
    for stretch in (0.8, 1.5):
        check = verification.homogeneous(name, mode, stretch)
        assert check.error < check.bound, stretch


# -- hydrostatic patch test --------------------------------------------------------------------------


@pytest.mark.parametrize("bulk", ["incompressible", "compressible"])
def test_pressure_on_all_sides(verification, bulk):
    # catches a pressure load that is out of balance with a uniform hydrostatic stress, on curved faces too
    v = verification
    K = np.inf if bulk == "incompressible" else 4e6
    rng = np.random.default_rng(7)
    mesh = v.box([v.even(0, 10 * MM, 2)] * 3)
    inside = np.setdiff1d(
        np.arange(len(mesh.points)), np.concatenate([f.ravel() for f in mesh.surfaces.values()])
    )
    mesh.points[inside] += 0.3 * MM * rng.standard_normal((len(inside), 3))
    wall = np.vstack([mesh.surfaces[s] for s in ("x1", "y1", "z1")])
    bent = np.setdiff1d(wall, np.concatenate([mesh.surfaces[s].ravel() for s in ("x0", "y0", "z0")]))
    mesh.points[bent] += 0.2 * MM * rng.standard_normal((len(bent), 3))
    mesh.surfaces["cavity around"] = wall
    problem = Problem(
        mesh,
        {"body": v.material("yeoh", K)},
        Loads([{"around": 3e4}]),
        fixed=(),
        symmetry={"x0": "x", "y0": "y", "z0": "z"},
    )
    result = solve(problem)
    assert result.status == "done", result.message
    (state,) = result.states
    J = 1.0 if np.isinf(K) else 1 - 3e4 / K
    expected = problem.mesh.points * (np.cbrt(J) - 1)
    space = build_space(mesh)
    np.testing.assert_allclose(state.pressure_field, -3e4, rtol=1e-6)
    np.testing.assert_allclose(state.displacement[space.node_of], expected, atol=1e-9 * 10 * MM)


def test_pressure_inside_and_outside(verification):
    # the same with a void: a body wholly surrounded by one pressure does not move, however large that is
    v = verification
    mesh = v.box(
        [v.even(0, 9 * MM, 3)] * 3,
        voids={"inside": (np.zeros(3), np.full(3, 6 * MM))},
    )
    mesh.surfaces["cavity outside"] = np.vstack([mesh.surfaces[s] for s in ("x1", "y1", "z1")])
    problem = Problem(
        mesh,
        {"body": v.material("mooney-rivlin")},
        Loads([{"inside": 2e5, "outside": 2e5}]),
        fixed=(),
        symmetry={"x0": "x", "y0": "y", "z0": "z"},
    )
    result = solve(problem)
    assert result.status == "done", result.message
    (state,) = result.states
    np.testing.assert_allclose(state.pressure_field, -2e5, rtol=1e-6)
    assert np.max(np.abs(state.displacement)) < 1e-9 * 9 * MM
