"""The scale of all walls' thickness as a mode of the mesh: no new drawing, no new mesh.

Each face of a cavity looks through the body at the boundary opposite: the wall's thickness there is the
distance along its normal to the tangent plane of the face that the largest ball touching both finds. A scale
s moves the cavity's face by (s - 1) times that thickness into the air (half of it where another chamber is
on the other side, which moves as much). What is more than twice as thick as half of the cavities' area is no
wall but a solid part, and moves as twice that median. The outside, the ends and membranes stay; nodes between
follow by a graph-harmonic extension; symmetry planes keep their nodes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import splu

from fem_spa.errors import InputError
from geometry.second_order import to_second_order
from geometry.tagged import TaggedMesh

SOLID = 2.0
"""Times the median thickness from which on a part is solid and not a wall."""
_FACING = 0.3  # cosine from which on a face is opposite and not beside
_CHUNK = 400
_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))


def thickness_mode(mesh: TaggedMesh, symmetry: Mapping[str, str]) -> np.ndarray:
    """(n_points, 3) m: how the nodes of the second-order mesh move for walls of twice the thickness.

    symmetry : surface -> axis of its normal. InputError where the mesh has no cavity.
    """
    mesh = to_second_order(mesh)
    if not mesh.cavities:
        raise InputError("walls.scale: the mesh has no cavity, so it has no walls")
    corners = _corners(mesh)
    V = _cavity_motion(mesh, len(mesh.points))
    held = np.zeros((len(mesh.points), 3), dtype=bool)
    for name, faces in mesh.surfaces.items():
        if name in symmetry:
            held[faces[:, :3].ravel(), "xyz".index(symmetry[name])] = True
        elif not name.startswith("cavity "):
            held[faces[:, :3].ravel()] = True
    inside = np.zeros(len(mesh.points), dtype=bool)
    for name in mesh.cavities:
        inside[mesh.surfaces[f"cavity {name}"][:, :3].ravel()] = True
    V[held] = 0.0
    held[inside] = True
    V = _extended(mesh, corners, V, held)
    ends = np.array(_EDGES)
    middle = mesh.tets[:, 4:]
    V[middle.ravel()] = 0.5 * (V[mesh.tets[:, ends[:, 0]]] + V[mesh.tets[:, ends[:, 1]]]).reshape(-1, 3)
    return V


def wall_thickness(mesh: TaggedMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of every cavity face: thickness (k,) m of the wall behind it, whether air is opposite, and its corners.

    nan where nothing is opposite.
    """
    mesh = to_second_order(mesh)
    centre, normal, air, sheet, place = [], [], [], [], []
    for name, faces in mesh.surfaces.items():
        if name.startswith("symmetry"):
            continue
        X = mesh.points[faces[:, :3]]
        area = np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0])
        centre.append(X.mean(axis=1))
        normal.append(area / np.linalg.norm(area, axis=1)[:, None])
        air.append(np.full(len(faces), name.startswith("cavity ")))
        sheet.append(np.full(len(faces), name.startswith("layer ")))
        place.append(faces[:, :3])
    c, n = np.concatenate(centre), np.concatenate(normal)
    is_air, is_sheet = np.concatenate(air), np.concatenate(sheet)
    own = np.flatnonzero(is_air)
    thickness, opposite = np.full(len(own), np.nan), np.zeros(len(own), dtype=bool)
    for first in range(0, len(own), _CHUNK):
        part = own[first : first + _CHUNK]
        into = -n[part]
        d = c[None] - c[part][:, None]
        ahead = np.einsum("pqi,pi->pq", d, into)
        facing = into @ n.T
        facing[:, is_sheet] = np.abs(facing[:, is_sheet])
        with np.errstate(divide="ignore", invalid="ignore"):
            ball = np.where((ahead > 0) & (facing > _FACING), np.sum(d**2, axis=2) / ahead, np.inf)
        best = np.argmin(ball, axis=1)
        row = np.arange(len(part))
        found = np.isfinite(ball[row, best])
        to_plane = np.einsum("pi,pi->p", d[row, best], n[best]) / np.einsum("pi,pi->p", into, n[best])
        rows = first + row[found]
        thickness[rows] = np.clip(to_plane[found], 0.2 * ball[row, best][found], ball[row, best][found])
        opposite[rows] = is_air[best][found]
    return thickness, opposite, np.concatenate(place)[own]


def _cavity_motion(mesh: TaggedMesh, count: int) -> np.ndarray:
    """(count, 3) m: motion of the cavities' nodes, each face by its wall's thickness along its normal."""
    thickness, opposite, faces = wall_thickness(mesh)
    X = mesh.points[faces]
    area = 0.5 * np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0])
    size = np.linalg.norm(area, axis=1)
    normal = area / size[:, None]
    seen = np.isfinite(thickness)
    order = np.flatnonzero(seen)[np.argsort(thickness[seen])]
    half = np.searchsorted(np.cumsum(size[order]), 0.5 * size[order].sum())
    most = SOLID * thickness[order[min(half, len(order) - 1)]]
    way = np.where(opposite, 0.5, 1.0) * np.minimum(np.nan_to_num(thickness), most)
    A, b = np.zeros((count, 3, 3)), np.zeros((count, 3))
    for k in range(3):
        node = faces[seen, k]
        np.add.at(A, node, (size[:, None, None] * normal[:, :, None] * normal[:, None, :])[seen])
        np.add.at(b, node, (size[:, None] * normal * way[:, None])[seen])
    nodes = np.unique(faces[seen])
    V = np.zeros((count, 3))
    # walls that meet at an edge each keep their own way; nearly flat ones share one direction
    V[nodes] = np.einsum("nij,nj->ni", np.linalg.pinv(A[nodes], rcond=0.05, hermitian=True), b[nodes])
    return V


def _corners(mesh: TaggedMesh) -> np.ndarray:
    return np.unique(mesh.tets[:, :4])


def _extended(mesh: TaggedMesh, corners: np.ndarray, V: np.ndarray, held: np.ndarray) -> np.ndarray:
    """V with free corner nodes at the weighted mean of their neighbours, weights 1 / length^2."""
    n = len(mesh.points)
    pairs = np.concatenate([mesh.tets[:, list(edge)] for edge in _EDGES])
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)
    i, j = pairs.T
    weight = 1.0 / np.sum((mesh.points[i] - mesh.points[j]) ** 2, axis=1)
    W = coo_matrix((np.r_[weight, weight], (np.r_[i, j], np.r_[j, i])), shape=(n, n)).tocsr()
    L = (diags(np.asarray(W.sum(axis=1)).ravel()) - W).tocsr()
    V = V.copy()
    is_corner = np.zeros(n, dtype=bool)
    is_corner[corners] = True
    for axis in range(3):
        free = np.flatnonzero(is_corner & ~held[:, axis])
        known = np.flatnonzero(is_corner & held[:, axis])
        if free.size:
            V[free, axis] = splu(L[free][:, free].tocsc()).solve(-(L[free][:, known] @ V[known, axis]))
    return V
