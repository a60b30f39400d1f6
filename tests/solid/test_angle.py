"""The bending angle: its sign, size, and how it goes on beyond half a turn."""

from dataclasses import replace

import numpy as np
import pytest

from fem_spa.solid.observables import Angle
from fem_spa.solid.problem import Loads
from fem_spa.solid.space import build_space


def about_y(degrees):
    """From +x towards -z, which is positive about +y."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


@pytest.mark.parametrize("kind", ["tip-face", "tangent", "chord"])
def test_rigid_turn_is_followed_beyond_180_degrees(finger_problem, half_finger, kind):
    # catches an angle that jumps by a turn, or of the wrong sign
    problem = replace(finger_problem(Loads([])), angle=kind)
    space = build_space(half_finger)
    angle = Angle(problem, space)
    for degrees in [*range(0, 421, 20), *range(400, -421, -20)]:
        # chord is measured from the base's centroid, so turn about it
        pivot = np.array([0.0, 0.0, 6e-3])
        displacement = (space.points - pivot) @ about_y(degrees).T + pivot - space.points
        assert np.degrees(angle(displacement)) == pytest.approx(degrees, abs=1e-8)


@pytest.mark.parametrize("degrees", [7.0, -7.0])
@pytest.mark.parametrize("tilt", [0.0, 28.6, 90.0])
def test_whole_body_finds_its_own_plane(finger_problem, half_finger, mirrored, tilt, degrees):
    # catches a plane of bending that is lost without a symmetry plane
    problem = finger_problem(Loads([]), mesh=mirrored(half_finger, "symmetry"), symmetry={})
    space = build_space(problem.mesh)
    angle = Angle(problem, space)
    assert angle(np.zeros_like(space.points)) == 0
    angle.begin_path(np.zeros_like(space.points))
    c, s = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
    tilt = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    turn = tilt @ about_y(degrees) @ tilt.T
    first = np.degrees(angle(space.points @ turn.T - space.points))
    assert abs(first) == pytest.approx(7.0, abs=1e-8)
    for k in range(2, 40):
        turn = tilt @ about_y(k * degrees) @ tilt.T
        assert np.degrees(angle(space.points @ turn.T - space.points)) == pytest.approx(k * first, abs=1e-7)


@pytest.mark.parametrize("kind", ["tip-face", "chord", "tangent"])
def test_every_kind_finds_the_plane_and_its_sign(finger_problem, half_finger, mirrored, kind):
    # catches a chord's axis taken from one vector by Kabsch, which leaves the spin about it open
    problem = finger_problem(Loads([]), mesh=mirrored(half_finger, "symmetry"), symmetry={})
    space = build_space(problem.mesh)
    angle = Angle(replace(problem, angle=kind), space)
    pivot = angle.base_weight @ space.points[angle.base_nodes]
    for degrees in (0.5, 3.0, 40.0):
        shift = (space.points - pivot) @ about_y(degrees).T + pivot - space.points
        assert np.degrees(angle(shift)) == pytest.approx(degrees, abs=1e-7)


def test_plane_is_that_of_the_load_path_not_of_gravity(finger_problem, half_finger, mirrored):
    # catches an axis that the sag under gravity, or its noise, has fixed for the whole run
    problem = finger_problem(Loads([]), mesh=mirrored(half_finger, "symmetry"), symmetry={})
    space = build_space(problem.mesh)
    angle = Angle(problem, space)
    c, s = np.cos(np.radians(3.0)), np.sin(np.radians(3.0))
    sag = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])  # sideways, about z
    dead = space.points @ sag.T - space.points
    assert abs(np.degrees(angle(dead))) == pytest.approx(3.0, abs=1e-7)
    angle.begin_path(dead)
    moved = space.points @ (about_y(30.0) @ sag).T - space.points
    assert np.degrees(angle(moved)) == pytest.approx(30.0, abs=0.1)


def test_angle_ignores_translation_swelling_and_what_is_not_the_tip(finger_problem, half_finger):
    # catches a measure that mixes stretch or shift into the angle
    problem = finger_problem(Loads([]))
    space = build_space(half_finger)
    angle = Angle(problem, space)
    place = 1.3 * space.points @ about_y(25).T + [0.01, 0.0, -0.02]
    moved = place - space.points
    other = np.setdiff1d(np.arange(space.n_nodes), np.unique(space.surfaces["tip"]))
    moved[other] = 0.5
    assert np.degrees(angle(moved)) == pytest.approx(25, abs=1e-9)


def test_faces_of_all_sizes_weigh_their_area(finger_problem, half_finger):
    # catches corner nodes that all weigh the same: a mesh finer on one side would turn the face
    problem = finger_problem(Loads([]))
    space = build_space(half_finger)
    tip = np.unique(space.surfaces["tip"][:, :3])
    angle = Angle(problem, space)
    corners = space.surfaces["tip"][:, :3]
    X = space.points[corners]
    area = 0.5 * np.linalg.norm(np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]), axis=1)
    weight = np.zeros(space.n_nodes)
    np.add.at(weight, corners, area[:, None] / 3)
    # only some nodes move: the fit is then a matter of weights
    moved = np.zeros_like(space.points)
    high = tip[space.points[tip, 2] > 8.9e-3]
    moved[high, 0] = 1e-3
    w = weight[tip] / weight.sum()
    rest = space.points[tip] - w @ space.points[tip]
    now = space.points[tip] + moved[tip]
    now = now - w @ now
    expected = np.arctan2(
        w @ (rest[:, 2] * now[:, 0] - rest[:, 0] * now[:, 2]),
        w @ (rest[:, 2] * now[:, 2] + rest[:, 0] * now[:, 0]),
    )
    assert angle(moved) == pytest.approx(expected, rel=1e-12)
