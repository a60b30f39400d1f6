"""Motion by MuJoCo: inertia, energy, small vibrations, the end of a motion; steps and sines."""

from __future__ import annotations

import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import approx_fprime

from fem_spa.errors import InputError
from fem_spa.reduced.chain import Chain
from fem_spa.reduced.chain_dynamics import highest_rate, model_text, motion
from fem_spa.reduced.chain_links import energy, inertia_matrix, loaded, places
from fem_spa.reduced.hysteresis import BoucWen
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import read_model
from fem_spa.reduced.responses import sine_drive, sine_figures, step_drive, step_figures

G = 9.80665
needs_mujoco = pytest.mark.skipif(find_spec("mujoco") is None, reason="MuJoCo is an extra: dynamics")


def chain(**keys: object) -> Chain:
    """Few, soft, heavy links: slow enough for a short test."""
    usual = {
        "segments": 4,
        "k_theta": "0.02 N*m/rad",
        "k_layer": "0.02 N*m/rad",
        "mass": "40 g",
        "end": "8 mm",
    }
    model = read_model({"kind": "chain", "damping": "0 N*m*s/rad"} | usual | keys)
    assert isinstance(model, Chain)
    return model


def test_the_inertia_is_that_of_the_kinetic_energy() -> None:
    """M from its definition: velocities of the centres of mass by differences of `places`."""
    links = loaded(chain().links, 0.01)
    q = 0.3 * np.random.default_rng(0).standard_normal(5)
    M = inertia_matrix(links, q)
    rate = np.random.default_rng(1).standard_normal(5)
    h = 1e-6
    velocity = (places(links, q + h * rate)[1] - places(links, q - h * rate)[1]) / (2 * h)
    turning = np.cumsum(rate)
    kinetic = 0.5 * np.sum(links.mass * np.abs(velocity) ** 2 + links.inertia * turning**2)
    assert 0.5 * rate @ M @ rate == pytest.approx(kinetic, rel=1e-8)
    assert pytest.approx(M.T) == M


def test_a_payload_is_a_point_mass_at_the_tip() -> None:
    """Kinetic energy and weight with it are those without it plus the point's."""
    bare = chain().links
    links = loaded(bare, 0.03)
    q, rate = np.random.default_rng(4).standard_normal((2, 5)) * 0.4
    h = 1e-6
    tip = (places(bare, q + h * rate)[0][-1] - places(bare, q - h * rate)[0][-1]) / (2 * h)
    more = rate @ (inertia_matrix(links, q) - inertia_matrix(bare, q)) @ rate
    assert more == pytest.approx(0.03 * abs(tip) ** 2, rel=1e-7)
    lifted = places(bare, q)[0][-1].real - bare.rest.real
    assert energy(links, q, 9.0 + 0j) - energy(bare, q, 9.0 + 0j) == pytest.approx(-0.03 * 9.0 * lifted)


def test_the_mass_is_spread_along_the_segments() -> None:
    """The inertia about the first joint is that of the segments and the end cut into a thousand points
    each."""
    model = chain()
    links = model.links
    joints, _ = places(links, np.zeros(5))
    length = 2 * 8e-3 + 4 * model.values(0)["length"] * np.sin(model.values(0)["fold"])
    share = (np.arange(1000) + 0.5) / 1000
    end = 0.04 * 8e-3 / length
    total = 0.0
    for j, mass in enumerate([*[(0.04 - 2 * end) / 4] * 4, end]):
        first = joints[j] if j < 4 else joints[5] - 8e-3
        total += mass * np.mean(np.abs(first + share * (joints[j + 1] - first) - joints[0]) ** 2)
    assert inertia_matrix(links, np.zeros(5))[0, 0] == pytest.approx(total, rel=1e-5)


@needs_mujoco
def test_between_samples_the_pressure_runs_linearly() -> None:
    """A ramp given by its ends moves the chain as the same ramp given finely."""
    model = replace(chain(damping="0.002 N*m*s/rad"), dynamics=True)
    ends, fine = np.array([0.0, 0.3]), np.linspace(0, 0.3, 31)
    one, other = (model.simulate(Drive(t, 1e6 * t[:, None]))[-1] for t in (ends, fine))
    assert one == pytest.approx(other, abs=2e-3 * np.max(np.abs(other - model.links.rest.real)))


@needs_mujoco
def test_half_folds_have_half_the_hysteresis() -> None:
    """One segment between two ends has half folds only."""
    law = {"A": 0.4, "beta": 8, "alpha": 2}
    keys = {"segments": 1, "hysteresis": law, "gravity": False, "damping": "0.0002 N*m*s/rad"}
    model = chain(**keys)
    slow = sine_drive(200e3, 0.5, 1.0, samples=200)
    moving, still = replace(model, dynamics=True).turns(slow), model.turns(slow)
    bare = replace(model, hysteresis=None).turns(slow)
    assert moving == pytest.approx(still, abs=0.06 * np.max(np.abs(still - bare)))


@needs_mujoco
def test_mujoco_has_the_same_chain() -> None:
    """Its inertia matrix and its forces of weight and springs are ours, at a bent state."""
    import mujoco

    links = loaded(chain().links, 0.02)
    q = 0.5 * np.random.default_rng(2).standard_normal(5)
    g = G * complex(0.6, -0.8)
    model = mujoco.MjModel.from_xml_string(model_text(links, g, 1e-4, False))
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    columns = []
    for unit in np.eye(5):
        column = np.zeros(5)
        mujoco.mj_mulM(model, data, column, unit)
        columns.append(column)
    M = np.array(columns)
    assert pytest.approx(inertia_matrix(links, q), rel=1e-9, abs=1e-14) == M
    slope = approx_fprime(q, lambda x: float(energy(links, x, g)), 1e-7)
    assert M @ data.qacc == pytest.approx(-slope, abs=2e-7)
    assert data.site("tip").xpos[:2] == pytest.approx(
        [places(links, q)[0][-1].real, places(links, q)[0][-1].imag]
    )


@needs_mujoco
def test_energy_is_kept_without_damping() -> None:
    """Let go from a bent state, level, heavy: kinetic plus potential energy stays to 5e-6 of what is
    exchanged."""
    links = chain().links
    g = G * complex(0.0, -1.0)
    start = np.array([0.2, -0.3, 0.1, 0.4, -0.2])
    time = np.linspace(0, 0.5, 251)
    q, rate = motion(links, time, np.zeros((251, 5)), start, g)
    kinetic = np.array([0.5 * v @ inertia_matrix(links, x) @ v for x, v in zip(q, rate, strict=True)])
    total = kinetic + energy(links, q, g)
    assert np.max(np.abs(total - total[0])) < 5e-6 * kinetic.max()
    assert kinetic.max() > 1e-4


@needs_mujoco
def test_small_vibrations_have_the_eigenfrequencies() -> None:
    links = chain().links
    M = inertia_matrix(links, np.zeros(5))
    values, shapes = eigh(np.diag(links.stiffness), M)
    assert highest_rate(links) == pytest.approx(np.sqrt(values[-1]))
    omega, shape = np.sqrt(values[0]), shapes[:, 0]
    start = 1e-4 * shape / np.max(np.abs(shape))
    time = np.linspace(0, 4 * np.pi / omega, 200)
    q, _ = motion(links, time, np.zeros((200, 5)), start)
    assert q == pytest.approx(np.cos(omega * time)[:, None] * start, abs=1e-3 * np.max(np.abs(start)))


@needs_mujoco
def test_a_damped_motion_ends_at_the_equilibrium() -> None:
    soft = chain(layer="1", damping="0.004 N*m*s/rad")
    model = replace(soft.with_values(layer_stiffening=5.0), dynamics=True)
    drive = step_drive(150e3, 4.0, 0.02, orientation=np.pi / 2)
    drive = replace(drive, payload=0.01)
    got = model.simulate(drive)
    still = replace(model, dynamics=False).simulate(drive)
    assert got[-1] == pytest.approx(still[-1], abs=1e-6)
    assert abs(soft.simulate(drive)[-1, 0]) > 1.01 * abs(got[-1, 0])
    at_rest = replace(drive, pressure=np.zeros_like(drive.pressure))
    assert got[0] == pytest.approx(replace(model, dynamics=False).simulate(at_rest)[0])
    assert abs(at_rest.pressure).max() == 0 and abs(got[0, 0]) > 1e-3  # it sags before


@needs_mujoco
def test_an_overdamped_chain_without_inertia_is_exponential() -> None:
    """Masses of the printed actuator matter little: every fold follows c q' + k q = t."""
    model = replace(read_model({"kind": "chain", "gravity": False}), dynamics=True)  # type: ignore[type-var]
    assert isinstance(model, Chain)
    drive = step_drive(336e3, 0.6, 0.01)
    got = model.simulate(drive)[:, 1]
    q_end = replace(model, dynamics=False).turns(drive)[-1]
    share = 1 - np.exp(-drive.time / 0.1)
    expected = model.observe(share[:, None] * q_end)[:, 1]
    assert got == pytest.approx(expected, abs=0.01 * expected[-1])
    figures = step_figures(drive.time, got)
    assert figures.overshoot < 1e-6 and 0.09 < figures.to_63 < 0.12


@needs_mujoco
def test_hysteresis_in_motion_is_that_of_the_slow_limit() -> None:
    """Driven slowly the chain with (6) on every fold follows the quasi-static law (7), half folds too."""
    law = {"A": 0.4, "beta": 8, "alpha": 2}
    keys = {"layer": "1", "hysteresis": law, "gravity": False, "damping": "0.0002 N*m*s/rad"}
    slow = sine_drive(120e3, 0.5, 1.5, samples=150)
    model = chain(**keys)
    moving = replace(model, dynamics=True).simulate(slow)[:, 0]
    static = replace(model, dynamics=False).simulate(slow)[:, 0]
    bare = replace(model, hysteresis=None).simulate(slow)[:, 0]
    assert np.max(np.abs(static - bare)) > 0.02
    assert moving == pytest.approx(static, abs=0.1 * np.max(np.abs(static - bare)))


@needs_mujoco
def test_a_motion_that_blows_up_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A step far beyond the shortest period: MuJoCo would start again from rest, go on, and write a log."""
    monkeypatch.chdir(tmp_path)
    links, time = chain().links, np.linspace(0, 20, 11)
    with pytest.raises(InputError, match="blew up"):
        motion(links, time, np.full((11, 5), 0.1), np.full(5, 0.3), step=0.5)
    assert not list(tmp_path.iterdir())


def test_without_mujoco_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(InputError, match=r'pip install "fem-spa\[dynamics\]"'):
        replace(chain(), dynamics=True).simulate(step_drive(1e3, 0.1, 0.05))
    chain(hysteresis={"A": 0.1, "beta": 1, "alpha": 0}).simulate(step_drive(1e3, 0.1, 0.05))  # needs none


def test_figures_of_known_responses() -> None:
    time = np.linspace(0, 5, 5001)
    step = step_figures(time, 2 * (1 - np.exp(-time / 0.5)))
    assert (step.to_63, step.to_90 - step.to_10) == pytest.approx((0.5, 0.5 * np.log(9)), rel=1e-3)
    ringing = step_figures(time, 1 - np.exp(-time) * np.cos(20 * time))
    assert ringing.overshoot == pytest.approx(np.exp(-np.pi / 20), abs=0.02)
    drive = sine_drive(100e3, 2.0, 3)
    assert drive.pressure.min() == 0 and drive.pressure.max() == pytest.approx(100e3)
    late = np.interp(drive.time - 0.02, drive.time, drive.pressure[:, 0])
    figures = sine_figures(drive, late, 2.0)
    assert figures.lag == pytest.approx(2 * np.pi * 2.0 * 0.02, rel=1e-3)
    assert figures.gap == pytest.approx(np.sin(2 * np.pi * 2.0 * 0.02), rel=1e-2)
    assert sine_figures(drive, drive.pressure[:, 0], 2.0).gap < 1e-6
    for call in (
        lambda: step_drive(1.0, 0.0),
        lambda: sine_drive(1.0, 0.0, 1),
        lambda: step_figures(time, np.ones(5001)),
        lambda: sine_figures(Drive(time, np.ones((5001, 1))), time, 0.1),
    ):
        with pytest.raises(InputError):
            call()
    assert BoucWen(0.1, 1, 0).limit == pytest.approx(0.1)
