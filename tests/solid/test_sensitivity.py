"""Derivatives at a converged state against differences of two runs that are each solved anew."""

from dataclasses import replace

import numpy as np
import pytest

from fem_spa.errors import InputError
from fem_spa.solid.knobs import knob, knob_names
from fem_spa.solid.path import solve
from fem_spa.solid.problem import Layer, Loads, StepControl
from fem_spa.solid.sensitivity import Sensitivities

END = {"near": 4.0e4, "far": 2.0e4}
TIGHT = StepControl(tolerance=1e-11, max_iterations=40)
PAPER = {"paper": Layer(2e8, 1e-4)}


def last(problem):
    result = solve(problem, TIGHT)
    assert result.status == "done", result.message
    return result.rows[-1]


def numbers(row):
    out = [row.angle, *row.tip, row.volume]
    return np.array(out if row.force is None else [*out, row.force])


def found_and_expected(problem, name, mode=None, relative=1e-3):
    """The observer's derivatives at the end of the path, and the difference of two runs."""
    turned = knob(problem, name, mode)
    seen = Sensitivities([turned])
    solve(problem, TIGHT, [seen])
    d = seen.found[-1]
    step = relative * turned.value
    ends = [numbers(last(turned.turn(problem, turned.value + s))) for s in (step, -step)]
    got = [d.angle[0], *d.tip[0], d.volume[0]] + ([] if d.force is None else [d.force[0]])
    return np.array(got), (ends[0] - ends[1]) / (2 * step)


def assert_close(got, expected, relative):
    # tip coordinates have one scale: one that symmetry keeps at zero is noise
    scale = np.abs(expected)
    scale[1:4] = scale[1:4].max()
    assert np.all(np.abs(got - expected) <= relative * scale), (got, expected)


@pytest.mark.parametrize(
    "name",
    [
        *("materials.body.C10", "materials.body.C20", "materials.stiff.scale", "materials.body.density"),
        *("layers.paper.modulus", "layers.paper.thickness", "layers.paper.poisson"),
    ],
)
def test_material_and_layer(finger_problem, name):
    # catches a forgotten part of dR/dq, a sign, or a tangent of another state
    loads = Loads([END], gravity=(0.0, 0.0, -9.81))
    problem = finger_problem(loads, density=1080.0, layers=PAPER)
    assert_close(*found_and_expected(problem, name), 2e-4)


@pytest.mark.parametrize("control", ["volume", "gas-mass"])
def test_pressure_answers_where_volume_is_prescribed(finger_problem, control):
    # catches the border: with the pressure kept the volume would change
    target = 3.0e-7 if control == "volume" else 1.2
    loads = Loads([{"near": target, "far": target}], control=control)
    problem = finger_problem(loads, layers=PAPER)
    turned = knob(problem, "materials.body.C10")
    seen = Sensitivities([turned])
    result = solve(problem, TIGHT, [seen])
    assert result.status == "done"
    d = seen.found[-1]
    rows = [last(turned.turn(problem, turned.value * (1 + s))) for s in (1e-3, -1e-3)]
    width = 2e-3 * turned.value
    expected = [(rows[0].pressure[c] - rows[1].pressure[c]) / width for c in ("far", "near")]
    assert d.pressure[0] == pytest.approx(expected, rel=1e-4)
    assert d.angle[0] == pytest.approx((rows[0].angle - rows[1].angle) / width, rel=1e-3)
    if control == "volume":
        assert abs(d.volume[0]) < 1e-6 * result.rows[-1].volume / turned.value


def test_by_pressure(finger_problem):
    problem = finger_problem(Loads([END]), layers=PAPER)
    seen = Sensitivities([])
    solve(problem, TIGHT, [seen])
    d = seen.found[-1]
    assert d.names == ("pressure.far", "pressure.near")
    for k, name in enumerate(("far", "near")):
        ends = [
            numbers(last(replace(problem, loads=Loads([{**END, name: END[name] * (1 + s)}]))))
            for s in (1e-3, -1e-3)
        ]
        expected = (ends[0] - ends[1]) / (2e-3 * END[name])
        assert_close(np.array([d.angle[k], *d.tip[k], d.volume[k]]), expected, 2e-4)


def test_force_of_a_blocked_tip_that_gravity_has_moved(finger_problem):
    # catches the drift of the held tip with the material, and a reaction that forgets its direct part
    loads = Loads([END], gravity=(0.0, 0.0, -981.0))
    problem = finger_problem(loads, density=1080.0, layers=PAPER, blocked=True)
    got, expected = found_and_expected(problem, "materials.body.C10")
    assert got[-1] == pytest.approx(expected[-1], rel=1e-3)
    assert_close(got, expected, 2e-3)


def test_nodes_that_move_with_a_number(finger_problem, half_finger):
    # catches observables that depend on the rest shape directly: volume and tip, not only through x
    mode = np.zeros_like(half_finger.points)
    mode[:, 0] = 0.2 * half_finger.points[:, 0]
    mode[:, 2] = 0.1 * half_finger.points[:, 2]
    problem = finger_problem(Loads([END]), layers=PAPER)
    assert_close(*found_and_expected(problem, "walls.scale", mode), 5e-4)


def test_every_state_and_names(finger_problem):
    problem = finger_problem(Loads([END]), layers=PAPER)
    few, many = Sensitivities([]), Sensitivities([], every=True)
    result = solve(problem, StepControl(), [few, many])
    assert len(few.found) == 2 and len(many.found) == len(result.rows)
    assert "materials.body.scale" in knob_names(problem)
    with pytest.raises(InputError, match="allowed are"):
        knob(problem, "layers.paper.colour")
    with pytest.raises(InputError, match="try C10, C20"):
        knob(problem, "materials.body.C40")
    with pytest.raises(InputError, match="no such number"):
        knob(problem, "materials.body.density")
