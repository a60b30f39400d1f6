"""Walls that pass through one another are seen; walls that do not are left in peace."""

from dataclasses import replace

import numpy as np
import pytest

from fem_spa.solid.obstacles import Plane
from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, Problem, StepControl
from fem_spa.solid.space import build_space
from fem_spa.solid.walls import Walls, WallWatch
from geometry.tagged import TaggedMesh

MM = 1e-3
GAP = 1 * MM


@pytest.fixture(scope="module")
def fork(verification):
    """Two arms of 4 mm, 1 mm apart, on a common back; the lower one holds a void close to the gap."""
    v = verification
    grid = [
        MM * np.array([0.0, 3, 8, 13, 16]),
        MM * np.array([0.0, 3, 8, 11]),
        MM * np.array([0.0, 1, 3, 4, 5, 7, 9]),
    ]
    mesh = v.box(
        grid,
        voids={
            "main": (MM * np.array([3.0, 3, 1]), MM * np.array([13.0, 8, 3])),
            "slot": (MM * np.array([3.0, 0, 4]), MM * np.array([16.0, 11, 5])),
        },
        names={"x0": "base"},
    )
    surfaces = dict(mesh.surfaces)
    del surfaces["cavity slot"]
    return replace(mesh, surfaces=surfaces)


@pytest.fixture(scope="module")
def fork_problem(verification, fork):
    def problem(pressure):
        return Problem(fork, {"body": verification.material("yeoh")}, Loads([{"main": pressure}]))

    return problem


def gap(space, displacement):
    """Least distance along z between nodes that face one another across the slot (they slide little)."""
    slot = space.points[:, 0] > 3.1 * MM
    sides = []
    for level in (4 * MM, 5 * MM):
        nodes = np.flatnonzero(slot & (np.abs(space.points[:, 2] - level) < 1e-9))
        key = np.round(space.points[nodes, :2] / MM, 6)
        sides.append(nodes[np.lexsort(key.T)])
    lower, upper = sides
    return float(np.min((space.points + displacement)[upper, 2] - (space.points + displacement)[lower, 2]))


def test_clean_state_raises_no_alarm(fork, fork_problem):
    # catches neighbours, edges and touching corners of a sound mesh taken for a crossing
    space = build_space(fork)
    assert Walls(space, {}).cross(space.points) is None
    rng = np.random.default_rng(1)
    assert Walls(space, {}).cross(space.points + 0.05 * MM * rng.standard_normal(space.points.shape)) is None
    # turned, so that the volumes of coplanar pieces are rounding errors and not exact zeros
    c, s = np.cos(0.5), np.sin(0.5)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    assert Walls(space, {}).cross(space.points @ turn.T) is None
    result = solve(fork_problem(3e3))
    assert result.status == "done" and result.warnings == [] and result.touch_pressure is None


@pytest.mark.parametrize("closing", [0.99, 1.01])
def test_arms_pushed_onto_one_another(fork, closing):
    # catches a crossing missed or seen too soon, to a hundredth of the gap
    space = build_space(fork)
    walls = WallWatch(space, {})
    X = space.points
    upper = (X[:, 2] > 4.5 * MM) & (X[:, 0] > 3.1 * MM)
    shift = np.zeros_like(X)
    # tilted, so that no face lies in another's plane
    shift[upper, 2] = -closing * GAP * (X[upper, 0] / X[:, 0].max()) ** 2
    shift[upper, 0] = 0.013 * MM
    shift[upper, 1] = 0.017 * MM
    place = walls.cross(X + shift)
    if closing < 1:
        assert place is None
    else:
        assert place is not None
        assert place[0] > 10 * MM and abs(place[2] - 4 * MM) < 1 * MM
        far = shift.copy()
        far[upper, 2] *= 3
        assert 1 / 3 * 0.98 < walls.first_crossing(X, X + far) < 1 / 3 * 1.05


def test_walls_that_meet_between_their_nodes(fork):
    # a touch that is late because chords lie behind the curved wall: here its crown is between two nodes
    space = build_space(fork)
    X = space.points
    upper = (X[:, 2] > 4.5 * MM) & (X[:, 0] > 3.1 * MM)
    crown, before_nodes = 9.25 * MM, 0.3
    shift = np.zeros_like(X)
    shift[upper, 2] = GAP * (before_nodes * ((X[upper, 0] - crown) / (1.25 * MM)) ** 2 - 1.2)
    shift[upper, 1] = 0.017 * MM
    assert Walls(space, {}).cross(X + shift) is None
    watch = WallWatch(space, {})
    assert watch.cross(X + 0.82 * shift) is None
    place = watch.cross(X + shift)
    assert place is not None and abs(place[0] - crown) < 1.5 * MM and abs(place[2] - 4 * MM) < 0.5 * MM
    assert 1 / 1.2 < watch.first_crossing(X, X + shift) < 1.05 / 1.2


def test_symmetry_plane_is_a_wall(half_finger):
    # catches a half body that passes through its own mirror image
    space = build_space(half_finger)
    walls = WallWatch(space, {"symmetry": "y"})
    assert walls.cross(space.points) is None
    moved = space.points.copy()
    node = int(np.argmin(np.linalg.norm(moved - MM * np.array([6.0, 4.0, 6.0]), axis=1)))
    moved[node, 1] = -0.1 * MM
    place = walls.cross(moved)
    assert place is not None and np.linalg.norm(place - moved[node]) < 1e-9


def test_touching_pressure_lies_between_the_right_steps(fork, fork_problem):
    # catches a touch reported late, early, or for the wrong step
    from fem_spa.solid.observe import KeepStates

    keep = KeepStates()
    result = solve(fork_problem(6e4), StepControl(imposed_steps=20), [keep])
    assert result.status == "done", result.message
    assert len(result.warnings) == 1
    assert "kPa" in result.warnings[0] and "touch" in result.warnings[0]
    space = build_space(fork)
    walls = WallWatch(space, {})
    crossed = [walls.cross(space.points + s.displacement) is not None for s in keep.states]
    first = crossed.index(True)
    assert first > 1 and all(crossed[first:])
    touch = result.touch_pressure["main"]
    assert result.rows[first - 1].pressure["main"] < touch <= result.rows[first].pressure["main"]
    finer = solve(fork_problem(6e4), StepControl(imposed_steps=80))
    assert finer.touch_pressure["main"] == pytest.approx(touch, rel=0.02)
    # an independent look: the gap's nodes come close just there
    gaps = [gap(space, s.displacement) for s in keep.states]
    assert gaps[0] == pytest.approx(GAP, rel=1e-9)
    assert 0 < gaps[first - 1] < 0.2 * GAP
    assert gaps[first] < 0.05 * GAP


def test_an_obstacle_touched_before_walls_cross_stays_the_first_touch(fork_problem):
    # catches a first touch of the obstacle that is forgotten where walls cross later
    below = (Plane((0, 0, -0.05 * MM), (0, 0, 1)),)
    result = solve(replace(fork_problem(6e4), obstacles=below), StepControl(imposed_steps=20))
    crossing = [text for text in result.warnings if "Contact is not modelled" in text]
    assert len(crossing) == 1
    crossed = 1e3 * float(crossing[0].split(" kPa")[0].split()[-1])
    assert result.touch_pressure["main"] < 0.5 * crossed
    touched = [row for row in result.rows if row.pressure["main"] >= result.touch_pressure["main"]]
    assert np.linalg.norm(touched[0].obstacle_force) > 0


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("depth", [-0.2, 0.5])
def test_a_spike_through_the_middle_of_a_face(turned, depth):
    # catches a look at the edges of only one of two triangles, whichever comes first
    face = np.array([[-5.0, -10, -10], [5, 10, -10], [0, 0, 10], [9, -4, 0]])
    middle = face[:3].mean(axis=0)
    spike = middle + np.array([[depth, 0, 0], [-30, 1, 0], [-30, -1, 1], [-30, -1, -1]])
    points = 1e-3 * np.vstack([face, spike])
    if turned:
        points[:, 0] *= -1
    tets = np.array([[0, 1, 2, 3], [4, 5, 6, 7]])
    for t in tets:
        if np.linalg.det(points[t[1:]] - points[t[0]]) < 0:
            t[:2] = t[1::-1]
    space = build_space(TaggedMesh(points, tets, {"body": np.arange(2)}, {}))
    place = Walls(space, {}).cross(space.points)
    assert (place is not None) == (depth > 0)
