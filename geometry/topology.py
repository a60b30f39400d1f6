"""Who touches whom in a mesh of tets: facets, their orientation, open edges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geometry.errors import GeometryError, millimetres
from geometry.tagged import TaggedMesh

# facets of a right-handed tet, corners in the order whose normal points out, then middle nodes of 01, 12, 20
FACETS4 = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
FACETS10 = np.array([[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6]])


def facets(tets: np.ndarray) -> np.ndarray:
    """All facets of all tets, (4 n_tets, 3 or 6), tet by tet, normals out of the tet."""
    local = FACETS10 if tets.shape[1] == 10 else FACETS4
    return tets[:, local].reshape(-1, local.shape[1])


def corner_keys(faces: np.ndarray, count: int) -> np.ndarray:
    """One whole number a face from its three corners, in whatever order they come."""
    a, b, c = np.sort(faces[:, :3].astype(np.int64), axis=1).T
    # n^3 overflows int64 beyond two million nodes, so that the keys are made of ranks of pairs there
    if count < 2_000_000:
        return (a * count + b) * count + c
    _, ab = np.unique(a * count + b, return_inverse=True)
    return ab.astype(np.int64) * count + c


def boundary(mesh: TaggedMesh) -> np.ndarray:
    """The facets that belong to one tet only, (n, 3 or 6), normals out of the body."""
    every = facets(mesh.tets)
    _, inverse, counts = np.unique(
        corner_keys(every, len(mesh.points)), return_inverse=True, return_counts=True
    )
    return every[counts[inverse] == 1]


def oriented(mesh: TaggedMesh) -> TaggedMesh:
    """The same mesh with right-handed tets, and with surfaces rebuilt from the tets that own them.

    Boundary faces then have their normal out of the body and the middle nodes of their tet; inner
    faces (layers) are seen from the tet on their side of lower tet number, all from the same side
    where the surface is flat.

    Raises
    ------
    GeometryError
        where a triangle of a named surface is no face of a tet: where and in which surface
    """
    tets = right_handed(mesh.points, mesh.tets)
    every = facets(tets)
    keys = [every, *mesh.surfaces.values()]
    all_keys = corner_keys(np.concatenate([block[:, :3] for block in keys]), len(mesh.points))
    own, named = all_keys[: len(every)], all_keys[len(every) :]
    order = np.argsort(own, kind="stable")
    own_sorted = own[order]
    surfaces: dict[str, np.ndarray] = {}
    start = 0
    for name, faces in mesh.surfaces.items():
        wanted = named[start : start + len(faces)]
        start += len(faces)
        first = np.searchsorted(own_sorted, wanted)
        found = first < len(own_sorted)
        found[found] = own_sorted[first[found]] == wanted[found]
        if not found.all():
            lost = faces[np.flatnonzero(~found)[0]]
            raise GeometryError(
                f"surface `{name}`: {np.count_nonzero(~found)} of {len(faces)} triangles are no face of any "
                f"tet, first at {place(mesh.points[lost[:3]].mean(axis=0))}; likely cause: surface "
                "and volume were meshed apart; try: mesh them together in one gmsh model"
            )
        rebuilt = every[order[first]]
        inner = (first + 1 < len(own_sorted)) & (
            own_sorted[np.minimum(first + 1, len(own_sorted) - 1)] == wanted
        )
        if inner.any():
            rebuilt = _one_side(mesh.points, every, order, first, inner, rebuilt)
        surfaces[name] = rebuilt
    return replace(mesh, tets=tets, surfaces=surfaces)


def _one_side(
    points: np.ndarray,
    every: np.ndarray,
    order: np.ndarray,
    first: np.ndarray,
    inner: np.ndarray,
    rebuilt: np.ndarray,
) -> np.ndarray:
    """Inner faces from one side: normals towards the positive end of their largest mean component."""
    corners = points[rebuilt[:, :3]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    axis = int(np.argmax(np.abs(normal[inner]).sum(axis=0)))
    flip = inner & (normal[:, axis] < 0)
    rebuilt = rebuilt.copy()
    rebuilt[flip] = every[order[first[flip] + 1]]
    return rebuilt


def right_handed(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Tets whose corners 0 and 1 are swapped where the four corners are left-handed.

    A file may number all its tets left-handed. A tet that is inverted by its shape (its neighbours
    right-handed, it not) cannot be told from a wrongly numbered one by its corners; it overlaps its
    neighbours and is found by the volume of the body (geometry.checks).
    """
    x = points[tets[:, :4]]
    volume = np.einsum("ij,ij->i", np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), x[:, 3] - x[:, 0])
    wrong = volume < 0
    # a few among many are inverted elements, which must be seen; only a wholly left-handed mesh is renumbered
    if not len(tets) or wrong.sum() <= len(tets) // 2:
        return tets
    swapped = tets.copy()
    turned = [1, 0, 2, 3, 4, 6, 5, 8, 7, 9] if tets.shape[1] == 10 else [1, 0, 2, 3]
    swapped[:] = tets[:, turned]
    return swapped


def edges(faces: np.ndarray) -> np.ndarray:
    """Edges of triangles as sorted pairs of corners, (3 n_faces, 2)."""
    return np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)


def open_edges(faces: np.ndarray) -> np.ndarray:
    """Edges that belong to an odd number of the triangles, (n, 2)."""
    pairs, counts = np.unique(edges(faces), axis=0, return_counts=True)
    return pairs[counts % 2 == 1]


def missing_edges(wanted: np.ndarray, faces: list[np.ndarray]) -> np.ndarray:
    """Those of the wanted edges (n, 2) that are no edge of any of the triangles."""
    if not len(wanted) or not faces:
        return wanted
    have = np.unique(np.concatenate([edges(block) for block in faces]), axis=0)
    top = int(max(wanted.max(), have.max())) + 1
    return wanted[~np.isin(wanted[:, 0] * top + wanted[:, 1], have[:, 0] * top + have[:, 1])]


def place(point: np.ndarray) -> str:
    """A point in m as text in mm."""
    return "(" + ", ".join(millimetres(float(x))[:-3] for x in np.round(point, 9)) + ") mm"
