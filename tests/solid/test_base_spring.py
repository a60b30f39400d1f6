"""A clamp that turns under the moment of the dead loads: closed forms, the fast limit, half and whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from fem_spa.deck import parse_deck
from fem_spa.errors import InputError
from fem_spa.prepare import prepare
from fem_spa.solid.base_spring import rotation
from fem_spa.solid.observe import KeepStates
from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, Problem, StepControl
from fem_spa.solid.sensitivity import Sensitivities
from fem_spa.solid.space import build_space
from fem_spa.solid.system import System

LENGTH, SIDE = 0.04, 0.008
FINE = StepControl(tolerance=1e-11)


def beam(verification, loads: Loads, compliance: float = 0.0, law: str = "neo-hooke") -> Problem:
    mesh = verification.box(
        [np.linspace(0, LENGTH, 6), np.linspace(0, SIDE, 2), np.linspace(0, SIDE, 2)],
        names={"x0": "base", "x1": "tip"},
    )
    material = verification.material(law, density=1080.0)
    return Problem(mesh, {"body": material}, loads, base_compliance=compliance)


def test_a_cantilever_falls_further_by_its_base(verification):
    """Tip load F on a spring k = 1/c: tip further by F L^2 / k, turned further by F L / k."""
    force, c = 1e-4, 30.0
    loads = Loads([], tip_force=(0.0, 0.0, -force))
    fast, soft = (solve(beam(verification, loads, x), FINE).rows[-1] for x in (0.0, c))
    assert fast.tip[2] - soft.tip[2] == pytest.approx(force * LENGTH**2 * c, rel=1e-3)
    assert abs(soft.angle) - abs(fast.angle) == pytest.approx(force * LENGTH * c, rel=1e-3)


def test_a_heavy_body_hangs_on_its_spring(verification):
    """Stiff against its weight, level: the angle is c m g L/2 cos(angle)."""
    pull, mass = 0.05, 1080.0 * LENGTH * SIDE**2
    c = 0.7 / (mass * pull * LENGTH / 2)
    problem = beam(verification, Loads([], gravity=(0.0, 0.0, -pull)), c)
    row = solve(problem, FINE).rows[-1]
    angle = brentq(lambda a: a - c * mass * pull * LENGTH / 2 * np.cos(a), 0.0, 1.5)
    assert angle > 0.5
    middle = SIDE / 2
    at = LENGTH * np.array([np.cos(angle), 0.0, -np.sin(angle)]) + [0.0, middle, middle]
    assert abs(row.angle) == pytest.approx(angle, rel=5e-3)
    np.testing.assert_allclose(row.tip, at, atol=5e-3 * LENGTH)


def test_the_turn_is_the_moment_times_the_compliance(verification):
    """Bent far and turned far about a slanted axis: the moment is summed over the nodes as they are seen."""
    loads = Loads([], gravity=(0.5, 0.7, -1.5), tip_force=(0.0, 2e-3, -4e-3))
    problem, keep = beam(verification, loads, 800.0), KeepStates()
    result = solve(problem, FINE, [keep])
    assert result.status == "done"
    space = build_space(problem.mesh)
    system = System(problem, space)
    shown = space.points + keep.states[-1].displacement
    base = np.unique(space.surfaces["base"])
    centre = np.array([0.0, SIDE / 2, SIDE / 2])
    force = system.dead[: system.n_u].reshape(-1, 3)
    theta = problem.base_compliance * np.cross(shown - centre, force).sum(axis=0)
    assert np.linalg.norm(theta) > 0.2
    moved = (space.points[base] - centre) @ rotation(theta).T + centre
    np.testing.assert_allclose(shown[base], moved, atol=1e-8 * LENGTH)


def test_no_compliance_is_the_fast_base(verification):
    loads = Loads([], tip_force=(0.0, 1e-3, -2e-3))
    fast, soft = (solve(beam(verification, loads, c), FINE).rows[-1] for c in (0.0, 1e-10))
    np.testing.assert_allclose(soft.tip, fast.tip, atol=1e-12)
    assert soft.angle == pytest.approx(fast.angle, abs=1e-10)


def test_pressure_alone_turns_nothing(finger_problem):
    """Closed cavities leave no moment at the base; a weight beside them does, more as the finger bends."""
    end = {"near": 4e3, "far": 4e3}
    free = finger_problem(Loads([end]), density=1080.0)
    fast, soft = (solve(replace(free, base_compliance=c)).rows[-1] for c in (0.0, 5.0))
    np.testing.assert_allclose(soft.tip, fast.tip, rtol=0, atol=1e-12)
    heavy = replace(free, loads=Loads([end], gravity=(0.0, 0.0, -9.81)))
    fast, soft = (solve(replace(heavy, base_compliance=c)).rows[-1] for c in (0.0, 200.0))
    assert soft.angle - fast.angle > 0.02


def test_half_and_whole_turn_alike(finger_problem, half_finger, mirrored):
    loads = Loads([{"near": 4e3, "far": 2e3}], gravity=(0.5, 0.0, -9.81), tip_force=(0.0, 0.0, -0.01))
    half = solve(replace(finger_problem(loads, density=1080.0), base_compliance=50.0)).rows[-1]
    body = finger_problem(loads, density=1080.0, mesh=mirrored(half_finger, "symmetry"), symmetry={})
    whole = solve(replace(body, base_compliance=50.0)).rows[-1]
    np.testing.assert_allclose(half.tip, whole.tip, atol=2e-8)
    assert abs(half.angle) == pytest.approx(abs(whole.angle), rel=1e-5)


def test_derivatives_are_refused(verification):
    problem = beam(verification, Loads([], tip_force=(0.0, 0.0, -1e-3)), 1.0)
    with pytest.raises(InputError, match="fast base"):
        solve(problem, observers=[Sensitivities([])])


DECK = {
    "geometry": {"shape": "pneunet", "size": "9 mm", "fast_chambers": 0, "slow_chambers": 3},
    "materials": {"body": {"card": "dragon-skin-30"}},
    "loads": {"pressure": "5 kPa"},
    "supports": {"base_compliance": "40 deg/(N*m)"},
}


def test_the_deck_says_what_it_does_and_what_it_cannot(tmp_path):
    setup = prepare(parse_deck(DECK, "deck", tmp_path))
    assert setup.problem.base_compliance == pytest.approx(np.radians(40))
    assert setup.resolved["supports"]["base_compliance"] == "40 deg/(N*m)"
    assert any("does nothing here" in text for text in setup.warnings)
    heavy = {**DECK, "loads": {"pressure": "5 kPa", "tip_force": [0, 0, "-0.1 N"]}}
    assert not any("does nothing here" in text for text in prepare(parse_deck(heavy, "d", tmp_path)).warnings)
    with pytest.raises(InputError, match=r"observe\.blocked"):
        prepare(parse_deck({**DECK, "observe": {"blocked": True}}, "deck", tmp_path))
    for wrong in ("-1 deg/(N*m)", "3 deg", 2.0):
        with pytest.raises(InputError, match="base_compliance"):
            parse_deck({**DECK, "supports": {"base_compliance": wrong}}, "deck", tmp_path)
