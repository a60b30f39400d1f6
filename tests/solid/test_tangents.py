"""Energy -> force -> tangent of everything that is in the equilibrium, against central differences."""

import math

import numpy as np
import pytest
from skfem import Basis, ElementTetP1, ElementTetP2, MeshTet2

from fem_spa.solid.cavity import Cavity
from fem_spa.solid.linear import make_solver
from fem_spa.solid.membrane import make_membrane
from fem_spa.solid.newton import Constraint, Factors
from fem_spa.solid.pattern import symmetric_product
from fem_spa.solid.problem import Layer, Loads, Problem
from fem_spa.solid.space import build_space
from fem_spa.solid.system import System
from materials.laws import LAWS

MM = 1e-3
GOOD = 1e-6
BULKS = {"compressible": 2e6, "incompressible": math.inf}


@pytest.fixture
def cube_system(verification, rough_cube):
    """law, bulk -> system of six curved tets, nothing held."""

    def system(name, bulk=math.inf):
        assert name in verification.SAMPLES, f"give a sample of law {name}, so that it is tested"
        mesh = rough_cube(3)
        problem = Problem(mesh, {"body": verification.material(name, bulk)}, Loads([]), fixed=())
        return System(problem, build_space(mesh))

    return system


def scikit_fem_energy(system, x):
    """J: integral of W + p (J - 1) - p^2 / 2K by scikit-fem's own bases; none of our kernel's code."""
    (material,) = system.region_materials
    space = system.space
    sk = MeshTet2(system.problem.mesh.points.T, system.problem.mesh.tets.T)
    second = Basis(sk, ElementTetP2(), intorder=5)
    first = Basis(sk, ElementTetP1(), intorder=5)
    # our node at each of scikit-fem's unknowns, by its place
    at = [int(np.argmin(np.linalg.norm(space.points - X, axis=1))) for X in second.doflocs.T]
    corner = [int(np.argmin(np.linalg.norm(space.points - X, axis=1))) for X in first.doflocs.T]
    u = system.displacement(x)[at]
    F = np.stack([second.interpolate(u[:, i]).grad for i in range(3)]) + np.eye(3)[:, :, None, None]
    p = np.asarray(first.interpolate(x[system.n_u :][corner]))
    J = np.linalg.det(np.moveaxis(F, (0, 1), (2, 3)))
    C = np.einsum("kiab,kjab->ijab", F, F)
    I1 = np.einsum("iiab->ab", C)
    I2 = 0.5 * (I1**2 - np.einsum("ijab,ijab->ab", C, C))
    W = material.law.energy(J ** (-2 / 3) * I1, J ** (-4 / 3) * I2, **material.parameters)
    return float(np.sum(second.dx * (W + p * (J - 1) - p**2 / (2 * material.bulk))))


@pytest.mark.parametrize("bulk", BULKS)
@pytest.mark.parametrize("name", sorted(LAWS))
def test_force_is_the_slope_of_the_energy(cube_system, random_state, name, bulk):
    # catches a wrong stress, sign of p or of the compressibility term, weight or quadrature
    system = cube_system(name, BULKS[bulk])
    x = random_state(system, 11)
    force = system.evaluate(x, np.zeros(0), 1.0).residual
    rng = np.random.default_rng(5)
    directions = rng.standard_normal((8, len(force)))
    # one direction among the displacements alone, one among the pressures alone
    directions[0, system.n_u :] = 0
    directions[1, : system.n_u] = 0
    exact = directions @ force
    best = np.full(len(exact), np.inf)
    for h in (1e-3, 1e-4, 1e-5):
        slope = [
            (
                scikit_fem_energy(system, x + h * d * system.scale)
                - scikit_fem_energy(system, x - h * d * system.scale)
            )
            / (2 * h * system.energy_unit)
            for d in directions
        ]
        best = np.minimum(best, np.abs(slope - exact) / np.abs(exact))
    assert np.max(best) < GOOD


@pytest.mark.parametrize("bulk", BULKS)
@pytest.mark.parametrize("name", sorted(LAWS))
def test_tangent_is_the_slope_of_the_force(cube_system, random_state, slopes, dense, closest, name, bulk):
    # catches a wrong modulus of any law: W11, W12, W22, the volumetric part, the coupling of u and p
    system = cube_system(name, BULKS[bulk])
    x = random_state(system, 12)
    K = dense(system.pattern, system.tangent(x, np.zeros(0))[: system.pattern.nnz])
    found = list(slopes(lambda y: system.evaluate(x + y * system.scale, np.zeros(0), 1.0).residual, len(K)))
    n = system.n_u
    # block by block: a small block must not hide behind a large one
    assert closest(K[:n, :n], [f[:n, :n] for f in found]) < GOOD
    assert closest(K[:n, n:], [f[:n, n:] for f in found]) < GOOD
    assert closest(K[n:, :n], [f[n:, :n] for f in found]) < GOOD
    if bulk == "compressible":
        assert closest(K[n:, n:], [f[n:, n:] for f in found]) < GOOD
    else:
        assert not np.any(K[n:, n:])
        assert max(np.max(np.abs(f[n:, n:])) for f in found) < 1e-9


@pytest.mark.parametrize("name", sorted(LAWS))
def test_forces_turn_with_the_body(cube_system, random_state, name):
    # catches strain measures that are not objective
    system = cube_system(name)
    x = random_state(system, 13)
    rng = np.random.default_rng(0)
    Q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    Q *= np.linalg.det(Q)
    force = system.evaluate(x, np.zeros(0), 1.0).residual[: system.n_u].reshape(-1, 3)
    turned = x.copy()
    place = system.space.points + system.displacement(x)
    turned[: system.n_u] = (place @ Q.T - system.space.points).ravel()
    other = system.evaluate(turned, np.zeros(0), 1.0).residual[: system.n_u].reshape(-1, 3)
    np.testing.assert_allclose(other, force @ Q.T, atol=1e-10 * np.abs(force).max())
    # at rest there is no stress, turned or not
    still = system.rest()
    assert np.max(np.abs(system.evaluate(still, np.zeros(0), 1.0).residual)) < 1e-10
    still[: system.n_u] = (system.space.points @ (Q - np.eye(3)).T).ravel()
    assert np.max(np.abs(system.evaluate(still, np.zeros(0), 1.0).residual)) < 1e-10


# -- the upper triangle ------------------------------------------------------------------------------


def test_upper_triangle_is_the_sum_of_the_elements(verification, finger_problem, random_state, dense):
    # catches entries lost, doubled or put elsewhere by the pattern and its scatter maps
    from fem_spa.solid import kernel

    problem = finger_problem(Loads([]))
    system = System(problem, build_space(problem.mesh))
    x = random_state(system, 1)
    data = system.tangent(x, np.zeros(2))[: system.pattern.nnz]
    s, p = system.space, system.pattern
    blocks = np.empty((len(s.tets), kernel.N_UPPER))
    kernel.tangent(
        s.tets, 0, len(s.tets), s.inverse_jacobian, s.weight, s.shape_gradient, s.pressure_shape,
        x[: system.n_u], x[system.n_u :], system._inverse_bulk, *system._W, blocks,
    )  # fmt: skip
    whole = np.zeros((s.n_dofs, s.n_dofs))
    upper = np.triu_indices(kernel.N_LOCAL)
    for dofs, block in zip(system.element_dofs, blocks, strict=True):
        local = np.zeros((kernel.N_LOCAL, kernel.N_LOCAL))
        local[upper] = block
        whole[np.ix_(dofs, dofs)] += local + np.triu(local, 1).T
    free = ~system.held
    scale = np.full(s.n_dofs, system.length_unit)
    scale[system.n_u :] = system.stress_unit
    expected = (whole * np.outer(scale, scale) / system.energy_unit)[np.ix_(free, free)]
    np.testing.assert_allclose(dense(p, data), expected, atol=1e-12 * np.abs(expected).max())
    for row in range(p.n_free):
        columns = p.indices[p.indptr[row] : p.indptr[row + 1]]
        assert columns[0] == row and np.all(np.diff(columns) > 0)
    y, out = np.random.default_rng(2).standard_normal(p.n_free), np.empty(p.n_free)
    symmetric_product(p.indptr, p.indices, data, y, out)
    np.testing.assert_allclose(out, expected @ y, atol=1e-11 * np.abs(out).max())


# -- cavities ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def void(verification):
    """A block with one void, and the block without, cut along the same planes; nodes at random places."""
    v = verification
    grid = [v.even(0, 12 * MM, 3)] * 3
    low, high = np.full(3, 4 * MM), np.full(3, 8 * MM)
    mesh = v.box(grid, voids={"main": (low, high)})
    full = v.box(grid, regions={"air": lambda X: np.all((X > low) & (X < high), axis=1)})
    return mesh, full


def wavy(X):
    """A smooth map that bends every face."""
    x, y, z = np.moveaxis(X / (12 * MM), -1, 0)
    return (
        12
        * MM
        * np.stack(
            [x + 0.1 * np.sin(3 * y) + 0.05 * z * z, 1.2 * y + 0.1 * x * z, z - 0.1 * np.cos(4 * x)], axis=-1
        )
    )


def test_cavity_volume_is_that_of_the_tets_that_fill_it(void):
    # catches a wrong sign, factor or quadrature of the volume on curved faces
    mesh, full = void
    space = build_space(mesh)
    filled = build_space(type(full)(wavy(full.points), full.tets, full.volumes, {}))
    air = filled.weight[filled.region_slices["air"]].sum()
    cavity = Cavity(space.surfaces["cavity main"], np.zeros(3), np.full(3, 1 / 3))
    assert cavity.volume(space.points) == pytest.approx((4 * MM) ** 3, rel=1e-12)
    assert cavity.volume(wavy(space.points)) == pytest.approx(air, rel=1e-12)
    # a closed surface knows no origin
    elsewhere = Cavity(space.surfaces["cavity main"], np.array([0.1, -0.2, 0.3]), np.array([0.0, 0.7, 0.3]))
    assert elsewhere.volume(wavy(space.points)) == pytest.approx(air, rel=1e-9)


def test_half_a_cavity_encloses_half(verification, finger_problem, mirrored, half_finger):
    # catches an origin off the symmetry plane, and a wrong multiplicity
    whole = mirrored(half_finger, "symmetry")
    moved = verification.moved(half_finger, lambda X: X + np.array([0, 3 * MM, 0]))
    for mesh, symmetry in ((half_finger, {"symmetry": "y"}), (whole, {}), (moved, {"symmetry": "y"})):
        problem = finger_problem(Loads([]), mesh=mesh, symmetry=symmetry)
        system = System(problem, build_space(mesh))
        volume = system.evaluate(system.rest(), np.zeros(2), 0.0).volume * system.multiplicity
        np.testing.assert_allclose(volume, 6 * MM * 8 * MM * 5 * MM, rtol=1e-12)


@pytest.mark.parametrize("share", [(1 / 3, 1 / 3, 1 / 3), (0.5, 0.0, 0.5), (0.0, 1.0, 0.0)])
def test_cavity_gradient_and_hessian(void, slopes, closest, share):
    # catches errors of the follower force and of its tangent
    mesh, _ = void
    space = build_space(mesh)
    faces = space.surfaces["cavity main"][::5]  # open: the derivatives hold face by face
    cavity = Cavity(faces, np.array([1.0, 2.0, 3.0]) * MM, np.array(share))
    rng = np.random.default_rng(3)
    place = wavy(space.points) + 0.2 * MM * rng.standard_normal(space.points.shape)
    unit = 1 * MM

    def each(y):
        now = place.copy()
        nodes = faces[0]
        now[nodes] += unit * y.reshape(6, 3)
        return now

    one = Cavity(faces[:1], cavity.origin, cavity.share)
    gradient = one.gradient(place)[0]
    found = [
        s[0] / unit for s in slopes(lambda y: np.array([one.volume(each(y))]), 18, steps=(1e-2, 1e-3, 1e-4))
    ]
    assert closest(gradient, found) < GOOD
    hessian = np.zeros((18, 18))
    hessian[np.triu_indices(18)] = one.hessian(place)[0]
    hessian += np.triu(hessian, 1).T
    found = [s / unit for s in slopes(lambda y: one.gradient(each(y))[0], 18, steps=(1e-2, 1e-3, 1e-4))]
    assert closest(hessian, found) < GOOD
    # all faces at once is each by itself
    np.testing.assert_array_equal(cavity.gradient(place)[0], gradient)


# -- membrane ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def sheet(verification):
    """faces and points of a flat layer at z = 5 mm of a block."""
    v = verification
    mesh = v.box(
        [v.even(0, 10 * MM, 2), v.even(0, 10 * MM, 2), v.even(0, 10 * MM, 2)], layers={"paper": 5 * MM}
    )
    space = build_space(mesh)
    return space.surfaces["layer paper"], space.points


def test_membrane_force_and_tangent(sheet, slopes, closest):
    # catches errors of the layer's stress, of its geometric stiffness, of the frame on curved faces
    faces, points = sheet
    rng = np.random.default_rng(4)
    curved = wavy(points) + 0.1 * MM * rng.standard_normal(points.shape)
    u = 0.3 * MM * rng.standard_normal(points.shape)
    one = make_membrane(faces[:1], curved, modulus=3e9, thickness=1e-4, poisson=0.3)
    unit = 1 * MM

    def each(y):
        out = u.copy()
        out[faces[0]] += unit * y.reshape(6, 3)
        return out

    force = one.residual(u)[0]
    found = [
        s[0] / unit for s in slopes(lambda y: np.array([one.energy(each(y))]), 18, steps=(1e-3, 1e-4, 1e-5))
    ]
    assert closest(force, found) < GOOD
    tangent = np.zeros((18, 18))
    tangent[np.triu_indices(18)] = one.tangent(u)[0]
    tangent += np.triu(tangent, 1).T
    found = [s / unit for s in slopes(lambda y: one.residual(each(y))[0], 18, steps=(1e-3, 1e-4, 1e-5))]
    assert closest(tangent, found) < GOOD


def test_membrane_stretched_and_turned(sheet):
    # catches wrong constants of the plane-stress law: energy of a known strain, none of a rotation
    faces, points = sheet
    E, t, nu, stretch = 2e9, 2e-4, 0.3, 1.01
    membrane = make_membrane(faces, points, E, t, nu)
    Q, _ = np.linalg.qr(np.random.default_rng(6).standard_normal((3, 3)))
    turned = points @ Q.T
    assert membrane.energy(turned - points) < 1e-18 * E
    green = 0.5 * (stretch**2 - 1)
    area = (10 * MM) ** 2
    uniaxial = 0.5 * t * E / (1 - nu**2) * green**2 * area
    assert membrane.energy((points * [stretch, 1, 1]) @ Q.T - points) == pytest.approx(uniaxial, rel=1e-9)
    equal = t * E / (1 - nu) * green**2 * area
    assert membrane.energy((points * [stretch, stretch, 1]) @ Q.T - points) == pytest.approx(equal, rel=1e-9)
    np.testing.assert_allclose(
        membrane.strain(points * [stretch, 1, 1] - points)[..., 0, 0]
        + membrane.strain(points * [stretch, 1, 1] - points)[..., 1, 1],
        green,
        rtol=1e-10,
    )


# -- dead loads --------------------------------------------------------------------------------------


def test_dead_loads_are_constant_and_add_up(finger_problem, random_state):
    # catches a weight that follows the body, a force shared out wrongly, a forgotten symmetry factor
    g, push = np.array([0.3, -0.2, -9.81]), np.array([0.01, 0.0, -0.04])
    loads = Loads([], gravity=tuple(g), tip_force=tuple(push))
    problem = finger_problem(loads, density=1080.0)
    space = build_space(problem.mesh)
    system = System(problem, space)
    x = random_state(system, 8, strain=0.1)
    work = []
    for state in (system.rest(), x):
        system.evaluate(state, np.zeros(2), 0.0)
        without = system.reaction.copy()
        system.evaluate(state, np.zeros(2), 1.0)
        work.append(without - system.reaction)
    np.testing.assert_allclose(work[0], work[1], atol=1e-12 * np.abs(work[0]).max())
    force = work[0][: system.n_u].reshape(-1, 3)
    weight = 1080.0 * space.weight.sum() * g
    np.testing.assert_allclose(force.sum(axis=0), weight + push / 2, rtol=1e-10)
    # and about the origin: weight at the centroid, tip force at the tip face's centroid
    nodes = np.einsum("qa,eai->eqi", space.shape, space.points[space.tets])
    centroid = np.einsum("eq,eqi->i", space.weight, nodes) / space.weight.sum()
    tip = np.array([21.0, 3.5, 6.0]) * MM
    moment = np.cross(centroid, weight) + np.cross(tip, push / 2)
    np.testing.assert_allclose(np.cross(space.points, force).sum(axis=0), moment, rtol=1e-9)
    assert not np.any(work[0][system.n_u :])


# -- everything at once ------------------------------------------------------------------------------


CONTROLS = {"volume": np.array([1.1, 1.3]), "gas-mass": np.array([1.2, 1.4])}


@pytest.fixture(scope="module")
def loaded(finger_problem, random_state):
    """Two regions, two cavities under different pressures, a membrane, gravity; a random state."""
    loads = Loads([], gravity=(0.0, 0.0, -9.81))
    problem = finger_problem(loads, density=1080.0, layers={"paper": Layer(5e7, 1e-4)})
    system = System(problem, build_space(problem.mesh))
    x, pressure = random_state(system, 21, noise=0.01, strain=0.1), np.array([3e4, -2e4])
    rest = system.evaluate(system.rest(), pressure, 0.0).volume
    constraints = {
        control: Constraint(control, target * (rest if control == "volume" else 1.0), rest, 101325.0)
        for control, target in CONTROLS.items()
    }
    return system, x, pressure, constraints


@pytest.fixture(scope="module")
def dense_slope(loaded, slopes):
    """Residual and values of both constraints at the state, and their slope to unknowns and pressures."""
    system, x, pressure, constraints = loaded
    free = system.pattern.free
    n = len(free)

    def function(y):
        now = x.copy()
        now[free] += y[:n] * system.scale
        p = pressure + y[n:] * system.stress_unit
        e = system.evaluate(now, p, 1.0)
        return np.concatenate([e.residual, *(c.value(p, e.volume) for c in constraints.values())])

    assert system.evaluate(x, pressure, 1.0).min_jacobian > 0.1
    (slope,) = slopes(function, n + 2, steps=(1e-5,))
    return function(np.zeros(n + 2)), slope


def test_tangent_of_the_whole_system(loaded, dense_slope, dense, closest):
    # catches a contribution that is in the force and not in the tangent, or the reverse
    system, x, pressure, _ = loaded
    K = dense(system.pattern, system.tangent(x, pressure)[: system.pattern.nnz])
    n = len(K)
    assert closest(K, [dense_slope[1][:n, :n]]) < GOOD


@pytest.mark.parametrize("control", CONTROLS)
def test_bordered_newton_step(loaded, dense_slope, control):
    # catches errors of the constraint, its derivatives, the border and the block elimination
    system, x, pressure, constraints = loaded
    constraint = constraints[control]
    n = system.pattern.n_free
    rows = np.r_[0:n, n + 2 * list(CONTROLS).index(control) + np.arange(2)]
    value, slope = dense_slope[0][rows], dense_slope[1][rows]
    factors = Factors(make_solver(system.pattern))
    factors.renew(system, x, pressure, constraint, system.evaluate(x, pressure, 1.0))
    step = factors.newton_step(value[:n], value[n:])
    factors.solver.free()
    left = slope @ step + value
    assert np.linalg.norm(left[:n]) < GOOD * np.linalg.norm(value[:n])
    assert np.linalg.norm(left[n:]) < GOOD * np.linalg.norm(value[n:])
    dense_step = np.linalg.solve(slope, -value)
    assert np.linalg.norm(step - dense_step) < GOOD * np.linalg.norm(dense_step)
