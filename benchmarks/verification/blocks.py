"""Structured blocks of ten-node tets with voids, for benchmarks and tests. SI."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from skfem import MeshTet

from geometry.second_order import to_second_order
from geometry.tagged import TaggedMesh
from geometry.topology import boundary, corner_keys, facets

MM = 1e-3

Corners = tuple[Sequence[float], Sequence[float]]
Place = Callable[[np.ndarray], np.ndarray]


def box(
    grid: Sequence[np.ndarray],
    voids: Mapping[str, Corners] | None = None,
    regions: Mapping[str, Place] | None = None,
    names: Mapping[str, str] | None = None,
    layers: Mapping[str, float] | None = None,
) -> TaggedMesh:
    """A block of structured ten-node tets, with voids.

    Parameters
    ----------
    grid : planes of the cells in x, y and z, m
    voids : cavity -> (low corner, high corner) on planes of the grid
    regions : volume -> whether a tet's centroid (n, 3) belongs to it; first match counts, the rest is `body`
    names : new names of the sides `x0`, `x1`, ... `z1` (lower and upper side)
    layers : layer -> its level z; the inner faces there
    """
    sk = MeshTet.init_tensor(*grid)
    points, tets = sk.p.T, sk.t.T
    edges = points[tets[:, 1:]] - points[tets[:, :1]]
    tets = np.where((np.linalg.det(edges) < 0)[:, None], tets[:, [1, 0, 2, 3]], tets)  # right-handed
    centre = points[tets].mean(axis=1)
    keep = np.ones(len(tets), dtype=bool)
    for low, high in (voids or {}).values():
        keep &= ~np.all((centre > low) & (centre < high), axis=1)
    used, tets = np.unique(tets[keep], return_inverse=True)
    points, tets, centre = points[used], tets.reshape(-1, 4), centre[keep]
    volume = np.full(len(tets), "body", dtype=object)
    for name, inside in reversed((regions or {}).items()):
        volume[inside(centre)] = name
    volumes = {str(name): np.flatnonzero(volume == name) for name in np.unique(volume.astype(str))}
    mesh = to_second_order(TaggedMesh(points, tets, volumes, {}))
    shell = boundary(mesh)
    where = mesh.points[shell[:, :3]].mean(axis=1)
    surfaces = {}
    size = max(g[-1] - g[0] for g in grid)
    for i, axis in enumerate("xyz"):
        for side, level in (("0", grid[i][0]), ("1", grid[i][-1])):
            on = np.abs(where[:, i] - level) < 1e-9 * size
            name = (names or {}).get(axis + side, axis + side)
            faces = shell[on]
            for cavity, (low, high) in (voids or {}).items():
                inside = np.all((where[on] > low) & (where[on] < high), axis=1)
                assert not inside.any(), f"cavity {cavity} lies in side {name}"
            surfaces[name] = faces
    slack = 1e-9 * size
    for cavity, (low, high) in (voids or {}).items():
        wall = np.all((where > np.array(low) - slack) & (where < np.array(high) + slack), axis=1)
        on_side = np.zeros(len(where), dtype=bool)
        for i in range(3):
            for level in (grid[i][0], grid[i][-1]):
                on_side |= np.abs(where[:, i] - level) < slack
        surfaces[f"cavity {cavity}"] = shell[wall & ~on_side]
    for layer, level in (layers or {}).items():
        every = facets(mesh.tets)
        flat = every[np.all(np.abs(mesh.points[every[:, :3], 2] - level) < slack, axis=1)]
        _, first = np.unique(corner_keys(flat, len(mesh.points)), return_index=True)
        surfaces[f"layer {layer}"] = flat[first]
    return replace(mesh, surfaces=surfaces, source="structured block")


def even(low: float, high: float, cells: int) -> np.ndarray:
    """cells + 1 planes between two levels."""
    return np.linspace(low, high, cells + 1)


def moved(mesh: TaggedMesh, to: Callable[[np.ndarray], np.ndarray]) -> TaggedMesh:
    """The same mesh with every node, middle ones included, at to(points (n, 3)): curved elements."""
    return replace(mesh, points=to(mesh.points))
