"""PneuNet: its volumes and areas against closed forms, its groups, and what it refuses."""

import math

import numpy as np
import pytest

import geometry
from geometry import GeometryError
from geometry.measures import area_vectors, symmetry_origin

PneuNet = geometry.SHAPES["pneunet"]
MM = 1e-3


def arch(width, wall, radius):
    """Section of straight walls of a height under a circular arc of a radius, any unit squared."""
    half = width / 2
    segment = radius**2 * math.asin(min(1.0, half / radius)) - half * math.sqrt(max(0.0, radius**2 - half**2))
    return width * wall + segment


SLOW_OUTER = arch(20, 14, 10)
FAST_OUTER = arch(20, 14, 10)
SLOW_INNER = arch(18, 10, 9)
FAST_INNER = arch(16, 10, 8)
CHANNEL = 3 * 2

SLOW_AIR = 9 * 7 * SLOW_INNER + 8 * 2 * CHANNEL
FAST_AIR = 6 * 3 * FAST_INNER + 5 * 4 * CHANNEL  # a channel runs through the gap and two lateral walls
SLOW_SOLID = 83 * SLOW_OUTER - SLOW_AIR
FAST_SOLID = 30 * FAST_OUTER + 10 * 20 * 7 - FAST_AIR
JOINT = 5 * 20 * 7


@pytest.fixture(scope="module")
def finger():
    return PneuNet().mesh()


def test_composite_finger_has_the_volumes_of_table_1(finger):
    whole = SLOW_SOLID + FAST_SOLID + JOINT
    assert geometry.body_volume(finger) * 1e9 == pytest.approx(whole / 2, rel=2e-4)
    assert geometry.cavity_volume(finger, "slow") * 1e9 == pytest.approx(SLOW_AIR / 2, rel=2e-4)
    assert geometry.cavity_volume(finger, "fast") * 1e9 == pytest.approx(FAST_AIR / 2, rel=2e-4)
    assert np.ptp(finger.points, axis=0) * 1e3 == pytest.approx([128, 10, 24], abs=1e-6)


def test_composite_finger_has_its_groups_where_they_belong(finger):
    assert set(finger.surfaces) == set(PneuNet().surface_names())
    assert finger.cavities == ("fast", "slow") and finger.layers == ("paper",)
    assert geometry.area(finger, "layer paper") * 1e6 == pytest.approx(128 * 10, rel=1e-9)
    assert geometry.area(finger, "base") * 1e6 == pytest.approx(SLOW_OUTER / 2, rel=1e-3)
    assert geometry.area(finger, "tip") * 1e6 == pytest.approx(FAST_OUTER / 2, rel=1e-3)
    for name, axis, at in (("base", 0, 0), ("tip", 0, 0.128), ("symmetry", 1, 0), ("layer paper", 2, 2e-3)):
        assert np.allclose(finger.points[finger.surfaces[name]][..., axis], at, atol=1e-9), name
    for name, normal in (("base", [-1, 0, 0]), ("tip", [1, 0, 0]), ("symmetry", [0, -1, 0])):
        total = area_vectors(finger.points, finger.surfaces[name]).sum(axis=0)
        assert total / np.linalg.norm(total) == pytest.approx(normal, abs=1e-9), name


def test_faces_of_the_whole_boundary_are_named_once(finger):
    from geometry.topology import boundary, corner_keys

    named = np.concatenate([f for n, f in finger.surfaces.items() if not n.startswith("layer ")])
    count = len(finger.points)
    assert np.array_equal(np.sort(corner_keys(named, count)), np.sort(corner_keys(boundary(finger), count)))


def test_round_walls_are_curved(finger):
    faces = finger.surfaces["cavity slow"]
    normals = area_vectors(finger.points, faces)
    x = finger.points[faces]
    top = (np.abs(normals[:, 0]) < 0.1 * np.linalg.norm(normals, axis=1)) & (x[:, :3, 2] > 13.999 * MM).all(
        axis=1
    )
    assert top.sum() > 300
    assert np.abs(np.hypot(x[top][..., 1], x[top][..., 2] - 14 * MM) - 9 * MM).max() < 1e-8


@pytest.mark.parametrize(
    ("sizes", "solid", "air", "length"),
    [
        ({"fast_chambers": 0}, SLOW_SOLID, {"slow": SLOW_AIR}, 83),
        ({"slow_chambers": 0}, FAST_SOLID, {"fast": FAST_AIR}, 40),
    ],
)
def test_single_modules(sizes, solid, air, length):
    mesh = PneuNet(**sizes).mesh(4e-3)
    assert geometry.body_volume(mesh) * 1e9 == pytest.approx(solid / 2, rel=5e-4)
    assert mesh.cavities == tuple(air)
    for name, volume in air.items():
        assert geometry.cavity_volume(mesh, name) * 1e9 == pytest.approx(volume / 2, rel=5e-4)
    assert np.ptp(mesh.points[:, 0]) * 1e3 == pytest.approx(length)


def test_half_is_half_of_whole():
    sizes = {"slow_chambers": 2, "fast_chambers": 2}
    half = PneuNet(**sizes).mesh(4e-3)
    whole = PneuNet(**sizes, half=False).mesh(4e-3)
    assert "symmetry" in half.surfaces and "symmetry" not in whole.surfaces
    assert 2 * geometry.body_volume(half) == pytest.approx(geometry.body_volume(whole), rel=5e-4)
    for name in ("slow", "fast"):
        assert 2 * geometry.cavity_volume(half, name) == pytest.approx(
            geometry.cavity_volume(whole, name), rel=5e-4
        )
        assert 2 * geometry.area(half, f"cavity {name}") == pytest.approx(
            geometry.area(whole, f"cavity {name}"), rel=5e-4
        )
    assert np.abs(area_vectors(whole.points, whole.surfaces["cavity fast"]).sum(axis=0)).max() < 1e-15
    assert np.abs(area_vectors(half.points, half.surfaces["cavity fast"]).sum(axis=0)[[0, 2]]).max() < 1e-15
    assert symmetry_origin(half)[1] == pytest.approx(0, abs=1e-12)


def test_same_input_same_mesh_and_nothing_printed(capfd):
    shape = PneuNet(slow_chambers=1, fast_chambers=2)
    first, second = shape.mesh(4e-3), shape.mesh(4e-3)
    assert first.hash() == second.hash()
    assert capfd.readouterr() == ("", "")


def test_straight_elements_are_what_order_1_gives():
    mesh = PneuNet(slow_chambers=0, fast_chambers=1).mesh(3e-3, order=1)
    assert mesh.tets.shape[1] == 4 and mesh.surfaces["outer"].shape[1] == 3
    solid = (5 * FAST_OUTER - 3 * FAST_INNER) / 2
    assert (
        geometry.body_volume(mesh) * 1e9 < solid
    )  # chords lie inside the outer arc, by more than inside the inner
    assert geometry.body_volume(mesh) * 1e9 == pytest.approx(solid, rel=0.03)


def test_arches_need_not_be_semicircles():
    flat = {"fast_inner_radius": 10e-3, "fast_outer_radius": 12e-3, "slow_chambers": 0, "fast_chambers": 1}
    mesh = PneuNet(**flat).mesh(2e-3)
    air = 3 * arch(16, 10, 10)
    assert geometry.cavity_volume(mesh, "fast") * 1e9 == pytest.approx(air / 2, rel=1e-4)
    inner_crown = 14 + 10 - 6
    wall = inner_crown + 2 - (12 - math.sqrt(12**2 - 10**2))
    assert geometry.area(mesh, "base") * 1e6 == pytest.approx(arch(20, wall, 12) / 2, rel=1e-4)


@pytest.mark.parametrize(
    ("sizes", "words"),
    [
        ({"lateral_wall": 0.0}, "lateral_wall = 0 mm"),
        ({"lateral_wall": -1e-3}, "positive length"),
        ({"lateral_wall": float("nan")}, "finite"),
        ({"lateral_wall": 1.0}, "millimetres given"),
        ({"lateral_wall": 2.5e-3}, "no room is left for air"),
        ({"slow_inner_width": 20e-3, "slow_inner_radius": 10e-3}, "side wall"),
        ({"fast_inner_radius": 7e-3}, "arch would not span"),
        ({"slow_inner_radius": 30e-3}, "arches cut each other"),
        ({"channel_width": 17e-3}, "wider than the chamber"),
        ({"channel_height": 3e-3}, "open to the gap"),
        ({"channel_height": 11e-3, "fast_chambers": 0}, "higher than the chamber"),
        ({"slow_inner_wall": 9e-3}, "slow_inner_wall"),
        ({"bridge": 12e-3}, "gap between the chambers"),
        ({"joint_height": 12e-3}, "joint_height"),
        ({"slow_chambers": -1}, "slow_chambers = -1"),
        ({"slow_chambers": 2.5}, "whole number"),
        ({"slow_chambers": True}, "a number"),
        ({"fast_chambers": 100000}, "fast_chambers = 100000"),
        ({"slow_chambers": 0, "fast_chambers": 0}, "at least one chamber"),
        ({"slow_chambers": 60, "slow_pitch": 0.2}, "largest dimension"),
        ({"gap": "2 mm"}, "a number"),
        ({"half": 1}, "true or false"),
    ],
)
def test_refused_before_gmsh_is_asked(sizes, words, monkeypatch):
    def no_gmsh(*_):
        raise AssertionError("gmsh was asked")

    monkeypatch.setattr(PneuNet, "_draw", no_gmsh)
    with pytest.raises(GeometryError, match=words) as caught:
        PneuNet(**sizes).mesh()
    assert "\n" not in str(caught.value) and "allowed" in str(caught.value)


@pytest.mark.parametrize(
    ("size", "order", "words"),
    [
        (0.0, 2, "at least 0.01 mm"),
        (-1e-3, 2, "at least"),
        (float("nan"), 2, "finite"),
        (3.0, 2, "at most the body's largest"),
        (3e-6, 2, "m said to be mm"),
        (2e-5, 2, "elements"),
        (3e-3, 3, "order = 3"),
        ("3 mm", 2, "finite length"),
    ],
)
def test_refused_element_sizes(size, order, words):
    with pytest.raises(GeometryError, match=words):
        PneuNet(slow_chambers=0).mesh(size, order)
