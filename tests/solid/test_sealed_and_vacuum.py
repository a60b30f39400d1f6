"""Loads beside plain pressure: a sealed chamber obeys Boyle, a vacuum is pressure with the other sign."""

from __future__ import annotations

import numpy as np
import pytest

from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads


def test_a_sealed_chamber_beside_an_inflated_one(finger_problem):
    """Its mass of gas stays: absolute pressure times volume; it gives way to its neighbour, or resists it."""
    loads = Loads([{"near": 1.0, "far": 1.6}], control="gas-mass")
    result = solve(finger_problem(loads))
    assert result.status == "done"
    state, rest = result.states[-1], solve(finger_problem(Loads([]))).rows[0]
    assert rest.volume > 0
    first, last = result.rows[0], result.rows[-1]
    volume = state.cavity_volume["near"]
    sealed = loads.atmosphere + last.pressure["near"]
    assert sealed * volume == pytest.approx(loads.atmosphere * first.volume / 2, rel=1e-6)
    assert abs(last.pressure["near"]) > 1.0  # Pa: the neighbour moves its wall
    assert last.pressure["far"] > 10 * abs(last.pressure["near"])


def test_vacuum_is_pressure_with_the_other_sign_while_small(finger_problem):
    """Volume and angle change by as much the other way, but for second order."""
    changes = []
    for pressure in (200.0, -200.0):
        result = solve(finger_problem(Loads([{"near": pressure, "far": pressure}])))
        rows = result.rows
        assert result.status == "done"
        changes.append(np.array([rows[-1].volume - rows[0].volume, rows[-1].angle * rows[0].volume]))
    assert changes[0][0] > 0
    assert changes[1] == pytest.approx(-changes[0], rel=0.02)
