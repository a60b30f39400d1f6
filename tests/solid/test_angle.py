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
    c, s = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
    tilt = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    turn = tilt @ about_y(degrees) @ tilt.T
    first = np.degrees(angle(space.points @ turn.T - space.points))
    assert abs(first) == pytest.approx(7.0, abs=1e-8)
    for k in range(2, 40):
        turn = tilt @ about_y(k * degrees) @ tilt.T
        assert np.degrees(angle(space.points @ turn.T - space.points)) == pytest.approx(k * first, abs=1e-7)


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
