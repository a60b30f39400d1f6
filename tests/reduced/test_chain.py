"""Chain at rest in its own weight: patterns, symmetry, closed forms, exact inverses, files."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from fem_spa.errors import InputError
from fem_spa.reduced.chain import Chain, in_series, task_space
from fem_spa.reduced.chain_fit import fit_stiffness
from fem_spa.reduced.chain_links import chord_angle, energy, loaded, places, weight_moments
from fem_spa.reduced.chain_stiffness import (
    WEIGHT,
    elongation,
    joint_stiffness,
    linear_stiffness,
    opening,
    torque_of_extension,
)
from fem_spa.reduced.hysteresis import BoucWen
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import model_text, read_model

D, THETA = 13e-3 / math.cos(math.pi / 8), math.pi / 8
PRESSURES = np.linspace(0, 350e3, 8)


def chain(**keys: object) -> Chain:
    model = read_model({"kind": "chain", "gravity": False} | keys)
    assert isinstance(model, Chain)
    return model


def drive(pressure: np.ndarray, orientation: float = 0.0, payload: float = 0.0) -> Drive:
    p = np.atleast_1d(pressure)
    return Drive(np.arange(len(p), dtype=float), p if p.ndim == 2 else p[:, None], orientation, payload)


def test_patterns_are_those_of_the_paper() -> None:
    """(2), (3), and a layer in pieces; half folds at the ends are twice as stiff."""
    linear, bending = chain(segments=6), chain(segments=6, layer="1")
    assert linear.actuators[0].pattern().tolist() == [1, -1, 1, -1, 1, -1, 1]
    assert bending.actuators[0].pattern().tolist() == [1, 0, 1, 0, 1, 0, 1]
    pieces = chain(segments=6, layer="101", k_theta="2 N*m/rad", k_layer="3 N*m/rad")
    assert pieces.actuators[0].layered().tolist() == [True, True, False, False, True, True, True]
    assert pieces.actuators[0].pattern().tolist() == [1, 0, 1, -1, 1, 0, 1]
    assert pieces.links.stiffness.tolist() == [6, 3, 2, 2, 3, 3, 6]
    own = chain(segments=2, torques=[1, 0.5, -1])
    assert own.actuators[0].pattern().tolist() == [1, 0.5, -1]


def test_rest_shape_is_the_drawing() -> None:
    """134 mm long on the axis; joints at the heights of the folds."""
    model = chain()
    joints, _ = places(model.links, np.zeros(24))
    assert joints[-1] == pytest.approx(0.134 + 0j, abs=1e-12)
    assert joints[:-1].imag == pytest.approx(6.5e-3 * (1 - 2 * (np.arange(24) % 2)))
    assert np.diff(joints[:-1].real) == pytest.approx(13e-3 * math.tan(THETA))


@pytest.mark.parametrize("segments", [2, 22, 23])
def test_extension_is_straight_and_equal_in_all_segments(segments: int) -> None:
    """Equal torques of alternating sign: the tip neither turns nor, with an even number of segments,
    leaves the axis; every segment gains (4)."""
    model = chain(
        segments=segments, torque={"columns": ["pressure [kPa]", "torque [N*m]"], "rows": [[0, 0], [1, 0.3]]}
    )
    q = model.turns(drive(np.array([1e3])))
    joints, _ = places(model.links, q)
    assert q.sum() == pytest.approx(0, abs=1e-12)
    assert np.diff(joints[0, :-1].real) - D * math.sin(THETA) == pytest.approx(
        np.full(segments, float(elongation(0.3 / 1.3296 / 2, D, THETA))), abs=1e-12
    )
    fold = D * math.cos(THETA) - D * math.cos(THETA + 0.3 / 1.3296 / 2)
    assert joints[0, -1].imag == pytest.approx(fold / 2 - (-1) ** segments * fold / 2, abs=1e-12)


def test_small_turns_have_the_closed_form() -> None:
    """Bending by t: the tip turns by sum t/k, the chord by sum t/k (L - x_j) / L to first order."""
    model = chain(
        layer="1", torque={"columns": ["pressure [kPa]", "torque [N*m]"], "rows": [[0, 0], [1, 1e-6]]}
    )
    angle, _, _, y = model.simulate(drive(np.array([1e3])))[0]
    k, pattern = model.links.stiffness, model.actuators[0].pattern()
    joints, _ = places(model.links, np.zeros(24))
    arms = 0.134 - joints[:-1].real
    assert angle == pytest.approx(np.sum(1e-6 * pattern / k * arms) / 0.134, rel=1e-4)
    assert y == pytest.approx(np.sum(1e-6 * pattern / k * arms), rel=1e-4)


def test_a_bent_chain_is_an_arc() -> None:
    """Equal folds: the even joints lie on a circle, and the chord turns by half of what the tip does."""
    model = chain(preset="bending", segments=200, end="0 mm", k_layer="20 N*m/rad")
    q = model.turns(drive(np.array([200e3])))[0]
    joints = places(model.links, q)[0][2:-2:2]
    centre = joints[0] + 0j
    a, b, c = joints[0], joints[len(joints) // 2], joints[-1]
    along, across = b - a, c - a
    centre = a + along * across * (np.conj(along) - np.conj(across)) / (
        np.conj(along) * across - along * np.conj(across)
    )
    radius = np.abs(joints - centre)
    assert radius == pytest.approx(np.full(radius.size, radius[0]), rel=1e-9)
    assert chord_angle(model.links, q) == pytest.approx(q.sum() / 2, abs=0.02)
    assert q.sum() > 1.0


def test_the_layer_keeps_its_length() -> None:
    """The distance of neighbouring even joints, which the layer spans, does not change in bending."""
    model = chain(preset="bending")
    joints, _ = places(model.links, model.turns(drive(np.array([0, 350e3]))))
    even = np.abs(np.diff(joints[:, 0:-1:2], axis=1))
    assert even[1] == pytest.approx(even[0], rel=1e-12)
    odd = np.abs(np.diff(joints[:, 1:-1:2], axis=1))
    assert np.all(odd[1] > odd[0])


def test_torque_from_extension_gives_the_extension_back() -> None:
    model = chain(
        extension={"columns": ["pressure [kPa]", "displacement [mm]"], "rows": [[0, 0], [100, 20], [350, 40]]}
    )
    got = model.simulate(drive(np.array([0, 100e3, 350e3])))
    assert got[:, 1] == pytest.approx([0, 20e-3, 40e-3], abs=1e-12)
    assert chain().simulate(drive(PRESSURES))[:, 1] == pytest.approx(40e-3 * PRESSURES / 350e3, abs=2e-6)


@pytest.mark.parametrize("printed", [True, False])
@pytest.mark.parametrize("k", [0.14791, 1.3296, 20.0])
def test_equation_5_is_inverted_exactly(printed: bool, k: float) -> None:
    linear = linear_stiffness(WEIGHT, D, THETA, 23, k, printed)
    assert joint_stiffness(WEIGHT, D, THETA, 23, linear, printed) == pytest.approx(k, rel=1e-12)


def test_statics_of_a_pulled_chain() -> None:
    """A payload on a weightless hanging chain against the stiffness derived; (5) as printed is about
    twice it."""
    k = 0.5
    model = chain(segments=22, k_theta=f"{k} N*m/rad", mass="0 g", gravity=True)
    payload = 0.05
    grown = model.simulate(drive(np.array([0.0]), payload=payload))[0, 1]
    force = payload * 9.80665
    assert joint_stiffness(force, D, THETA, 22, force / grown, printed=False) == pytest.approx(k, rel=1e-5)
    wrong = joint_stiffness(force, D, THETA, 22, force / grown, printed=True)
    assert wrong / k == pytest.approx(2 / math.cos(THETA + float(opening(grown, D, THETA, 22))), rel=1e-5)


@pytest.mark.parametrize("stiffening", [0.0, 20.0])
def test_equilibrium_is_the_least_energy(stiffening: float) -> None:
    """Weights, payload and air against minimisation of the potential, a chain held level."""
    keys = {
        "k_layer": "0.05 N*m/rad",
        "layer_stiffening": f"{stiffening} 1/rad^2",
        "mass": "60 g",
        "gravity": True,
    }
    model = chain(preset="bending", segments=5, **keys)
    d = drive(np.array([100e3]), orientation=np.pi / 2, payload=0.02)
    links, torque = loaded(model.links, 0.02), model.torques(d.pressure)[0]
    g = 9.80665 * complex(0, -1)

    def potential(q: np.ndarray) -> float:
        return float(energy(links, q, g) - torque @ q)

    found = minimize(potential, np.zeros(6), method="BFGS", options={"gtol": 1e-10})
    assert model.turns(d)[0] == pytest.approx(found.x, abs=1e-6)
    assert np.max(np.abs(found.x)) > 0.1


def test_folds_at_the_layer_stiffen() -> None:
    """Each fold's moment is k q (1 + s q^2) of its own opening, half folds too; without layer none does."""
    soft = chain(segments=6, layer="10")
    stiff = soft.with_values(layer_stiffening=30.0)
    q, linear = stiff.turns(drive(PRESSURES)), soft.turns(drive(PRESSURES))
    part = stiff.links.part
    layered = stiff.actuators[0].layered()
    own = q / part
    assert (own * (1 + 30.0 * np.where(layered, own, 0.0) ** 2) * part) == pytest.approx(linear)
    assert q[:, ~layered] == pytest.approx(linear[:, ~layered])
    assert q[-1, 0] < 0.9 * linear[-1, 0]
    with pytest.raises(InputError, match="one or the other"):
        replace(stiff, hysteresis=BoucWen(0.3, 6, 2)).simulate(drive(PRESSURES))


def test_weight_moments_are_the_slope_of_the_energy() -> None:
    rng = np.random.default_rng(0)
    links = loaded(chain(segments=7).links, 0.03)
    q, g = 0.4 * rng.standard_normal(8), 9.8 * np.exp(-1.1j)
    moment, W = weight_moments(links, q, g)
    later = np.maximum.outer(np.arange(8), np.arange(8))
    for j in range(8):
        h = 1e-6 * np.eye(8)[j]
        slope = (energy(links, q + h, g) - energy(links, q - h, g)) / 2e-6
        assert links.stiffness[j] * q[j] - moment[j] == pytest.approx(slope, abs=1e-8)
        bent = (weight_moments(links, q + h, g)[0] - weight_moments(links, q - h, g)[0]) / 2e-6
        assert bent == pytest.approx(-W[later[j]], abs=1e-8)


def test_gravity_and_orientation() -> None:
    """Hanging, weight pulls a bent actuator back; upside down it pushes it on; level it sags and,
    bending, rises."""
    model = chain(preset="bending", gravity=True)
    p = np.array([0.0, 175e3])
    free = replace(model, gravity=False).simulate(drive(p))[:, 0]
    down, level, up = (model.simulate(drive(p, o))[:, 0] for o in (0.0, np.pi / 2, np.pi))
    assert down[1] < free[1] < up[1]
    assert level[0] < -0.01 < down[0] + 0.01
    many = np.linspace(0, 350e3, 400)
    dense = model.simulate(drive(many, 1.0))
    few = model.simulate(drive(many[::57], 1.0))
    assert dense[::57] == pytest.approx(few, abs=1e-8)  # the grid in between is fine enough


def test_series_and_task_space() -> None:
    """A linear and a bending actuator: tip = tip of the first + tip of the second, turned by nothing;
    both at once."""
    linear, bending = chain(), chain(preset="bending")
    both = in_series(linear, bending)
    p = np.array([[0, 0], [350e3, 0], [0, 200e3], [350e3, 200e3]], float)
    got = both.simulate(drive(p))
    a, b = linear.simulate(drive(p[:, 0])), bending.simulate(drive(p[:, 1]))
    assert got[:, 2] == pytest.approx(a[:, 2] + b[:, 2], abs=1e-12)
    assert got[:, 3] == pytest.approx(a[:, 3] + b[:, 3], abs=1e-12)
    space = task_space(both, [np.array([0, 350e3]), np.array([0, 100e3, 200e3])])
    assert space.shape == (2, 3, 4)
    assert space[1, 2] == pytest.approx(got[3])
    with pytest.raises(InputError, match="two or more"):
        in_series(linear)
    heavy = replace(both, gravity=True).links
    assert heavy.mass.sum() == pytest.approx(2 * linear.links.mass.sum() + linear.links.mass[-1])
    assert np.sum(heavy.mass) == pytest.approx(26e-3 - linear.links.mass[-1])


def test_stiffness_is_found_from_bending_angles() -> None:
    truth = chain(preset="bending", k_layer="0.9 N*m/rad", gravity=True)
    angle = truth.simulate(drive(PRESSURES))[:, 0]
    start = chain(preset="bending", k_layer="2 N*m/rad", gravity=True)
    assert fit_stiffness(start, PRESSURES, angle).model.parameters["k_layer"].value == pytest.approx(
        0.9, rel=1e-6
    )
    hits = 0
    for seed in range(40):
        noisy = angle + np.deg2rad(2) * np.random.default_rng(seed).standard_normal(8)
        fit = fit_stiffness(start, PRESSURES, noisy, source="bench")
        low, high = fit.model.parameters["k_layer"].interval or (0, 0)
        hits += low < 0.9 < high
        assert np.deg2rad(0.2) < fit.mae < np.deg2rad(4)
    assert 34 <= hits <= 40
    with pytest.raises(InputError, match="does not depend"):
        fit_stiffness(chain(preset="bending"), PRESSURES, angle, name="k_theta")


def test_hysteresis_closes_and_stays_within_its_limit() -> None:
    law = {"A": 0.3, "beta": 6, "alpha": 2}
    model, bare = chain(hysteresis=law, damping="0 N*m*s/rad"), chain()
    wave = 175e3 * (1 - np.cos(np.linspace(0, 6 * np.pi, 601)))
    got, static = model.simulate(drive(wave))[:, 1], bare.simulate(drive(wave))[:, 1]
    up, down = got[450], got[550]
    assert down - up > 1e-3
    assert got[200:401] == pytest.approx(got[400:], abs=3e-4)  # the law drifts, less each cycle
    assert np.all(np.abs(got - static) < 23 * D * 0.3 / 8 / 2 * 1.01)
    heavy = replace(model, gravity=True).simulate(drive(wave))[:, 1]
    assert heavy == pytest.approx(got, abs=1e-4)


def test_files(tmp_path: object) -> None:
    for keys in (
        {
            "preset": "bending",
            "layer": "101",
            "mass": "20 g",
            "hysteresis": {"A": 0.3, "beta": 6, "alpha": 2, "n": 2},
        },
        {
            "segments": 4,
            "torques": [1, 0, 0.5, 0, 1],
            "valid": {"low": "0 kPa", "high": "100 kPa", "error": "2 deg"},
        },
    ):
        model = chain(**keys)
        again = read_model(model.table())
        assert isinstance(again, Chain)
        assert again.simulate(drive(PRESSURES)) == pytest.approx(model.simulate(drive(PRESSURES)), abs=1e-9)
        assert again.table() == model.table()
        assert "[model]" in model_text(model)
    series = chain(series=[{"preset": "linear"}, {"preset": "bending"}], k_layer_2="2 N*m/rad")
    p = np.column_stack([PRESSURES, PRESSURES])
    assert series.parameters["k_layer_2"].value == 2.0
    assert read_model(series.table()).simulate(drive(p)) == pytest.approx(series.simulate(drive(p)), abs=1e-9)


@pytest.mark.parametrize(
    "keys, words",
    [
        ({"preset": "bendin"}, "'linear' and 'bending'"),
        ({"segments": 2.5}, "whole number"),
        ({"segments": 0}, "at least 1"),
        ({"layer": "12"}, "'1' is a whole one"),
        ({"torques": [1, 2]}, "24 folds"),
        ({"torques": ["a"]}, "factors"),
        ({"k_theta": "3 mm"}, "not in N"),
        ({"k_theta": "-3 N*m/rad"}, "allowed is"),
        ({"gravity": 1}, "true or false"),
        ({"hysteresis": {"A": 1}}, "its keys"),
        ({"hysteresis": {"A": 1, "beta": 1, "alpha": 2}}, "Bouc-Wen"),
        (
            {"extension": {"columns": ["pressure [kPa]", "displacement [mm]"], "rows": [[0, 0], [9, 999]]}},
            "allow",
        ),
        ({"torque": 3}, "columns and rows"),
        ({"series": 3}, "list of tables"),
        ({"series": [{"preset": "linear"}]}, "two or more"),
        ({"series": [{"preset": "linear"}, {"gravity": True}]}, "no such key"),
        ({"stiffness": 1}, "no such key"),
    ],
)
def test_a_wrong_table_is_refused_in_one_line(keys: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read_model({"kind": "chain"} | keys)
    assert "\n" not in str(caught.value)


def test_extensions_beyond_the_chain_are_refused() -> None:
    with pytest.raises(InputError, match="allow"):
        torque_of_extension(np.array([0.5]), D, THETA, 23, 1.0)
    with pytest.raises(InputError, match="beyond straight"):
        linear_stiffness(1e4, D, THETA, 23, 1.0)
    with pytest.raises(InputError, match="takes one pressure"):
        chain().simulate(drive(np.zeros((3, 2))))
