"""The implicit modal integration against the explicit loop; the damper at other steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import model_text, read_model
from fem_spa.reduced.rod import Rod, arm


def wild(seconds: float = 12.0) -> Drive:
    """Steps and walks of all chambers, an arm tilted by 40 degrees with a payload."""
    rng = np.random.default_rng(4)
    time = np.arange(0, seconds, 0.01)
    walk = np.repeat(np.cumsum(rng.integers(-1, 2, (time.size // 5, 3)) * 1e4, axis=0), 5, axis=0)
    pressure = np.clip(1e5 + walk, 0, 3.5e5)
    pressure[: time.size // 2] *= np.array([1.0, 0.0, 0.5])
    return Drive(time, pressure, orientation=0.7, payload=0.02)


@pytest.mark.parametrize("clamp", ["element", "base"])
def test_modes_follow_the_explicit_loop(clamp: str) -> None:
    """Mean within 0.4 %, worst within 1.5 % of the motion; a lost term is a hundred times that."""
    model, drive = replace(arm(), clamp=clamp), wild()
    slow = model.simulate(drive)
    fast = replace(model, integration="modal").simulate(drive)
    error, span = np.linalg.norm(fast - slow, axis=1), np.ptp(slow, axis=0).max()
    assert span > 0.05
    assert error.mean() < 4e-3 * span and error.max() < 1.5e-2 * span


def test_modes_come_to_rest_where_the_statics_do() -> None:
    model = replace(arm(), integration="modal", clamp="base")
    p = np.array([1.5e5, 0.0, 0.8e5])
    drive = Drive(np.array([0.0, 30.0]), np.tile(p, (2, 1)))
    tip = model.simulate(drive)
    assert tip[0] == pytest.approx(model.settled(0 * p)[0], abs=1e-6)
    assert np.linalg.norm(tip[1] - model.settled(p)[0]) < 2e-4


def test_damping_does_not_depend_on_the_step() -> None:
    """The rate that (31) amounts to with Table 1's dt is kept at a quarter of it: same motion to 0.1 %."""
    drive = Drive(np.linspace(0, 2, 41), np.tile([1e5, 0, 0], (41, 1)))
    usual, fine = arm().simulate(drive), arm().with_values(time_step=5e-5).simulate(drive)
    assert np.abs(usual - fine).max() < 1e-3 * np.ptp(usual, axis=0).max()


def test_a_stiffer_rod_takes_the_step_that_it_needs() -> None:
    """Five times the modulus at a fifth of the strain: Table 1's step would blow up."""
    tip = arm().with_values(modulus=8e6).simulate(Drive(np.array([0, 8.0]), np.full((2, 3), 3e5)))
    assert np.all(np.isfinite(tip))
    assert tip[1] == pytest.approx(arm().with_values(modulus=8e6).settled(np.full(3, 3e5))[0], abs=1e-5)


def test_the_choice_is_in_the_file() -> None:
    model = read_model({"kind": "rod", "preset": "am-i-support", "integration": "modal", "clamp": "base"})
    assert isinstance(model, Rod) and model.integration == "modal"
    assert 'integration = "modal"' in model_text(model) and 'clamp = "base"' in model_text(model)
