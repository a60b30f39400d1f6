"""The valve: (28)-(30) for steps, ramps followed whatever the sampling, nothing changed where it is ideal."""

from __future__ import annotations

from dataclasses import astuple

import numpy as np
import pytest

from fem_spa.errors import InputError
from fem_spa.reduced.model import Drive
from fem_spa.reduced.tables import amount
from fem_spa.reduced.valve import ARM, Valve, behind, read_valve, valve_pressure

BAR = 1e5
SHARP = 1e-9  # s, within which a commanded step goes up


def smooth_step(t: np.ndarray, start: float, end: float, begin: float, duration: float) -> np.ndarray:
    """(28) written down apart from the module."""
    x = np.clip((t - start) / duration, 0.0, 1.0)
    return begin + (end - begin) * x * x * (3 - 2 * x)


def test_steps_are_those_of_the_paper() -> None:
    """Its Fig. 4: 0 to 2 bar in 0.4 s, then down by 1 bar in 0.56 s."""
    command_time = np.array([0, 0.5, 0.5 + SHARP, 1.5])
    command = np.array([2, 2, 1, 1]) * BAR
    t = np.linspace(0, 1.5, 301)
    expected = np.where(
        t <= 0.5, smooth_step(t, 0, 2 * BAR, 0, 0.4), smooth_step(t, 0.5, 1 * BAR, 2 * BAR, 0.56)
    )
    got = valve_pressure(command_time, command, ARM, at=t)
    assert got == pytest.approx(expected, abs=1e-3)  # Pa
    late = valve_pressure(command_time, command, Valve(ARM.rise, ARM.drop, 0.1, ARM.threshold), at=t)
    assert late[20:] == pytest.approx(expected[:-20], abs=1e-3)
    assert np.all(late[:21] == 0)


def test_an_actuation_that_is_overtaken_starts_from_where_it_was() -> None:
    """Half-way up a new, lower command: the pressure turns round there, without jump or overshoot."""
    t = np.linspace(0, 2, 2001)
    got = valve_pressure(np.array([0, 0.2, 0.2 + SHARP, 2]), np.array([2, 2, 0.5, 0.5]) * BAR, ARM, at=t)
    assert got.max() == pytest.approx(1 * BAR, rel=1e-4)
    assert got[t >= 0.2] == pytest.approx(
        smooth_step(t[t >= 0.2], 0.2, 0.5 * BAR, 1 * BAR, 0.5 * 0.56), abs=1.0
    )


def test_an_ideal_valve_changes_nothing() -> None:
    rng = np.random.default_rng(1)
    time = np.cumsum(rng.uniform(1e-4, 5.0, 200))
    pressure = rng.uniform(-50e3, 300e3, (200, 3))
    assert np.array_equal(valve_pressure(time, pressure, Valve()), pressure)
    drive = behind(Drive(time, pressure, orientation=1.0), Valve())
    assert np.array_equal(drive.pressure, pressure) and drive.orientation == 1.0


@pytest.mark.parametrize("interval", [0.002, 0.05, 10.0])
def test_slow_ramps_are_followed_whatever_the_sampling(interval: float) -> None:
    """1 bar up and down in 10 s each; a valve that began anew at each sample would lag more and more."""
    time = np.arange(0, 20 + interval / 2, interval)
    pressure = BAR * (1 - np.abs(time - 10) / 10)
    assert valve_pressure(time, pressure, Valve(0.2 / BAR, 0.56 / BAR)) == pytest.approx(
        pressure, abs=1e-6 * BAR
    )


def test_a_step_followed_by_a_ramp_does_not_depend_on_the_sampling() -> None:
    at = np.linspace(0, 3, 61)
    answers = []
    for interval in (0.001, 0.004, 0.02):
        time = np.arange(0, 3 + interval / 2, interval)
        answers.append(valve_pressure(time, BAR * (2 + 0.3 * time), ARM, at=at))
    for other in answers[1:]:
        assert np.max(np.abs(other - answers[0])) < 0.02 * BAR
    assert answers[0][-1] == pytest.approx(2.9 * BAR, rel=1e-6)


def test_commands_faster_than_the_valve_are_flattened() -> None:
    """At 5 Hz the command turns before the valve has followed: the swing is smaller and never overshoots."""
    time = np.linspace(0, 4, 4001)
    command = BAR * (1 - np.cos(2 * np.pi * 5 * time))
    got = valve_pressure(time, command, ARM)
    assert got.min() >= 0 and got.max() <= command.max()
    assert np.ptp(got[2000:]) < 0.6 * np.ptp(command)


def test_below_the_threshold_nothing_happens() -> None:
    time = np.linspace(0, 1, 101)
    command = np.where(time < 0.5, 0.19, -0.19) * BAR
    assert np.all(valve_pressure(time, command, ARM) == 0)
    ramp = valve_pressure(time, 0.4 * BAR * time, Valve(threshold=0.2 * BAR))
    assert np.array_equal(ramp, np.where(0.4 * BAR * time < 0.2 * BAR, 0, 0.4 * BAR * time))


def test_tables_and_what_is_refused() -> None:
    read = read_valve({"rise": "0.2 s/bar", "drop": "5.6 s/MPa", "threshold": "20 kPa"})
    assert astuple(read) == pytest.approx(astuple(ARM))
    assert amount("20 ms", "s", "delay") == pytest.approx(0.02)
    for table, words in (
        ({"rize": "1 s/bar"}, "did you mean 'rise'"),
        ({"rise": "1 s"}, "not in s/bar"),
        ({"delay": "-1 s"}, "allowed is 0 s"),
    ):
        with pytest.raises(InputError, match=words):
            read_valve(table)
    with pytest.raises(InputError, match="zero or more"):
        Valve(delay=-1.0)
    with pytest.raises(InputError, match="must increase"):
        valve_pressure(np.array([0, 2, 1]), np.zeros(3), ARM)
    with pytest.raises(InputError, match="before the first command"):
        valve_pressure(np.array([0, 1]), np.zeros(2), ARM, at=np.array([-1.0, 0]))
