"""Laws from a short piece: a beam's stiffness in closed form, curvature against the difference of two."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fem_spa.calibration.segment import Gauge, chamber_law, rotation_vector, stiffness
from fem_spa.errors import InputError
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import read_model
from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, Material, Problem
from materials.registry import law

MM = 1e-3


@pytest.fixture(scope="module")
def box(verification):
    return verification.box


def problem(mesh):
    material = Material(law("neo-hooke"), {"C10": 1e5})
    return Problem(
        mesh, {"body": material}, Loads([{c: 0.0 for c in mesh.cavities}]), symmetry={"symmetry": "y"}
    )


def finger(box, cells):
    """Half of a bar 6 x 9 mm with a long void above its middle, `cells` x 3 mm long."""
    x = 3 * MM * np.arange(cells + 1)
    z = MM * np.array([0.0, 3, 4.5, 7.5, 9])
    void = (np.array([x[1], 0, z[2]]), np.array([x[-2], 2 * MM, z[3]]))
    return problem(
        box(
            [x, MM * np.array([0.0, 2, 3]), z],
            {"air": void},
            names={"x0": "base", "x1": "tip", "y0": "symmetry"},
        )
    )


def test_stiffness_of_a_beam(box):
    # E I = E b h^3 / 12, E A; catches halves counted once, levers to the wrong end, an axis turned round
    grid = [np.linspace(0, 60 * MM, 21), np.linspace(0, 3 * MM, 2), np.linspace(0, 8 * MM, 4)]
    beam = problem(box(grid, names={"x0": "base", "x1": "tip", "y0": "symmetry"}))
    bending, axial = stiffness(beam, 20 * MM, 40 * MM, 1.6 * MM)
    E, b, h = 6e5, 6 * MM, 8 * MM
    assert bending == pytest.approx(E * b * h**3 / 12, rel=0.02)
    assert axial == pytest.approx(E * b * h, rel=0.01)


def test_curvature_is_that_between_two_pieces(box):
    # two bars, one 4 cells longer: the difference of their tip angles over the difference of their lengths
    top = 60e3
    angles = []
    for cells in (12, 16):
        p = finger(box, cells)
        rows = solve(Problem(p.mesh, p.materials, Loads([{"air": top}]), symmetry=p.symmetry)).rows
        angles.append(rows[-1].angle)
    between = (angles[1] - angles[0]) / (4 * 3 * MM)
    found = chamber_law(finger(box, 14), "air", top, 15 * MM, 27 * MM, 1.6 * MM)
    assert found.status == "done" and found.pressure[-1] == top
    assert abs(found.curvature[-1]) == pytest.approx(abs(between), rel=0.02)
    # away from the chamber, which lies above: downwards, in which the deck's angle is positive
    assert found.curvature[-1] * angles[-1] > 0 and found.curvature[-1] > 0
    assert found.moment == pytest.approx(found.bending_stiffness * found.curvature)
    # as a row of chambers: the angle of a bar with so many cells, but for the ends
    row = found.segments(4, 3 * MM)
    angle = row.simulate(Drive(np.array([0.0]), np.array([[top]])))[0, 0]
    assert angle == pytest.approx(abs(angles[1] - angles[0]), rel=0.03)
    law_of_rod = found.rod_law()
    assert law_of_rod.at(np.array([top]))[0][0] == pytest.approx(found.curvature[-1])
    with pytest.raises(InputError, match="air"):
        chamber_law(finger(box, 10), "water", top, 9 * MM, 21 * MM, 1.6 * MM)
    with pytest.raises(InputError, match="long"):
        chamber_law(finger(box, 10), "air", top, 9 * MM, 2.0, 1.6 * MM)


def test_rotation_vector():
    turn = np.array([0.3, -1.1, 0.4])
    angle = np.linalg.norm(turn)
    x, y, z = turn / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    R = np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K
    assert rotation_vector(R) == pytest.approx(turn)
    assert rotation_vector(np.eye(3)) == pytest.approx(np.zeros(3))
    with pytest.raises(InputError, match="near"):
        Gauge(2.0, 1.0, 0.1)


def row(**numbers):
    table = {
        "kind": "segments",
        "count": 40,
        "pitch": "5 mm",
        "stiffness": "0.02 N*m/rad",
        "law": {"pressure": ["0 kPa", "10 kPa"], "turn": ["0 deg", "3 deg"], "stretch": [0.0, 0.02]},
    }
    return read_model({"model": table | numbers})


def test_a_row_of_chambers_without_weight_is_an_arc():
    got = row().bent(np.array([10e3]))[0]
    angle, length = math.radians(120), 0.2 * 1.02
    assert got[0] == pytest.approx(angle)
    radius = length / angle
    assert got[1] == pytest.approx(radius * math.sin(angle), rel=1e-3)
    assert got[2] == pytest.approx(-radius * (1 - math.cos(angle)), rel=1e-3)


def test_a_row_of_chambers_sags_like_a_beam():
    # level, its own weight: w L^4 / 8 E I at the tip, downwards, where bending is upwards; F L^3 / 3 E I
    EI, L = 0.02 * 5 * MM, 0.2
    pressure = np.array([0.0])
    w = 2e-6 / (5 * MM) * 9.80665
    got = row(mass="0.002 g").bent(pressure, math.pi / 2)[0]
    assert got[2] == pytest.approx(w * L**4 / (8 * EI), rel=0.03)
    assert got[0] == pytest.approx(-w * L**3 / (6 * EI), rel=0.03)
    got = row().bent(pressure, math.pi / 2, 1e-5)[0]
    assert got[2] == pytest.approx(1e-5 * 9.80665 * L**3 / (3 * EI), rel=0.01)
    assert row(gravity=False).bent(pressure, math.pi / 2, 1e-5)[0] == pytest.approx([0.0, L, 0.0])
    # hanging down nothing bends it, but its stiffness against the pressure's turn grows with a payload
    assert row().bent(np.array([10e3]), 0.0, 1e-4)[0, 0] < row().bent(np.array([10e3]))[0, 0]


def test_a_model_file_comes_back_and_wrong_ones_are_refused():
    model = row(gain=1.1, offset="2 deg")
    again = read_model({"model": model.table()})
    p = np.linspace(0.0, 12e3, 200)[:, None]
    drive = Drive(np.arange(200.0), p)
    assert again.simulate(drive) == pytest.approx(model.simulate(drive))
    assert model.simulate(drive)[:, 0] == pytest.approx(model.bent(p[:, 0])[:, 0], rel=1e-5)
    for wrong, words in (
        ({"count": 0}, "1 to 1000"),
        ({"law": {"pressure": ["0 kPa"], "turn": ["0 deg"], "stretch": [0.0]}}, "two rows"),
        ({"gravity": 1}, "true or false"),
        ({"colour": 1}, "no such key"),
    ):
        with pytest.raises(InputError, match=words):
            row(**wrong)
