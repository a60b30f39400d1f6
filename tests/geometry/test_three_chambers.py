"""Tripod and arm segment: volumes by hand, directions of the chambers, half and whole."""

import math

import numpy as np
import pytest

import geometry
from geometry import GeometryError

Tripod, Arm = geometry.SHAPES["tripod"], geometry.SHAPES["arm-segment"]


def tripod_volumes(s):
    """Air of one channel and solid of the whole, m^3."""
    sector = lambda wide, inner, outer: wide / 2 * (outer**2 - inner**2)  # noqa: E731
    run = s.chambers * s.chamber_length + (s.chambers - 1) * s.gap
    air = sector(s.duct_angle, s.duct_inner_radius, s.duct_outer_radius) * (run - 2 * s.lateral_wall)
    chamber = sector(s.air_angle, s.duct_outer_radius, s.outer_radius - s.outer_wall)
    air += s.chambers * chamber * (s.chamber_length - 2 * s.lateral_wall)
    solid = math.pi * s.outer_radius**2 * (s.base_plate + s.tip_plate) + math.pi * s.support_radius**2 * run
    solid += 3 * s.chambers * sector(s.channel_angle, s.support_radius, s.outer_radius) * s.chamber_length
    return air, solid - 3 * air


def arm_volumes(s):
    """Air of one chamber and solid of the whole, m^3."""
    r_o, r_i = s.chamber_outer_radius, s.chamber_inner_radius
    ring = math.pi * (s.radius**2 - s.ring_bore**2) - 3 * math.pi * r_o**2
    solid = math.pi * s.radius**2 * (s.base_plate + s.tip_plate)
    solid += 3 * math.pi * (r_o**2 - r_i**2) * s.chamber_length + s.rings * s.ring_thickness * ring
    return math.pi * r_i**2 * s.chamber_length, solid


CASES = [
    (Tripod, {"chambers": 2}, tripod_volumes, 4e-3),
    (Arm, {"rings": 1, "chamber_length": 40e-3}, arm_volumes, 6e-3),
]


@pytest.mark.parametrize(("kind", "sizes", "volumes", "size"), CASES)
@pytest.mark.parametrize("half", [True, False])
def test_volumes_half_and_whole(kind, sizes, volumes, size, half):
    shape = kind(**sizes, half=half)
    mesh = shape.mesh(size)
    assert set(mesh.surfaces) == set(shape.surface_names())
    air, solid = volumes(shape)
    assert geometry.body_volume(mesh) == pytest.approx(solid * (0.5 if half else 1), rel=2e-3)
    for name in mesh.cavities:
        part = 0.5 if half and name == "1" else 1
        assert geometry.cavity_volume(mesh, name) == pytest.approx(air * part, rel=3e-3), name
    assert mesh.points[:, 2].max() == pytest.approx(0, abs=1e-9)
    assert mesh.points[:, 2].min() == pytest.approx(-shape.total_length)
    assert np.allclose(mesh.points[mesh.surfaces["base"]][..., 2], 0, atol=1e-9)
    if half:
        assert mesh.points[:, 0].min() > -1e-9


@pytest.mark.parametrize(("kind", "sizes", "volumes", "size"), CASES)
def test_chambers_lie_where_the_contract_has_them(kind, sizes, volumes, size):
    mesh = kind(**sizes).mesh(size)
    for name, direction in {"1": 90, "2": -30, "3": 210}.items():
        x, y, _ = mesh.points[np.unique(mesh.surfaces[f"cavity {name}"])].mean(axis=0)
        assert math.degrees(math.atan2(y, x)) % 360 == pytest.approx(direction % 360, abs=1.5), name


def test_lengths_of_the_papers():
    assert Tripod().total_length == pytest.approx(135e-3)
    assert Arm().total_length == pytest.approx(190e-3)
    assert Arm(rings=0).chamber_outer_radius - Arm().chamber_inner_radius == pytest.approx(1.4e-3)


def test_arm_without_rings():
    shape = Arm(rings=0, chamber_length=40e-3)
    assert geometry.body_volume(shape.mesh(8e-3)) == pytest.approx(arm_volumes(shape)[1], rel=5e-3)


@pytest.mark.parametrize(
    ("kind", "sizes", "words"),
    [
        (Tripod, {"duct_outer_radius": 10e-3}, "duct_outer_radius"),
        (Tripod, {"outer_wall": 10e-3}, "outside the support"),
        (Tripod, {"lateral_wall": 4e-3}, "no room is left"),
        (Tripod, {"side_wall_angle": 0.69, "slot_angle": 0.7}, "so that air is left"),
        (Tripod, {"duct_angle": 1.7}, "wider than the chamber"),
        (Arm, {"chamber_inner_radius": 8e-3}, "radii swapped"),
        (Arm, {"chamber_offset": 9e-3}, "do not meet"),
        (Arm, {"radius": 25e-3}, "stick out"),
        (Arm, {"ring_bore": 13e-3}, "bore would cut"),
        (Arm, {"rings": 60, "ring_thickness": 3e-3}, "no free tube"),
    ],
)
def test_refusals(kind, sizes, words):
    with pytest.raises(GeometryError, match=words):
        kind(**sizes).validate()
