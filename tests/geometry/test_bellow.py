"""Bellow against the volume of a wall of constant thickness (Pappus)."""

import math

import numpy as np
import pytest

import geometry
from geometry import GeometryError

Bellow = geometry.SHAPES["bellow"]


def solid(s):
    """Volume of the whole bellow without its layer, m^3: the two arcs of a flank balance about its middle."""
    wave = 2 * math.pi * s.wall * (s.peak + s.valley) / 2 * 2 * s.arc_radius * s.turn * s.convolutions
    straight = 2 * math.pi * s.wall
    collar = straight * s.peak * (s.collar_height - s.floor)
    neck = straight * s.neck_radius * (s.neck_height - s.top)
    plate = lambda radius, thick: math.pi * (radius + s.wall / 2) ** 2 * thick  # noqa: E731
    return wave + collar + neck + plate(s.peak, s.floor) + plate(s.neck_radius, s.top)


def air(s):
    """Volume of the air, m^3: the inner profile, point by point."""
    t = np.linspace(0, s.turn, 2001)
    inside = s.wall / 2
    r = np.concatenate(
        [
            s.peak - s.arc_radius + (s.arc_radius - inside) * np.cos(t),
            (s.valley + s.arc_radius - (s.arc_radius + inside) * np.cos(t))[::-1],
        ]
    )
    z = np.concatenate(
        [(s.arc_radius - inside) * np.sin(t), (s.flank - (s.arc_radius + inside) * np.sin(t))[::-1]]
    )
    flank = np.trapezoid(math.pi * r**2, z)
    ends = math.pi * (s.peak - inside) ** 2 * (s.collar_height - s.floor)
    return s.convolutions * flank + ends + math.pi * (s.neck_radius - inside) ** 2 * (s.neck_height - s.top)


def test_printed_sizes():
    shape = Bellow()
    assert shape.bellow_height == pytest.approx(35e-3) and shape.total_height == pytest.approx(36e-3)
    assert 2 * shape.peak + shape.wall == pytest.approx(
        10e-3
    ) and 2 * shape.valley - shape.wall == pytest.approx(5e-3)
    mesh = shape.mesh()
    assert set(mesh.surfaces) == set(shape.surface_names())
    assert np.ptp(mesh.points, axis=0) == pytest.approx([15e-3, 15e-3, 36e-3])
    assert geometry.body_volume(mesh, "body") == pytest.approx(solid(shape) / 4, rel=2e-3)
    assert geometry.cavity_volume(mesh, "main") == pytest.approx(air(shape) / 4, rel=2e-3)
    assert geometry.body_volume(mesh, "soft layer") == pytest.approx(30 * 30 * 1e-9 / 4, rel=1e-6)
    assert geometry.area(mesh, "frame") == pytest.approx(2 * 15e-6)
    assert geometry.area(mesh, "tip") == pytest.approx(math.pi * 25e-6 / 4, rel=1e-3)


@pytest.mark.parametrize("share", [1, 2, 4])
@pytest.mark.parametrize("convolutions", [1, 2])
def test_shares_and_odd_numbers(share, convolutions):
    shape = Bellow(
        share=share,
        convolutions=convolutions,
        convoluted_height=2e-3 * convolutions,
        neck_height=3e-3,
        soft_layer=False,
    )
    mesh = shape.mesh(2e-3)
    assert geometry.body_volume(mesh) == pytest.approx(solid(shape) / share, rel=3e-3)
    assert geometry.cavity_volume(mesh, "main") == pytest.approx(air(shape) / share, rel=3e-3)
    assert "frame" not in mesh.surfaces and "soft layer" not in mesh.volumes


def test_whole_with_layer_has_a_frame_all_round():
    mesh = Bellow(share=1, convolutions=2, convoluted_height=4e-3, neck_height=3e-3).mesh(3e-3)
    assert geometry.area(mesh, "frame") == pytest.approx(4 * 30e-6)
    assert geometry.area(mesh, "tip") == pytest.approx(math.pi * 25e-6, rel=2e-3)


@pytest.mark.parametrize(
    ("sizes", "words"),
    [
        ({"inner_diameter": 9e-3}, "no room is left for convolutions"),
        ({"convolutions": 30}, "lean over"),
        ({"convolutions": 18, "inner_diameter": 7e-3}, "close on its inner side"),
        ({"floor": 6e-3}, "collar_height"),
        ({"top": 15e-3}, "neck_height"),
        ({"layer_width": 9e-3}, "layer_width"),
        ({"share": 8}, "share"),
        ({"wall": 0.0}, "wall = 0 mm"),
    ],
)
def test_refusals(sizes, words):
    with pytest.raises(GeometryError, match=words):
        Bellow(**sizes).validate()


def test_half_a_bellow_may_use_a_layer_narrower_than_before_only_to_its_neck():
    Bellow(convolutions=1, convoluted_height=3e-3, layer_width=9e-3).validate()
