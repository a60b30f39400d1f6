"""A walk that is given its memory back goes on as if it had never stopped: the same to the last bit."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, StepControl
from fem_spa.solid.walk_memory import Told

KPA = 1e3
CASES = {
    "path with a corner under gravity": {
        "loads": Loads(
            points=[{"near": 6 * KPA, "far": 1 * KPA}, {"near": 2 * KPA, "far": 8 * KPA}],
            gravity=(0.0, 0.0, -9.81),
        ),
        "density": 1080.0,
    },
    "volume": {"loads": Loads(points=[{"near": 5.2e-7, "far": 5.0e-7}], control="volume")},
    "blocked": {"loads": Loads(points=[{"near": 5 * KPA, "far": 5 * KPA}]), "blocked": True},
    "contact": {"loads": Loads(points=[{"near": 9 * KPA, "far": 9 * KPA}]), "contact": True},
}


@pytest.mark.parametrize("case", CASES)
def test_goes_on_as_if_it_had_never_stopped(finger_problem, case):
    """From the beginning, two steps on the way, and the end: rows, state and counts."""
    problem = finger_problem(**CASES[case])
    steps = StepControl(imposed_steps=5 if case == "volume" else None)
    memories = []
    whole = solve(problem, steps, keep=lambda memory: memories.append(copy.deepcopy(memory)))
    assert whole.status == "done" and len(memories) >= len(whole.rows) > 5
    for memory in [*memories[:: len(memories) // 3 + 1], memories[-1]]:
        again = solve(problem, steps, memory=memory)
        assert (again.status, again.message) == (whole.status, whole.message)
        assert again.newton_iterations == whole.newton_iterations
        assert again.factorizations == whole.factorizations
        assert again.touch_pressure == whole.touch_pressure and again.warnings == whole.warnings
        for one, other in zip(again.rows, whole.rows, strict=True):
            assert one.pressure == other.pressure and one.volume == other.volume
            assert one.gap == other.gap and one.force == other.force
            assert one.angle == other.angle and np.array_equal(one.tip, other.tip)
            assert one.iterations == other.iterations and one.is_point == other.is_point
        assert np.array_equal(again.states[0].displacement, whole.states[0].displacement)
        assert np.array_equal(again.states[0].pressure_field, whole.states[0].pressure_field)


def test_what_was_told_stays_and_full_blocks_are_kept():
    """Blocks are the same objects from one memory to the next, so that they are written once."""
    told = Told()
    for i in range(250):
        told.append(i)
    first = told.memory()
    told.append(250)
    second = told.memory()
    assert [len(part) for part in first] == [100, 100, 50] and len(second[-1]) == 51
    assert all(a is b for a, b in zip(first[:2], second[:2], strict=True))
    other = Told()
    other.recall(second)
    other.append(251)
    assert list(other) == list(range(252))
