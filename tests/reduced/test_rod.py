"""The rod's model file, its switches and its signs."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fem_spa.errors import InputError
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import model_text, read_model
from fem_spa.reduced.rod import Rod, arm


def rod(**table: Any) -> Rod:
    model = read_model({"kind": "rod", "preset": "am-i-support", **table})
    assert isinstance(model, Rod)
    return model


def held(*bar: float, seconds: float = 8.0, **more: Any) -> Drive:
    time = np.linspace(0, seconds, 5)
    return Drive(time, np.tile(1e5 * np.array(bar), (5, 1)), **more)


def test_the_arm_bends_away_from_the_chamber() -> None:
    """Chamber 1 on +y, 2 at (+x, -y), 3 at (-x, -y), as the contract has it; a swapped pair would show."""
    tips = arm().settled(1e5 * np.eye(3))
    assert abs(tips[0, 0]) < 1e-9 and tips[0, 1] < -0.03
    assert tips[1, 0] < -0.03 and tips[1, 1] > 0.015
    assert tips[2, 0] > 0.03 and tips[2, 1] > 0.015


def test_a_turn_of_chambers_is_a_turn_of_the_tip() -> None:
    tips = rod(strain_gains=False).settled(np.array([[2e5, 0.5e5, 0], [0, 2e5, 0.5e5]]))
    c, s = np.cos(2 * np.pi / 3), np.sin(2 * np.pi / 3)  # from +y by way of +x is clockwise seen from above
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    assert tips[1] == pytest.approx(turn @ tips[0], abs=1e-9)


def test_the_loop_comes_to_the_equilibrium() -> None:
    """Two solvers of the same equations, gravity, gains and payload included: one micrometre."""
    model = rod(valve=False)
    drive = held(1.5, 0.4, 0.0, seconds=25, payload=0.02, orientation=0.7)
    moving = model.simulate(drive)[-1]
    assert moving == pytest.approx(model.switched(damping=False).simulate(drive)[-1], abs=1e-6)


def test_rest_before_the_first_sample_is_hanging() -> None:
    """Half the weight stretches the whole: w L / (2 E A), and a payload adds m g L / (E A)."""
    drive = held(0.0, 0.0, 0.0, seconds=0.5, payload=0.05)
    tip = arm().simulate(drive)
    assert np.ptp(tip, axis=0).max() < 1e-9
    v = arm().values()
    area = 3 * np.pi * (v["outer_radius"] ** 2 - v["inner_radius"] ** 2)
    strain = v["gravity_acceleration"] * (0.5 * v["mass"] + 0.05) / (v["modulus"] * area)
    assert -tip[0, 2] == pytest.approx(
        v["length"] * (1 + strain), rel=3e-5
    )  # thinned where stretched: strain^2
    assert rod(gravity=False).simulate(drive)[0, 2] == pytest.approx(-0.19, abs=1e-12)


def test_each_switch_changes_what_it_names() -> None:
    drive = held(1.0, 1.0, 1.0, seconds=1.0)
    full = arm().simulate(drive)
    assert abs(full[-1, 0]) > 1e-3  # unequal gains bend it
    assert np.abs(rod(strain_gains=False).simulate(drive)[:, :2]).max() < 1e-9
    assert rod(strain_gains=[1, 1, 1]).simulate(drive) == pytest.approx(
        rod(strain_gains=False).simulate(drive)
    )
    small = held(0.1, 0.0, 0.0)
    assert np.ptp(arm().simulate(small), axis=0).max() < 1e-9  # below the threshold
    assert np.ptp(rod(valve=False).simulate(small), axis=0).max() > 3e-3
    quasi = rod(damping=False, valve=False).simulate(held(1.0, 0, 0))
    assert np.ptp(quasi, axis=0).max() < 1e-12
    upside_down = arm().simulate(held(1.0, 0, 0, orientation=np.pi))
    hanging = arm().simulate(held(1.0, 0, 0))
    assert upside_down[-1, 1] < hanging[-1, 1] - 0.005  # its weight pulls it further over


def test_level_arm_is_lifted_by_chamber_one() -> None:
    """At 90 deg gravity points along +y of the base, so the arm sags to +y and chamber 1 raises it."""
    rest, bent = arm().settled(np.array([[0, 0, 0], [5e4, 0, 0]]), orientation=np.pi / 2)
    assert rest[1] > 0.01 and bent[1] < rest[1]


def test_effects_are_null_at_their_null_and_act_otherwise() -> None:
    p = np.array([[1.5e5, 0.2e5, 0.0]])
    model = arm()
    assert model.with_values(cross_coupling=0.1).settled(p) == pytest.approx(
        model.settled(p @ (np.full((3, 3), 0.1) + 0.9 * np.eye(3))), abs=1e-12
    )
    tilted = model.switched(gravity=False).with_values(base_tilt_x=0.1).settled(0 * p)[0]
    assert tilted == pytest.approx(-0.19 * np.array([0, -np.sin(0.1), np.cos(0.1)]), abs=1e-12)
    assert model.with_values(payload=0.03).settled(p) == pytest.approx(model.settled(p, payload=0.03))
    assert model.with_values(offset_y=0.002).settled(p) - model.settled(p) == pytest.approx(
        np.array([[0, 0.002, 0]])
    )


def test_the_table_reads_back() -> None:
    model = rod(gravity=False, strain_gains=[1, 1.1, 1], modulus="2 MPa", rise_time="0.1 s/bar")
    text = model_text(model)
    again = read_model(tomllib.loads(text))
    assert model_text(again) == text
    assert isinstance(again, Rod) and again.values() == model.values() and not again.gravity


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"preset": "am-i-suport"}, "am-i-support"),
        ({"preset": 3}, "no such preset"),
        ({"strain_gains": [1, 1]}, "three"),
        ({"strain_gains": "yes"}, "true or false"),
        ({"damping": 1}, "true or false"),
        ({"elements": 7.5}, "whole number"),
        ({"modulus": "1 m"}, "MPa"),
        ({"modulo": "1 MPa"}, "modulus"),
        ({"inner_radius": "9 mm"}, "no wall is left"),
        ({"law": "absent.csv"}, "cannot be read"),
    ],
)
def test_a_wrong_table_is_one_line(table: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        rod(**table)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("drive", "words"),
    [
        (Drive(np.arange(3.0), np.zeros((3, 2))), "takes 3 pressures"),
        (Drive(np.array([0.0, 2.0, 1.0]), np.zeros((3, 3))), "time must increase"),
        (Drive(np.array([0.0, np.nan, 1.0]), np.zeros((3, 3))), "gap in the time"),
        (Drive(np.arange(3.0), np.full((3, 3), np.nan)), "gap in the pressure"),
    ],
)
def test_a_wrong_drive_is_one_line(drive: Drive, words: str) -> None:
    with pytest.raises(InputError, match=words):
        arm().simulate(drive)


def test_one_sample_and_far_too_long_a_record() -> None:
    tip = arm().simulate(Drive(np.zeros(1), np.full((1, 3), 1e5)))
    assert tip == pytest.approx(arm().settled(np.zeros((1, 3))))
    with pytest.raises(InputError, match="cut it"):
        arm().simulate(Drive(np.array([0.0, 1e6]), np.zeros((2, 3))))


def test_no_preset_is_one_line() -> None:
    with pytest.raises(InputError, match="am-i-support"):
        read_model({"kind": "rod"}, Path())
