"""A run that cannot reach its end says how far it came, why, and where."""

import re

import numpy as np
import pytest

from fem_spa.solid.observe import Silent
from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, Material, Problem, StepControl
from materials.registry import law

MM = 1e-3


@pytest.fixture(scope="module")
def balloon(verification):
    """pressure -> an eighth of a thin-walled neo-Hookean ball under it; the peak pressure is at 68 kPa."""
    from geometry.ball import Ball

    mesh = Ball(inner_radius=10 * MM, outer_radius=13 * MM, share=8).mesh(5 * MM)

    def problem(pressure, control="pressure"):
        return Problem(
            mesh,
            {"body": Material(law("neo-hooke"), {"C10": 1e5})},
            Loads([{"main": pressure}], control=control),
            fixed=(),
            symmetry={f"symmetry {a}": a for a in "xyz"},
        )

    return problem


@pytest.mark.parametrize("imposed", [None, 10])
def test_pressure_beyond_the_limit_point(balloon, imposed):
    # catches a run that hangs, raises, loses its rows or claims to be done
    result = solve(balloon(2e5), StepControl(imposed_steps=imposed))
    assert result.status in ("limit", "diverged"), result.message
    if imposed is None:
        assert result.status == "limit"
    pressure = np.array([row.pressure["main"] for row in result.rows])
    assert len(pressure) >= 3 and np.all(np.diff(pressure) > 0)
    # as far as the peak of the closed form (64.6 kPa), give or take the coarse mesh
    assert 6.2e4 < pressure[-1] < 6.6e4
    assert re.search(r"element \d+ of 'body' at \(-?[\d.]+, -?[\d.]+, -?[\d.]+\) mm", result.message)
    assert len(result.states) == 1
    assert result.states[0].cavity_pressure["main"] == pressure[-1]


def test_too_heavy(verification):
    # catches dead loads that fail without a word
    v = verification
    mesh = v.box([v.even(0, 10 * MM, 1), v.even(0, 10 * MM, 1), v.even(0, 60 * MM, 4)], names={"z0": "base"})
    soft = Material(law("linear"), {"E": 600.0, "nu": 0.5}, density=5e4)
    result = solve(Problem(mesh, {"body": soft}, Loads([], gravity=(0.0, 0.0, 9.81))))
    assert result.status in ("diverged", "limit")
    assert "dead loads" in result.message and "element" in result.message
    assert result.rows == [] and result.states == []


@pytest.mark.parametrize("after", [1, 4])
def test_interrupted(balloon, after):
    # catches rows lost on Ctrl-C, or the last one torn
    class Impatient(Silent):
        def __init__(self):
            self.seen = []
            self.end = None

        def converged(self, state, row, fraction):
            self.seen.append((row, fraction))
            if len(self.seen) == after:
                raise KeyboardInterrupt

        def finished(self, result):
            self.end = result

    observer = Impatient()
    result = solve(balloon(5e4), observers=[observer])
    assert result.status == "interrupted"
    assert observer.end is result
    assert [row.step for row in result.rows] == list(range(after))
    assert [row for row, _ in observer.seen] == result.rows
    assert result.states[0].step == after - 1


def test_interrupted_within_an_iteration(balloon):
    class Impatient(Silent):
        def iteration(self, step, pressure, iteration, error):
            if step == 3 and iteration == 1:
                raise KeyboardInterrupt

    result = solve(balloon(5e4), observers=[Impatient()])
    assert result.status == "interrupted"
    assert len(result.rows) == 3
    assert result.states[0].cavity_pressure == result.rows[-1].pressure


def test_observers_hear_of_everything(balloon):
    # catches observers left out, told twice or told of an unconverged state
    class Listener(Silent):
        def __init__(self):
            self.heard = []

        def start(self, problem, space):
            self.heard.append("start")

        def iteration(self, step, pressure, iteration, error):
            self.heard.append((step, iteration, error))

        def converged(self, state, row, fraction):
            assert state.step == row.step
            if row.step:
                step, iteration, error = self.heard[-1]
                assert (step, iteration) == (row.step, row.iterations) and error <= 1e-8
            self.heard.append(("converged", fraction))

        def finished(self, result):
            self.heard.append("finished")

    listener = Listener()
    result = solve(balloon(4e4), observers=[listener])
    assert listener.heard[0] == "start" and listener.heard[-1] == "finished"
    fractions = [h[1] for h in listener.heard if h[0] == "converged"]
    assert len(fractions) == len(result.rows)
    assert fractions[0] == 0.0 and fractions[-1] == pytest.approx(1.0)
    assert np.all(np.diff(fractions) > 0)
