"""The boundary's faces as contact sees them, and the points of a face at which it acts.

Contact acts at the points of a quadrature rule, all inside the faces. Between them, and on the edges, a face
may still pass into another one by a hair. So every face has a lattice of watched points as well, its nodes
and edges among them. They bear nothing until one is found inside something; from then on that one acts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from fem_spa.solid.closest_point import shape as shape_functions
from fem_spa.solid.contact_kernel import FACING, flat_normals
from fem_spa.solid.obstacles import Plane
from fem_spa.solid.space import Space

AXES = {"x": 0, "y": 1, "z": 2}
RULE = 6  # polynomial degree of the rule on a face
LATTICE = 6  # parts of an edge between watched points; even, so that every node is one
NEARER = (2, 4)  # parts of the lattice's distance: how near to a corner there are more of them


@dataclass(frozen=True)
class Pairs:
    """Points (n,) that have faces opposite: others[begin[k]:begin[k + 1]] those of points[k]."""

    points: np.ndarray
    begin: np.ndarray
    others: np.ndarray


@dataclass(frozen=True)
class Nearest:
    """What `contact_kernel.nearest` finds for each point."""

    face: np.ndarray
    kind: np.ndarray
    edge: np.ndarray
    place: np.ndarray
    gap: np.ndarray
    normal: np.ndarray


def face_points() -> tuple[np.ndarray, np.ndarray, int]:
    """Points (m, 2) of the reference triangle, their weights (m,), and how many of them are the rule's.

    The rule's come first. A watched point that acts weighs as much as the rule's do on average.
    """
    rule, weights = get_quadrature(RefTri, RULE)
    n = LATTICE
    lattice = np.array([(i / n, j / n) for i in range(n + 1) for j in range(n + 1 - i)])
    # a fold's edge may close first at a corner where it ends: walls cross there before the lattice sees it
    for part in NEARER:
        h = 1.0 / (n * part)
        s, t = np.array([(h, 0), (0, h), (h, h)]).T
        corners = (s, t), (1 - s - t, s), (t, 1 - s - t)
        lattice = np.vstack([lattice, *(np.stack(corner, axis=1) for corner in corners)])
    watched = np.full(len(lattice), weights.mean())
    return np.vstack([rule.T, lattice]), np.concatenate([weights, watched]), len(weights)


def shape_at(points: np.ndarray) -> np.ndarray:
    """(m, 6) shape functions of a face at points (m, 2)."""
    out = np.empty((len(points), 6))
    for N, (s, t) in zip(out, points, strict=True):
        shape_functions(s, t, N)
    out[np.abs(out) < 1e-14] = 0.0
    return out


def sides(space: Space, faces: np.ndarray) -> np.ndarray:
    """(n_faces,) 0 outside, k + 1 in the k-th cavity: what is on different sides of a wall cannot meet."""
    number = {}
    for k, name in enumerate(sorted(n for n in space.surfaces if n.startswith("cavity "))):
        for f in space.surfaces[name].tolist():
            number[tuple(sorted(f[:3]))] = k + 1
    return np.array([number.get(tuple(sorted(f[:3])), 0) for f in faces.tolist()], dtype=np.int64)


def parts(tets: np.ndarray) -> int:
    """How many bodies there are that share no node."""
    a, b = tets[:, :1].repeat(9, axis=1).ravel(), tets[:, 1:].ravel()
    n = int(tets.max()) + 1
    graph = coo_matrix((np.ones(len(a), dtype=np.int8), (a, b)), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    return len(np.unique(label[np.unique(tets)]))


def across(faces: np.ndarray) -> np.ndarray:
    """(n_faces, 3) the face behind each edge (01, 12, 20), the face itself at the edge of a cut."""
    n = len(faces)
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    same = np.flatnonzero((edges[order[1:]] == edges[order[:-1]]).all(axis=1))
    out = np.repeat(np.arange(n), 3)
    first, second = order[same], order[same + 1]
    out[first], out[second] = second // 3, first // 3
    return out.reshape(n, 3)


def areas(faces: np.ndarray, X: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n_faces, m) twice the area a unit of the reference triangle at its points (m, 2), m^2."""
    l = 1 - points.sum(axis=1)
    s, t = points.T
    zero = np.zeros_like(s)
    ds = np.stack([1 - 4 * l, 4 * s - 1, zero, 4 * (l - s), 4 * t, -4 * t], axis=1)
    dt = np.stack([1 - 4 * l, zero, 4 * t - 1, -4 * s, 4 * s, 4 * (l - t)], axis=1)
    x = X[faces]
    along = np.einsum("qa,fai->fqi", ds, x), np.einsum("qa,fai->fqi", dt, x)
    return np.linalg.norm(np.cross(*along), axis=-1)


def mirror(axis: str, X: np.ndarray, on_it: np.ndarray) -> Plane:
    """The plane of symmetry as a wall, its normal towards the body."""
    i = AXES[axis]
    point = X[on_it].mean(axis=0)
    normal = np.zeros(3)
    normal[i] = 1.0 if X[:, i].mean() > point[i] else -1.0
    return Plane((point[0], point[1], point[2]), (normal[0], normal[1], normal[2]))


def looks_at(faces: np.ndarray, X: np.ndarray, plane: Plane) -> np.ndarray:
    """(n_faces,) bool: whether a face and its image in the plane look at one another, as pairs do."""
    normal = np.empty((len(faces), 3))
    flat_normals(faces, X, normal)
    return normal @ np.asarray(plane.normal) < -np.sqrt(0.5 * (1.0 - FACING))


def only(face: np.ndarray, begin: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Neighbours of each point, in `nearest`'s form: where there is a face (n,) already, that one alone."""
    held = face >= 0
    count = np.where(held, 1, np.diff(begin))
    start = np.append(0, np.cumsum(count))
    out = others[np.repeat(begin[:-1] - start[:-1], count) + np.arange(start[-1])]
    out[start[:-1][held]] = face[held]
    return start, out
