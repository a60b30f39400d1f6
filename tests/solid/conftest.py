"""Helpers of this room, as fixtures that return functions: bodies, difference quotients."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

MM = 1e-3


@pytest.fixture(scope="session")
def half_finger(verification):
    """A block with a stiff bottom and two closed voids, the half y >= 0: bends down when blown up."""
    v = verification
    return v.box(
        [
            MM * np.array([0.0, 3, 9, 12, 18, 21]),
            MM * np.array([0.0, 4, 7]),
            MM * np.array([0.0, 2, 4, 9, 12]),
        ],
        voids={
            "near": (MM * np.array([3.0, 0, 4]), MM * np.array([9.0, 4, 9])),
            "far": (MM * np.array([12.0, 0, 4]), MM * np.array([18.0, 4, 9])),
        },
        regions={"stiff": lambda X: X[:, 2] < 2 * MM},
        names={"x0": "base", "x1": "tip", "y0": "symmetry"},
        layers={"paper": 2 * MM},
    )


@pytest.fixture(scope="session")
def mirrored():
    """mesh, surface -> the whole body: the mesh and its mirror image in the plane y = 0, named `surface`."""

    def mirror(mesh, surface):
        n = len(mesh.points)
        on_plane = np.unique(mesh.surfaces[surface])
        image = np.full(n, -1)
        image[on_plane] = on_plane
        new = np.setdiff1d(np.arange(n), on_plane)
        image[new] = n + np.arange(len(new))
        points = np.vstack([mesh.points, mesh.points[new] * [1.0, -1.0, 1.0]])
        tets = np.vstack([mesh.tets, image[mesh.tets[:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]]])
        m = len(mesh.tets)
        return replace(
            mesh,
            points=points,
            tets=tets,
            volumes={k: np.concatenate([e, e + m]) for k, e in mesh.volumes.items()},
            surfaces={
                k: np.vstack([f, image[f[:, [0, 2, 1, 5, 4, 3]]]])
                for k, f in mesh.surfaces.items()
                if k != surface
            },
        )

    return mirror


@pytest.fixture(scope="session")
def finger_problem(verification, half_finger):
    """loads, options -> the problem of the half finger (or of `mesh`)."""
    from fem_spa.solid.problem import Material, Problem
    from materials.registry import law

    def problem(loads, mesh=None, symmetry=None, density=None, **options):
        v = verification
        return Problem(
            mesh or half_finger,
            {
                "body": v.material("yeoh", density=density),
                "stiff": Material(law("neo-hooke"), {"C10": 1e6}, density=density),
            },
            loads,
            symmetry={"symmetry": "y"} if symmetry is None else symmetry,
            **options,
        )

    return problem


@pytest.fixture(scope="session")
def rough_cube(verification):
    """seed -> six tets with nodes, middle ones included, moved at random: curved elements."""

    def cube(seed, **options):
        rng = np.random.default_rng(seed)
        mesh = verification.box([verification.even(0, 10 * MM, 1)] * 3, **options)
        return verification.moved(mesh, lambda X: X + 0.4 * MM * rng.standard_normal(X.shape))

    return cube


@pytest.fixture(scope="session")
def random_state():
    """system, seed, noise -> x: a homogeneous strain, noise on every node and random Lagrange pressures."""

    def state(system, seed, noise=0.02, strain=0.15):
        rng = np.random.default_rng(seed)
        points = system.space.points
        x = np.empty(system.space.n_dofs)
        slope = strain * rng.standard_normal((3, 3))
        u = points @ slope.T
        if system.held.any():  # the strain begins at the base x = 0 and at the symmetry plane y = 0
            u *= points[:, :1] / points[:, 0].max()
            u[:, 1] *= points[:, 1] / points[:, 1].max()
        u += noise * system.length_unit * rng.standard_normal(points.shape)
        x[: system.n_u] = u.ravel()
        x[system.n_u :] = 0.5 * system.stress_unit * rng.standard_normal(system.space.n_vertices)
        x[system.held] = 0.0
        return x

    return state


@pytest.fixture(scope="session")
def slopes():
    """f, steps -> for each step size the matrix df/dy at y = 0 by central differences, columns a y_j."""

    def differences(f, n, steps=(1e-4, 1e-5)):
        for h in steps:
            columns = []
            for j in range(n):
                y = np.zeros(n)
                y[j] = h
                columns.append((f(y) - f(-y)) / (2 * h))
            yield np.stack(columns, axis=-1)

    return differences


@pytest.fixture(scope="session")
def closest():
    """exact, candidates -> the smallest of their relative differences in the largest entry."""

    def distance(exact, candidates):
        return min(float(np.max(np.abs(c - exact)) / np.max(np.abs(exact))) for c in candidates)

    return distance


@pytest.fixture(scope="session")
def dense():
    """pattern, data -> the symmetric matrix whose upper triangle they hold."""

    def full(pattern, data):
        out = np.zeros((pattern.n_free, pattern.n_free))
        rows = np.repeat(np.arange(pattern.n_free), np.diff(pattern.indptr))
        out[rows, pattern.indices] = data
        return out + np.triu(out, 1).T

    return full
