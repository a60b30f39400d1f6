"""Contact: tangent, closed forms, transmission, independence of its own numbers."""

from dataclasses import replace

import numpy as np
import pytest

from fem_spa.errors import InputError
from fem_spa.solid import pattern as patterns
from fem_spa.solid.closest_point import (
    CORNER,
    EDGE,
    INSIDE,
    closest,
    closest_of_kind,
    derivatives,
    shape,
)
from fem_spa.solid.contact import Contact
from fem_spa.solid.contact_kernel import opposite
from fem_spa.solid.contact_points import face_points, shape_at
from fem_spa.solid.fields import NodalFields
from fem_spa.solid.observe import KeepStates
from fem_spa.solid.obstacle_distance import distance
from fem_spa.solid.obstacles import Cylinder, Plane, Sphere
from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, Material, Problem, StepControl
from fem_spa.solid.space import build_space
from fem_spa.solid.walls import Walls
from geometry.tagged import TaggedMesh
from materials.registry import law

MM = 1e-3
GAP = 0.05 * MM


@pytest.fixture(scope="module")
def blocks(verification):
    """Two blocks, one above the other, of different meshes, walled in on all sides."""
    v = verification
    sides = {"x0": "left", "y0": "front", "x1": "right", "y1": "back"}
    low = v.box([v.even(0, 10 * MM, 4)] * 2 + [v.even(0, 5 * MM, 2)], names={"z0": "base", **sides})
    top = [v.even(0, 10 * MM, 5), v.even(0, 10 * MM, 3), v.even(5 * MM + GAP, 10 * MM, 2)]
    high = v.box(top, names={"z1": "tip", **sides})
    n, m = len(low.points), len(low.tets)
    surfaces = {s: np.vstack([low.surfaces[s], high.surfaces[s] + n]) for s in sides.values()}
    return TaggedMesh(
        points=np.vstack([low.points, high.points]),
        tets=np.vstack([low.tets, high.tets + n]),
        volumes={"body": np.concatenate([low.volumes["body"], high.volumes["body"] + m])},
        surfaces={**surfaces, "base": low.surfaces["base"], "tip": high.surfaces["tip"] + n},
    )


@pytest.mark.parametrize("watched", [False, True])
def test_tangent_is_the_derivative_of_the_force(blocks, watched):
    # any slip in the closest point's second derivative, the weights or the scatter
    space = build_space(blocks)
    contact = Contact(
        space, {}, (Sphere((5 * MM, 5 * MM, -8.01 * MM), 8 * MM),), True, 0.08 * MM, 1e4, 2 * MM
    )
    random = np.random.default_rng(4)
    x = space.points + 0.02 * MM * random.standard_normal(space.points.shape)
    x[:, 2] += 0.3 * MM * np.sin(400 * x[:, 0]) * np.cos(300 * x[:, 1])
    x[space.points[:, 2] > 5.01 * MM, 2] -= 0.1 * MM
    if watched:
        contact.add(np.flatnonzero(~contact.acts))
    touching = contact.evaluate(x)
    assert touching.highest > 1e4 and touching.inside > 0
    dofs = (3 * space.tets[:, :, None] + np.arange(3)).reshape(len(space.tets), -1)
    bare = patterns.build_pattern(dofs, np.zeros(3 * space.n_nodes, dtype=bool))
    pattern, _ = patterns.extend_pattern(bare, *contact.reach(x))
    contact.evaluate(x)
    data = np.zeros(pattern.nnz + 1)
    assert contact.add_tangent(x, pattern, data)
    for _ in range(3):
        u = random.standard_normal(x.shape)
        product = np.zeros(u.size)
        patterns.symmetric_product(pattern.indptr, pattern.indices, data[:-1], u.ravel(), product)
        h = 1e-9
        difference = (contact.evaluate(x + h * u).force - contact.evaluate(x - h * u).force) / (2 * h)
        assert np.linalg.norm(product - difference.ravel()) < 1e-5 * np.linalg.norm(product)


def test_forces_are_equal_and_opposite(blocks):
    # a reaction left out, or taken at another place than the force
    space = build_space(blocks)
    contact = Contact(space, {}, (), True, 0.08 * MM, 1e4, 2 * MM)
    x = space.points + np.where(space.points[:, 2:] > 5.01 * MM, [[0.0, 0.0, -0.2 * MM]], 0.0)
    x[:, 2] += 0.5 * x[:, 0] ** 2 / (20 * MM)
    force = contact.evaluate(x).force
    size = np.abs(force).sum()
    assert size > 1.0
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * size
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-10 * size * 10 * MM


def test_held_points_keep_their_faces(blocks):
    # Newton's way out of going to and fro: a face that changes all the same, or forces that no longer balance
    space = build_space(blocks)
    contact = Contact(space, {}, (), True, 0.08 * MM, 1e4, 2 * MM)
    upper = space.points[:, 2] > 5.01 * MM
    x = space.points.copy()
    x[upper, 2] -= 0.04 * MM
    contact.evaluate(x)
    before = contact._last.face.copy()
    x[upper, 0] += 0.06 * MM  # points near an edge of the face that they touch slide over it
    contact.hold = True
    held = contact.evaluate(x)
    touching = before >= 0
    assert touching.any() and np.all(contact._last.face[touching] == before[touching])
    assert np.abs(held.force.sum(axis=0)).max() < 1e-12 * np.abs(held.force).sum()
    contact.hold = False
    contact.evaluate(x)
    assert np.any(contact._last.face[touching] != before[touching])


def test_what_is_inside_between_the_points_acts_from_then_on(blocks):
    # a node in the wall opposite that no one sees, or that is seen and pushes nothing
    space = build_space(blocks)
    contact = Contact(space, {}, (Plane((0, 0, -0.1 * MM), (0, 0, 1)),), True, 0.02 * MM, 1e4, 2 * MM)
    inner = (np.abs(space.points[:, :2] - 5 * MM) < 4 * MM).all(axis=1)

    def pushed(node, way):
        x = space.points.copy()
        x[node, 2] += way
        return x

    for level, way, push in ((5 * MM, GAP + 0.004 * MM, 1), (0.0, -0.104 * MM, -1)):
        nodes = np.flatnonzero(inner & (np.abs(space.points[:, 2] - level) < 1e-9))
        unseen = [n for n in nodes if contact.evaluate(pushed(n, way)).inside == 0.0]
        assert unseen
        x = pushed(unseen[0], way)
        assert contact.close(x)
        seen = contact.evaluate(x)
        assert seen.inside == pytest.approx(0.004 * MM, rel=0.03) and not contact.close(x)
        assert push * seen.force[unseen[0], 2] > 0  # the energy's gradient: uphill is further in
    assert not contact.close(space.points)
    fresh = Contact(space, {}, (), True, 0.02 * MM, 1e4, 2 * MM)
    fresh.recall(contact.memory())
    assert np.array_equal(fresh.added, contact.added) and len(fresh.added) > 1


def test_a_point_does_not_meet_the_faces_it_lies_on():
    # two faces folded over a common edge: a gap of nothing at the fold, which no stiffness can open
    X = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0.1], [0.5, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0]])
    X = np.vstack([X, [[0, 0.5, 0.05], [0.5, 0.5, 0.05]]]).astype(float)
    faces = np.array([[0, 1, 2, 4, 5, 6], [0, 3, 1, 7, 8, 4]])
    points, *_ = face_points()
    acts = np.ones((2, len(points)), dtype=bool)
    found, _ = opposite(faces, np.zeros(2, dtype=np.int64), shape_at(points), acts, X, 0.2)
    on_fold = np.flatnonzero(np.abs(points[:, 1]) < 1e-12)
    inside = np.setdiff1d(np.arange(len(points)), on_fold)
    assert len(on_fold) == 11 and set(found[found < len(points)]) == set(inside)


def test_a_held_point_leaves_its_face_smoothly():
    # Newton's kink at an edge: a foot that stops there, or jumps
    X = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0.1], [0.5, 0.5, 0.1], [0, 0.5, 0.1]])
    N, dN, T, r = np.empty(6), np.empty((2, 6)), np.empty((2, 3)), np.empty(3)
    inside = np.array([0.01, 0.5, 0.2])
    kind, edge, s, t, _ = closest(inside, X, N, dN, T, r)
    assert kind == INSIDE
    for x in (inside, inside - [0.04, 0, 0]):
        held = closest_of_kind(kind, edge, s, t, x, X, N, dN, T, r)
        derivatives(held[2], held[3], dN)
        assert held[0] == INSIDE and np.abs(dN @ X @ r).max() < 1e-9
    assert held[2] < 0 and closest(x, X, N, dN, T, r)[0] == EDGE
    far = inside - [0.5, 0, 0]
    assert closest_of_kind(kind, edge, s, t, far, X, N, dN, T, r) == closest(far, X, N, dN, T, r)
    beside = np.array([0.96, -0.2, 0.1])
    kind, edge, s, t, _ = closest(beside, X, N, dN, T, r)
    beyond = beside + np.array([0.1, 0, 0])
    assert kind == EDGE and closest(beyond, X, N, dN, T, r)[0] == CORNER
    assert closest_of_kind(kind, edge, s, t, beyond, X, N, dN, T, r)[:2] == (EDGE, edge)


def test_chords_of_curved_walls_cross_where_walls_do_not(blocks):
    # an alarm for spoons that lie in one another, or none for walls that cross
    space = build_space(blocks)
    curved = space.points.copy()
    curved[:, 2] += 100 * (curved[:, 0] ** 2 + curved[:, 1] ** 2)
    into = curved.copy()
    into[space.points[:, 2] > 5.01 * MM, 2] -= 1.2 * GAP
    assert Walls(space, {}).cross(curved) is not None
    fine = Walls(space, {}, parts=6)
    assert fine.cross(curved) is None and fine.cross(space.points) is None
    assert fine.cross(into) is not None


def test_newton_notices_that_it_goes_to_and_fro():
    from fem_spa.solid.newton import _to_and_fro

    assert _to_and_fro([1e-1, 1.0e-5, 0.9e-5, 1.1e-5])
    assert not _to_and_fro([1e-5, 6e-6, 3e-6])  # falls
    assert not _to_and_fro([0.9, 0.8, 0.9]) and not _to_and_fro([1e-5, 1e-5])


def test_closest_point_of_a_curved_face():
    # a search that stops at the flat triangle, or loses an edge or a corner
    random = np.random.default_rng(1)
    X = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0.0]])
    X = X + 0.05 * random.standard_normal(X.shape)
    N, dN, T, r = np.empty(6), np.empty((2, 6)), np.empty((2, 3)), np.empty(3)
    s, t = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, 401), np.linspace(0, 1, 401)))
    s, t = s[s + t <= 1], t[s + t <= 1]
    values = np.empty((len(s), 6))
    for k in range(len(s)):
        shape(s[k], t[k], values[k])
    for x in random.uniform(-0.4, 1.2, (60, 3)) * [1, 1, 0.4]:
        *_, square = closest(x, X, N, dN, T, r)
        best = np.linalg.norm(x - values @ X, axis=1).min()
        assert square**0.5 == pytest.approx(best, abs=3e-3)


@pytest.mark.parametrize(
    "obstacle",
    [
        Plane((0.1, 0.2, 0.0), (1.0, 2.0, -0.5)),
        Sphere((0.1, -0.2, 0.3), 0.7),
        Sphere((0.1, -0.2, 0.3), (0.5, 0.8, 1.1)),
        Cylinder((0.2, 0.1, 0.0), (1.0, 1.0, 0.3), 0.4),
    ],
)
def test_distance_to_obstacles(obstacle):
    # a gradient that is not unit, or a curvature of the wrong sign or place
    x = np.random.default_rng(2).uniform(-1.5, 1.5, (40, 3))
    gap, normal, hessian = distance(obstacle, x)
    assert np.allclose(np.linalg.norm(normal, axis=1), 1.0)
    on_face = x - gap[:, None] * normal
    assert np.abs(distance(obstacle, on_face)[0]).max() < 1e-9
    outside = gap > 0.05
    h = 1e-6
    for i in range(3):
        step = np.zeros(3)
        step[i] = h
        up, down = distance(obstacle, x + step), distance(obstacle, x - step)
        assert np.allclose((up[0] - down[0])[outside] / (2 * h), normal[outside, i], atol=1e-7)
        assert np.allclose((up[1] - down[1])[outside] / (2 * h), hessian[outside, i], atol=1e-5)


def test_obstacle_inside_the_body_is_refused(blocks):
    space = build_space(blocks)
    with pytest.raises(InputError, match="inside the body"):
        Contact(space, {}, (Plane((0, 0, 1 * MM), (0, 0, 1)),), False, 0.02 * MM, 1e4, 2 * MM)


def test_blocks_transmit_uniform_pressure(blocks):
    # weights of one side only, or a reaction that is not consistent with the elements
    walls = {"left": "x", "right": "x", "front": "y", "back": "y", "base": "z"}
    rubber = Material(law("neo-hooke"), {"C10": 0.1e6}, bulk=1e6)
    loads = Loads([], tip_displacement=(0.0, 0.0, -0.3 * MM))
    problem = Problem(blocks, {"body": rubber}, loads, fixed=(), symmetry=walls, contact=True)
    space = build_space(blocks)
    keep = KeepStates()
    result = solve(problem, observers=[keep], space=space)
    assert result.status == "done", result.message
    assert 0 < result.rows[-1].gap < GAP
    stress = NodalFields(space, problem.materials)(keep.states[-1])["Cauchy stress"][:, 2]
    # closing the gap takes its part of the way; uniaxial strain does the rest
    assert stress.max() - stress.min() < 0.02 * abs(stress.mean())
    assert np.abs(stress / stress.mean() - 1).max() < 0.01


def test_parts_that_share_no_node_do_not_pass_through_one_another(blocks):
    # a step so long that one block would end behind the other
    walls = {"left": "x", "right": "x", "front": "y", "back": "y", "base": "z"}
    rubber = Material(law("neo-hooke"), {"C10": 0.1e6}, bulk=1e6)
    loads = Loads([], tip_displacement=(0.0, 0.0, -0.8 * MM))
    problem = Problem(blocks, {"body": rubber}, loads, fixed=(), symmetry=walls, contact=True)
    result = solve(problem)
    assert result.status == "done", result.message
    assert result.rows[-1].force > 1.0


@pytest.mark.slow
def test_hertz(verification):
    # the contact pressure's integration, and whether what acts on the obstacle is what the body bears
    v = verification
    R, a, depth, E = 20 * MM, 1 * MM, 30 * MM, 1e6
    across = a * np.array([0, 0.3, 0.6, 0.9, 1.2, 1.6, 2.4, 4, 8, 15, 30])
    up = a * np.array([0, 0.3, 0.7, 1.3, 2.4, 4.5, 9, 17, 30])
    mesh = v.box([across, across, up], names={"x0": "left", "y0": "front", "z1": "tip"})

    def round_below(X):
        square = np.minimum(X[:, 0] ** 2 + X[:, 1] ** 2, (0.5 * R) ** 2)
        return np.column_stack([X[:, :2], X[:, 2] + (R - np.sqrt(R**2 - square)) * (1 - X[:, 2] / depth)])

    mesh = v.moved(mesh, round_below)
    approach = a**2 / R
    problem = Problem(
        mesh,
        {"body": Material(law("neo-hooke"), {"C10": E / 6})},
        Loads([], tip_displacement=(0.0, 0.0, -approach)),
        fixed=(),
        symmetry={"left": "x", "front": "y"},
        obstacles=(Plane((0, 0, 0), (0, 0, 1)),),
    )
    row = solve(problem, StepControl(contact_distance=0.004)).rows[-1]
    force = -row.obstacle_force[0, 2]
    assert row.force == pytest.approx(force, rel=1e-6)
    # the pressed face is not at infinity: what a point force moves there (Boussinesq, incompressible)
    away = force * 3 / (2 * np.pi * E * depth)
    hertz = 4 / 3 * E / 0.75 * np.sqrt(R) * (approach + away) ** 1.5
    assert force == pytest.approx(hertz, rel=0.03)


@pytest.mark.slow
def test_curve_of_the_fast_module_with_contact(verification):
    # the trial's angles with another contact method; both numbers of the method halved
    v = verification
    if not v.evidence_mesh().exists():
        pytest.skip(f"{v.evidence_mesh()} is not here; FEM_SPA_SHARED names the folder that holds meshes/")
    from geometry.files import read_mesh

    mesh = read_mesh(v.evidence_mesh(), "mm")
    stiff = Material(law("neo-hooke"), {"C10": 2.2e6})
    problem = Problem(
        mesh,
        {"body": v.material("yeoh"), "stiff": stiff},
        Loads([{"main": 4e3}, {"main": 6.6e3}]),
        symmetry={"symmetry": "y"},
        contact=True,
    )
    space = build_space(mesh)
    walls = Walls(space, problem.symmetry)

    def angles(steps):
        keep = KeepStates()
        result = solve(problem, steps, observers=[keep], space=space)
        assert result.status == "done", result.message
        assert all(row.gap > 0 for row in result.rows)
        assert all(walls.cross(space.points + state.displacement) is None for state in keep.states)
        return result, np.degrees([row.angle for row in result.rows if row.is_point][1:])

    result, first = angles(StepControl())
    assert first == pytest.approx([20.2, 33.4], rel=0.015)
    assert 900 < result.touch_pressure["main"] < 1400
    _, halved = angles(replace(StepControl(), contact_distance=0.5 * StepControl().contact_distance))
    assert halved == pytest.approx(first, rel=0.005)
    _, small = angles(StepControl(imposed_steps=20))
    assert small == pytest.approx(first, rel=0.005)
