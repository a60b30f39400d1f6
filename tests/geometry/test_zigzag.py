"""Zig-zag actuator against areas worked out by hand."""

import math

import numpy as np
import pytest

import geometry
from geometry import GeometryError

Zigzag = geometry.SHAPES["zigzag"]


def sections(s):
    """Outer and inner area of the side view, m^2: slanted strips less the triangles they share.

    The outer joints are cut in their middle, where the ends begin: together they lose one triangle more.
    """
    p, h, b, n, w = s.pitch, s.height, s.chamber_width, s.chambers, s.wall
    high = h * b / (2 * p)
    outer = n * b * h - n * b * high / 2 + 2 * (s.end_wall + s.end_chamber) * high
    inner_b = b - 2 * w / math.cos(s.fold_angle / 2)
    depth = h * inner_b / (2 * p)
    shared = inner_b * depth / 2 * ((depth - w) / depth) ** 2
    return outer, n * inner_b * (h - 2 * w) - n * shared + 2 * s.end_chamber * (depth - w)


def test_printed_sizes():
    shape = Zigzag()
    assert shape.total_length == pytest.approx(134e-3, abs=1e-5)
    mesh = shape.mesh()
    assert np.ptp(mesh.points, axis=0) == pytest.approx([134e-3, 8e-3, 13e-3], abs=1e-5)
    outer, inner = sections(shape)
    assert geometry.cavity_volume(mesh, "main") == pytest.approx(inner * (16e-3 - 1.2e-3) / 2, rel=1e-9)
    solid = outer * 8e-3 - inner * 7.4e-3
    assert geometry.body_volume(mesh) == pytest.approx(solid, rel=1e-9)
    assert geometry.area(mesh, "base") == pytest.approx(
        8e-3 * 13e-3 * shape.chamber_width / (2 * shape.pitch)
    )


@pytest.mark.parametrize("chambers", [1, 2, 3, 4])
@pytest.mark.parametrize("half", [True, False])
def test_any_number_of_folds_half_and_whole(chambers, half):
    shape = Zigzag(chambers=chambers, half=half)
    mesh = shape.mesh(4e-3)
    assert set(mesh.surfaces) == set(shape.surface_names())
    outer, inner = sections(shape)
    part = 0.5 if half else 1.0
    assert geometry.cavity_volume(mesh, "main") == pytest.approx(part * inner * 14.8e-3, rel=1e-9)
    assert geometry.body_volume(mesh) == pytest.approx(part * (outer * 16e-3 - inner * 14.8e-3), rel=1e-9)


@pytest.mark.parametrize(
    ("word", "share"), [("1", 1.0), ("11", 1.0), ("10", 0.5), ("101", 2 / 3), ("01010", 0.4)]
)
def test_limiting_layer_whole_and_in_pieces(word, share):
    bare = Zigzag(chambers=4)
    shape = Zigzag(chambers=4, layer=1e-3, layer_pattern=word)
    extra = geometry.body_volume(shape.mesh(4e-3)) - geometry.body_volume(bare.mesh(4e-3))
    assert extra == pytest.approx(share * shape.total_length * 8e-3 * 1e-3, rel=1e-6)


def test_wall_is_as_thick_as_said():
    shape = Zigzag(chambers=2)
    (x0, z0), (x1, z1) = shape.outline(0.0)[1:3]
    inner = np.array(shape.outline(shape.wall))
    along = np.array([x1 - x0, z1 - z0]) / math.hypot(x1 - x0, z1 - z0)
    away = np.abs((inner - [x0, z0]) @ [-along[1], along[0]])
    assert away[1:3] == pytest.approx(shape.wall)


@pytest.mark.parametrize(
    ("sizes", "words"),
    [
        ({"wall": 0.0}, "wall = 0 mm"),
        ({"wall": 3e-3}, "cut off at the joints"),
        ({"chamber_width": 12e-3}, "folds would be closed"),
        ({"fold_angle": 45.0}, "10 deg to 90 deg"),
        ({"layer": 1e-3, "layer_pattern": "000"}, "at least one '1'"),
        ({"layer": 1e-3, "layer_pattern": "T2"}, "characters"),
        ({"layer": 1e-6}, "at least 0.02 mm"),
        ({"layer": -1e-3}, "layer = -1 mm"),
        ({"chambers": 0}, "chambers = 0"),
    ],
)
def test_refusals(sizes, words):
    with pytest.raises(GeometryError, match=words):
        Zigzag(**sizes).validate()
