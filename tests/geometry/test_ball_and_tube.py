"""Ball and tube against closed forms."""

import math

import numpy as np
import pytest

import geometry
from geometry import GeometryError
from geometry.measures import area_vectors

Ball = geometry.SHAPES["ball"]


@pytest.mark.parametrize("share", [1, 2, 4, 8])
def test_ball_volumes(share):
    shape = Ball(share=share)
    mesh = shape.mesh(4e-3)
    assert set(mesh.surfaces) == set(shape.surface_names())
    assert geometry.body_volume(mesh) == pytest.approx(4 / 3 * math.pi * (8e-6 - 1e-6) / share, rel=1e-3)
    assert geometry.body_volume(mesh) == pytest.approx(shape.solid_volume(), rel=1e-3)
    assert geometry.cavity_volume(mesh, "main") == pytest.approx(4 / 3 * math.pi * 1e-6 / share, rel=2e-3)
    assert geometry.cavity_volume(mesh, "main") == pytest.approx(shape.air_volume(), rel=2e-3)
    assert geometry.area(mesh, "outer") == pytest.approx(4 * math.pi * 4e-4 / share, rel=1e-3)


def test_eighth_lies_where_all_are_positive_with_planes_named_by_their_normal():
    mesh = Ball().mesh(4e-3)
    assert mesh.points.min() > -1e-12
    for axis, name in enumerate("xyz"):
        total = area_vectors(mesh.points, mesh.surfaces[f"symmetry {name}"]).sum(axis=0)
        expected = np.zeros(3)
        expected[axis] = -math.pi / 4 * (4e-4 - 1e-4)
        assert total == pytest.approx(expected, abs=1e-8)


def test_error_of_curved_walls_falls_with_the_fourth_power():
    exact = Ball().air_volume()
    errors = [abs(geometry.cavity_volume(Ball().mesh(h), "main") - exact) / exact for h in (4e-3, 2e-3, 1e-3)]
    assert errors[1] < errors[0] / 8 and errors[2] < errors[1] / 8


@pytest.mark.parametrize(
    ("sizes", "words"),
    [
        ({"share": 3}, "1, 2, 4 or 8"),
        ({"share": 16}, "share = 16"),
        ({"inner_radius": 30e-3}, "radii swapped"),
        ({"inner_radius": 19.9e-3}, "a hundredth"),
        ({"inner_radius": 0.0}, "inner_radius = 0 mm"),
    ],
)
def test_ball_refusals(sizes, words):
    with pytest.raises(GeometryError, match=words):
        Ball(**sizes).validate()


@pytest.mark.parametrize("share", [1, 2, 4])
def test_tube_volumes(share):
    shape = geometry.SHAPES["tube"](share=share)
    mesh = shape.mesh()
    assert set(mesh.surfaces) == set(shape.surface_names())
    air = math.pi * 25 * 52
    assert geometry.cavity_volume(mesh, "main") * 1e9 == pytest.approx(air / share, rel=2e-3)
    assert geometry.body_volume(mesh) * 1e9 == pytest.approx((math.pi * 64 * 60 - air) / share, rel=2e-3)
    assert geometry.area(mesh, "tip") * 1e6 == pytest.approx(math.pi * 64 / share, rel=2e-3)
    low = {1: (-8, -8), 2: (0, -8), 4: (0, 0)}[share]
    assert mesh.points[:, 1:].min(axis=0) * 1e3 == pytest.approx(low, abs=0.02)


@pytest.mark.parametrize(
    ("sizes", "words"),
    [
        ({"end_wall": 30e-3}, "no room is left"),
        ({"inner_radius": 9e-3}, "radii swapped"),
        ({"share": 3}, "1, 2 or 4"),
    ],
)
def test_tube_refusals(sizes, words):
    with pytest.raises(GeometryError, match=words):
        geometry.SHAPES["tube"](**sizes).validate()
