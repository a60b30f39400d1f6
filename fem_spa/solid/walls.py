"""Do walls pass through one another? A check of the deformed boundary, without any contact force."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba import njit
from scipy.sparse import csr_matrix

from fem_spa.solid.contact_kernel import opposite
from fem_spa.solid.contact_points import shape_at, sides
from fem_spa.solid.space import Space
from fem_spa.solid.system import AXES

FINE = 6  # parts of a face's edge where walls are near one another
NODES = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]])
_SPLIT = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])


class Walls:
    """The boundary as straight triangles, and the planes of symmetry.

    Parameters
    ----------
    symmetry : surface -> axis
    parts : of a face's edge. 2: four triangles a face, on its nodes; more: nearer to the curved face, since
        walls that lie in one another like spoons do not cross, while their chords may
    """

    def __init__(self, space: Space, symmetry: Mapping[str, str], parts: int = 2) -> None:
        plane_faces = [space.surfaces[name] for name in symmetry]
        on_plane = {tuple(sorted(f[:3])) for faces in plane_faces for f in faces.tolist()}
        keep = np.array([tuple(sorted(f[:3])) not in on_plane for f in space.boundary.tolist()])
        self.faces = faces = np.ascontiguousarray(space.boundary[keep])
        self._shape: csr_matrix | None = None
        if parts == 2:
            self.triangles = faces[:, _SPLIT].reshape(-1, 3)
        else:
            self.triangles, self._shape = _finer(faces, parts, space.n_nodes)
        nodes = np.unique(faces)
        self.planes = []
        for name, axis in symmetry.items():
            held = np.unique(space.surfaces[name])
            i = AXES[axis]
            level = float(space.points[held, i].mean())
            free = np.setdiff1d(nodes, held)
            side = np.sign(space.points[free, i] - level)
            self.planes.append((i, level, free, side))

    def cross(self, position: np.ndarray, faces: np.ndarray | None = None) -> np.ndarray | None:
        """(3,) m, a place where two parts of the boundary pass through one another, or None.

        position : (n_nodes, 3) m;  faces : (n_faces,) bool, those that are looked at, else all
        """
        for i, level, free, side in self.planes:
            depth = (position[free, i] - level) * side
            worst = int(np.argmin(depth))
            if depth[worst] < 0:
                return position[free[worst]]
        position = self._corners(position)
        triangles = self.triangles
        if faces is not None:
            triangles = triangles.reshape(len(faces), -1, 3)[faces].reshape(-1, 3)
        if len(triangles) == 0:
            return None
        corners = position[triangles]
        low, high = corners.min(axis=1), corners.max(axis=1)
        axis = int(np.argmax(high.max(axis=0) - low.min(axis=0)))
        order = np.argsort(low[:, axis], kind="stable")
        pair = _first_crossing(triangles[order], position, low[order], high[order], axis)
        return None if pair < 0 else corners[order][pair].mean(axis=0)

    def _corners(self, position: np.ndarray) -> np.ndarray:
        return position if self._shape is None else self._shape @ position

    def points(self, position: np.ndarray) -> np.ndarray:
        """(n, 3) m, the triangles' corners where the nodes are at position (n_nodes, 3) m."""
        return self._corners(position)[np.unique(self.triangles)]


class WallWatch:
    """Finds where walls first pass through one another, at every converged state and between two of them.

    Walls that face one another are looked at as nearly curved as they are, the others on their nodes; what
    crosses there only is looked at closely again, since chords of curved walls may cross where walls do not.
    """

    def __init__(self, space: Space, symmetry: Mapping[str, str]) -> None:
        self._coarse, self._fine = Walls(space, symmetry), Walls(space, symmetry, FINE)
        self._faces = self._coarse.faces
        self._side = sides(space, self._faces)
        self._shape = shape_at(NODES)
        self._which = np.ones((len(self._faces), len(NODES)), dtype=bool)
        X = space.points[self._faces]
        self._reach = 0.25 * float(np.ptp(X, axis=1).max(axis=1).mean())

    def cross(self, position: np.ndarray) -> np.ndarray | None:
        """(3,) m, a place where two parts of the boundary pass through one another, or None.

        position : (n_nodes, 3) m
        """
        place = self._fine.cross(position, self._facing(position))
        if place is None and self._coarse.cross(position) is not None:
            place = self._fine.cross(position)
        return place

    def _facing(self, position: np.ndarray) -> np.ndarray:
        """(n_faces,) bool: faces that have another one opposite, near enough to be in it."""
        points, others = opposite(self._faces, self._side, self._shape, self._which, position, self._reach)
        facing = np.zeros(len(self._faces), dtype=bool)
        facing[points // len(NODES)] = facing[others] = True
        return facing

    def first_crossing(self, before: np.ndarray, after: np.ndarray) -> float:
        """Fraction between two shapes (n_nodes, 3), clean and not, at which walls first touch."""
        lo, hi = 0.0, 1.0
        for _ in range(7):
            middle = 0.5 * (lo + hi)
            if self.cross(before + middle * (after - before)) is None:
                lo = middle
            else:
                hi = middle
        return 0.5 * (lo + hi)


def _finer(faces: np.ndarray, n: int, n_nodes: int) -> tuple[np.ndarray, csr_matrix]:
    """Triangles of faces (n_faces, 6) cut into n parts an edge; their corners as sums over nodes."""
    lattice = [(i, j) for i in range(n + 1) for j in range(n + 1 - i)]
    at = {place: k for k, place in enumerate(lattice)}
    cut = [(at[i, j], at[i + 1, j], at[i, j + 1]) for i, j in lattice if i + j < n]
    cut += [(at[i + 1, j], at[i + 1, j + 1], at[i, j + 1]) for i, j in lattice if i + j < n - 1]
    values = shape_at(np.array(lattice) / n)
    node = np.where(values != 0.0, faces[:, None, :], -1)
    order = np.argsort(node, axis=-1)
    node = np.take_along_axis(node, order, axis=-1).reshape(-1, 6)
    value = np.take_along_axis(np.broadcast_to(values, (len(faces), *values.shape)), order, axis=-1)
    key = np.concatenate([node, np.round(1e9 * value).reshape(-1, 6)], axis=1).astype(np.int64)
    # a number for each row, from sums that wrap round: sorting rows takes ten times as long
    mix = np.random.default_rng(0).integers(-(2**62), 2**62, key.shape[1])
    _, first, number = np.unique(key @ mix, return_index=True, return_inverse=True)
    node, value = node[first], value.reshape(-1, 6)[first]
    shape = csr_matrix(
        (value[node >= 0], (np.repeat(np.arange(len(first)), (node >= 0).sum(axis=1)), node[node >= 0])),
        shape=(len(first), n_nodes),
    )
    start = len(lattice) * np.arange(len(faces))
    return number.ravel()[(start[:, None, None] + np.array(cut)).reshape(-1, 3)], shape


@njit(cache=True)
def _first_crossing(triangles, position, low, high, axis):
    """Number of a triangle that an edge of another one pierces, -1 if none. Sorted by low[:, axis]."""
    n = len(triangles)
    other1 = (axis + 1) % 3
    other2 = (axis + 2) % 3
    for a in range(n):
        for b in range(a + 1, n):
            if low[b, axis] > high[a, axis]:
                break
            if low[b, other1] > high[a, other1] or low[a, other1] > high[b, other1]:
                continue
            if low[b, other2] > high[a, other2] or low[a, other2] > high[b, other2]:
                continue
            shared = False
            for i in range(3):
                for j in range(3):
                    if triangles[a, i] == triangles[b, j]:
                        shared = True
            if shared:
                continue
            if _pierces(triangles[a], triangles[b], position) or _pierces(
                triangles[b], triangles[a], position
            ):
                return a
    return -1


@njit(cache=True)
def _pierces(edges_of, face, position):
    """Does an edge of the one triangle pass through the inside of the other?"""
    for k in range(3):
        p = position[edges_of[k]]
        q = position[edges_of[(k + 1) % 3]]
        a = position[face[0]]
        b = position[face[1]]
        c = position[face[2]]
        sp = _volume6(a, b, c, p)
        sq = _volume6(a, b, c, q)
        # coplanar pieces have volumes of rounding size and of either sign
        size = 0.0
        for i in range(3):
            size = max(size, abs(b[i] - a[i]), abs(c[i] - a[i]), abs(q[i] - p[i]), abs(p[i] - a[i]))
        if sp * sq >= 0.0 or min(abs(sp), abs(sq)) < 1e-10 * size**3:
            continue
        s1 = _volume6(p, q, a, b)
        s2 = _volume6(p, q, b, c)
        s3 = _volume6(p, q, c, a)
        if (s1 > 0.0 and s2 > 0.0 and s3 > 0.0) or (s1 < 0.0 and s2 < 0.0 and s3 < 0.0):
            return True
    return False


@njit(cache=True)
def _volume6(a, b, c, d):
    x0 = b[0] - a[0]
    x1 = b[1] - a[1]
    x2 = b[2] - a[2]
    y0 = c[0] - a[0]
    y1 = c[1] - a[1]
    y2 = c[2] - a[2]
    z0 = d[0] - a[0]
    z1 = d[1] - a[1]
    z2 = d[2] - a[2]
    return x0 * (y1 * z2 - y2 * z1) - x1 * (y0 * z2 - y2 * z0) + x2 * (y0 * z1 - y1 * z0)
