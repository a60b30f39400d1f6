"""The rod on a clamp that turns under its moment: closed forms at rest and in motion, the fast limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from fem_spa.errors import InputError
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import model_text, read_model
from fem_spa.reduced.rod import Rod, arm
from fem_spa.reduced.rod_kernel import CLAMP
from fem_spa.reduced.rod_static import equilibria

LENGTH, MASS, PULL = 0.19, 0.1704, 9.80513
NOTHING = np.zeros((1, 3))


def soft(compliance: float, model: Rod | None = None) -> Rod:
    return (model or arm()).with_values(base_compliance=compliance)


@pytest.mark.parametrize("clamp", ["element", "base"])
def test_a_cantilever_falls_further_by_its_base(clamp: str) -> None:
    """Tip load F on a spring k = 1/c: tip further by F L^2 / k, turned further by F L / k."""
    model, force, c = replace(arm().switched(gravity=False), clamp=clamp), 1e-4, 0.7
    found = [m.rest(NOTHING, tip_force=(0.0, force, 0.0)) for m in (model, soft(c, model))]
    (fast, _, q0), (moved, _, q1) = found
    assert moved[0, 1] - fast[0, 1] == pytest.approx(force * LENGTH**2 * c, rel=1e-6)
    turned = np.cross(q0[-1, 6:], q1[-1, 6:])
    assert turned == pytest.approx([force * LENGTH * c, 0.0, 0.0], rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("payload", [0.0, 0.05])
def test_a_stiff_arm_hangs_on_its_spring(payload: float) -> None:
    """Level and rigid: the angle is c (m/2 + payload) g L cos(angle), to 35 degrees; damped or not."""
    c = 5.0
    model = soft(c, arm().with_values(modulus=1e9))
    angle = brentq(lambda a: a - c * (MASS / 2 + payload) * PULL * LENGTH * np.cos(a), 0.0, 1.5)
    x, y, z = model.settled(np.zeros(3), np.pi / 2, payload)[0]
    assert angle > 0.6
    assert np.arctan2(y, -z) == pytest.approx(angle, rel=2e-3)
    assert np.hypot(y, z) == pytest.approx(LENGTH, rel=1e-3) and abs(x) < 1e-9
    start = model.simulate(Drive(np.array([0.0, 0.1]), np.zeros((2, 3)), np.pi / 2, payload))[0]
    assert start == pytest.approx([x, y, z], abs=2e-5)


@pytest.mark.parametrize("clamp", ["element", "base"])
def test_the_turn_is_the_moment_times_the_compliance(clamp: str) -> None:
    """Bent, tilted, loaded: the clamp's directors against the moment summed over the nodes as they lie."""
    c = 0.9
    model = soft(c, replace(arm(), clamp=clamp))
    strain = model.strains(np.array([[2e5, 0.0, 0.5e5], [2.5e5, 1e5, 0.0]]))
    force = np.array([0.02, -0.01, 0.05])
    tip, r, Q = model.rest(strain, 0.8, 0.03, force)
    assert tip[-1] == pytest.approx(r[-1], abs=1e-12)
    rod = model.discrete()
    rod.mass[-1] += 0.03
    loads = rod.mass[:, None] * PULL * np.array([0.0, np.sin(0.8), -np.cos(0.8)])
    loads[-1] += force
    theta = c * np.cross(r, loads).sum(axis=0)
    assert np.linalg.norm(theta) > 0.1
    R = Rotation.from_rotvec(theta).as_matrix()
    if clamp == "element":
        assert Q[0].reshape(3, 3) == pytest.approx(CLAMP.reshape(3, 3) @ R.T, abs=1e-9)
    held, held_q = np.empty_like(r), np.empty_like(Q)  # a fast clamp under loads that are turned back
    stiff = (clamp == "base", rod.length, rod.axial, rod.bending)
    equilibria(strain[-1:], held_q, held, loads @ R, np.zeros(3), *stiff)
    assert held @ R.T == pytest.approx(r, abs=1e-9)


def test_no_weight_no_turn() -> None:
    """Pressure alone leaves no moment at the clamp of a free arm."""
    p = np.array([3e5, 0.0, 1e5])
    bare = arm().switched(gravity=False)
    assert soft(2.0, bare).settled(p) == pytest.approx(bare.settled(p), abs=1e-12)


def test_no_compliance_is_the_fast_clamp() -> None:
    """1e-13 rad/(N m) moves nothing by more than it should, at rest and in motion."""
    pressures = np.array([[2e5, 0.0, 1e5], [1e5, 3e5, 0.0], [1e5, 3e5, 0.0]])
    assert soft(1e-13).settled(pressures, 1.0) == pytest.approx(arm().settled(pressures, 1.0), abs=1e-12)
    drive = Drive(np.linspace(0, 2, 21), np.tile([2e5, 0.0, 1e5], (21, 1)), 0.7)
    fast = replace(arm(), integration="modal").simulate(drive)
    assert soft(1e-13).simulate(drive) == pytest.approx(fast, abs=1e-7)


def test_a_stiff_arm_comes_back_as_a_damped_pendulum() -> None:
    """Weightless: bending throws the base round, and it comes back with lambda c m L^2 / 3."""
    c = 1.0
    model = soft(
        c, replace(arm().switched(gravity=False, valve=False), clamp="base").with_values(modulus=1e8)
    )
    rod = model.discrete()
    time = np.arange(0.0, 6.0, 0.02)
    tip = model.simulate(Drive(time, np.outer(time > 0.05, [3e5, 0.0, 0.0])))
    off = np.linalg.norm(tip - model.settled(np.array([3e5, 0.0, 0.0])), axis=1)
    first, last = off[np.searchsorted(time, 0.5)], off[np.searchsorted(time, 3.5)]
    expected = rod.viscous * c * MASS * LENGTH**2 / 3
    assert 3.0 / np.log(first / last) == pytest.approx(expected, rel=0.03)


def test_the_motion_ends_where_the_statics_do() -> None:
    model = replace(soft(0.4), clamp="base")
    p = np.array([1.5e5, 0.0, 0.8e5])
    tip = model.simulate(Drive(np.array([0.0, 40.0]), np.tile(p, (2, 1)), 1.2, 0.02))
    assert tip[0] == pytest.approx(model.settled(0 * p, 1.2, 0.02)[0], abs=1e-5)
    assert np.linalg.norm(tip[1] - model.settled(p, 1.2, 0.02)[0]) < 3e-4


@pytest.mark.parametrize("compliance", [0.5, 2.5])
def test_sudden_pressures_are_borne(compliance: float) -> None:
    """5 bar on and off in a step without valve: Newton's method with a kept slope alone gives up there."""
    model = soft(compliance, replace(arm().switched(valve=False), clamp="base"))
    time = np.arange(0, 8, 0.04)
    pressure = 5e5 * np.outer(time % 2 > 1, [1.0, 1.0, 1.0])
    tip = model.simulate(Drive(time, pressure, 1.57))
    assert np.all(np.isfinite(tip)) and np.ptp(tip[:, 2]) > 0.05


def test_the_file_has_it_in_any_unit() -> None:
    model = read_model({"kind": "rod", "preset": "am-i-support", "base_compliance": "20 deg/(N*m)"})
    assert model.parameters["base_compliance"].value == pytest.approx(np.radians(20))
    again = read_model(model.table())
    assert again.parameters["base_compliance"].value == pytest.approx(np.radians(20), rel=1e-12)
    assert "base_compliance" in model_text(model) and "base_compliance" not in model_text(arm())
    for wrong in ("-1 rad/(N*m)", "1 rad", "90 rad/(N*m)"):
        with pytest.raises(InputError, match="base_compliance"):
            read_model({"kind": "rod", "preset": "am-i-support", "base_compliance": wrong})
