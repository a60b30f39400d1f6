"""The smallest gap that a run reports: in folds, of mirror images, between the points of the rule."""

from dataclasses import replace

import numpy as np
import pytest

from fem_spa.solid.contact import Contact
from fem_spa.solid.obstacles import Plane
from fem_spa.solid.space import build_space

MM = 1e-3
DISTANCE = 0.02 * MM
SIZE = 3 * MM
MIDDLES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))


def folded(mesh, opening):
    """(n, 3) m: the plate's nodes with its half x > 0 turned up about the edge x = z = 0, edges straight."""
    X = mesh.points
    angle = np.where(np.abs(X[:, 0]) < 1e-9, 0.5, X[:, 0] > 0) * (np.pi - opening)
    c, s = np.cos(angle), np.sin(angle)
    out = np.stack([c * X[:, 0] - s * X[:, 2], X[:, 1], s * X[:, 0] + c * X[:, 2]], axis=1)
    for k, (a, b) in enumerate(MIDDLES):
        out[mesh.tets[:, 4 + k]] = 0.5 * (out[mesh.tets[:, a]] + out[mesh.tets[:, b]])
    return out


def test_a_fold_that_closes(verification):
    # the sides of a fold share nodes at its edge: left out, walls touch there and no gap says so
    plate = verification.box([3 * MM * np.arange(-2.0, 3), 3 * MM * np.arange(3.0), MM * np.array([-1.0, 0])])
    space = build_space(replace(plate, points=folded(plate, np.radians(60))))
    contact = Contact(space, {}, (), True, DISTANCE, 1e4, SIZE)
    top = np.flatnonzero(np.abs(plate.points[contact.faces, 2]).max(axis=1) < 1e-9)
    points = np.flatnonzero(contact.acts & np.isin(np.arange(len(contact.faces)), top)[:, None])
    nearest = np.linalg.norm(contact._places(space.points, points)[:, ::2], axis=1).min()
    gaps, touching = [], []
    for opening in np.radians([60, 20, 10, 5, 4, 3, 2, 1]):
        x = folded(plate, opening)
        touching.append(contact.evaluate(x).highest > 0)
        contact.accept(x)
        gaps.append(contact.gap(x))
        if touching[-1]:
            assert gaps[-1] == pytest.approx(nearest * np.sin(opening), rel=1e-6)
            assert 0 < gaps[-1] < DISTANCE
        else:
            assert gaps[-1] > DISTANCE and nearest * np.sin(opening) > DISTANCE
    assert gaps[0] == np.inf and touching == sorted(touching) and 2 <= sum(touching) <= 5


def test_an_arm_over_its_mirror_image(verification):
    # a half body that touches its other half, and a gap that knows of the half alone; or the sides of a body
    # that passes through the plane, taken for walls that look at it
    v = verification
    grid = [MM * np.array([0.0, 3, 8, 13, 16]), MM * np.array([0.0, 4, 8]), MM * np.array([0.0, 1, 2, 3])]
    mesh = v.box(
        grid, voids={"slot": (MM * np.array([3.0, 0, 0]), MM * np.array([16.0, 8, 1]))}, names={"z0": "s"}
    )
    space = build_space(mesh)
    X = space.points
    contact = Contact(space, {"s": "z"}, (), True, DISTANCE, 1e4, SIZE)
    assert contact.gap(X) == pytest.approx(1 * MM, rel=1e-9)
    assert Contact(space, {"s": "z"}, (), True, DISTANCE, 1e4, 0.5 * SIZE).gap(X) == np.inf
    for left in (0.1 * MM, 0.9 * DISTANCE, 0.02 * DISTANCE):
        x = X.copy()
        arm = (X[:, 0] > 3.1 * MM) & (X[:, 2] > 0.9 * MM)
        x[arm, 2] -= (1 * MM - left) * ((X[arm, 0] - 3 * MM) / (13 * MM)) ** 2
        contact.close(x)
        contact.evaluate(x)
        contact.accept(x)
        assert contact.gap(x) == pytest.approx(left, rel=1e-6)


def test_an_edge_is_nearer_than_the_points_of_the_rule(verification):
    # an obstacle that a corner meets first, seen from the middle of the faces
    v = verification
    cube = v.box([verification.even(0, 6 * MM, 2)] * 3)
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    space = build_space(replace(cube, points=cube.points @ turn.T))
    lowest = space.points[:, 2].min()
    floor = Plane((0, 0, lowest - 0.3 * MM), (0, 0, 1))
    contact = Contact(space, {}, (floor,), False, DISTANCE, 1e4, SIZE)
    assert contact.gap(space.points) == pytest.approx(0.3 * MM, rel=1e-9)
