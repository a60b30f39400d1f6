"""Gripper of three: the printed matrices, the printed points of egg and sphere, symmetry."""

from __future__ import annotations

import numpy as np
import pytest

from fem_spa.errors import InputError
from fem_spa.reduced.finger import finger
from fem_spa.reduced.gripper import EGG_BASE, EGG_GLOBAL, RADIUS, SPHERE_GLOBAL, frame, gripper


def test_matrices_are_the_printed_ones() -> None:
    """(29), (31), (33), written out."""
    yaw, roll = 0.3, 0.8
    c, s, ck, sk = np.cos(yaw), np.sin(yaw), np.cos(roll), np.sin(roll)
    first = [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    second = [[c, -s * ck, -s * sk], [s, c * ck, c * sk], [0, -sk, ck]]
    third = [[c, -s * ck, s * sk], [s, c * ck, -sk * c], [0, sk, ck]]
    for matrix, turned in ((first, 0.0), (second, -roll), (third, roll)):
        assert frame(yaw, turned, np.zeros(3))[:3, :3] == pytest.approx(np.array(matrix))


def test_printed_points() -> None:
    """The egg's point in finger 2's frame; the sphere's, which was not used for the radius, in its plane."""
    both = gripper(finger())
    assert both.to_base(np.array(EGG_GLOBAL), 2) == pytest.approx(EGG_BASE, abs=1e-4)
    sphere = both.to_base(np.array(SPHERE_GLOBAL), 2)
    assert sphere == pytest.approx([55e-3, RADIUS - 50e-3, 0.0], abs=1e-4)
    assert both.to_global(sphere, 2) == pytest.approx(SPHERE_GLOBAL)


def test_three_fingers_are_one_turned_about_the_axis() -> None:
    """They bend towards the axis, and their tips are 120 deg apart."""
    joints = gripper(finger()).joints(np.array([20e3, 10e3]))
    assert joints.shape == (3, 16, 4, 4)
    ends = joints[:, -1, :3, 3]
    flat = ends[:, [0, 2]]
    assert np.linalg.norm(flat, axis=1) == pytest.approx(np.full(3, np.linalg.norm(flat[0])))
    assert flat.sum(axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert np.linalg.norm(flat[0]) < RADIUS
    assert ends[:, 1] == pytest.approx(np.full(3, ends[0, 1]))


def test_reach_of_a_global_point_is_the_same_for_every_finger() -> None:
    all_three = gripper(finger())
    ends = all_three.joints(np.array([25e3, 15e3]))[:, -1, :3, 3]
    for k, end in enumerate(ends, 1):
        found = all_three.reach(end, k)
        assert found.reached and found.pressures == pytest.approx([25e3, 15e3], rel=1e-6)


def test_bad_input() -> None:
    with pytest.raises(InputError, match="fingers 1 to 3"):
        gripper(finger()).to_base(np.zeros(3), 4)
    with pytest.raises(InputError, match="radius"):
        gripper(finger(), radius=0.0)
