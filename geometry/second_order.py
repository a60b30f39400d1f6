"""Straight four-node tets -> straight ten-node tets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geometry.tagged import TaggedMesh
from geometry.topology import oriented

_EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])


def to_second_order(mesh: TaggedMesh) -> TaggedMesh:
    """The same mesh with a node in the middle of every edge; a mesh of ten-node tets is returned as it is.

    Edges stay straight: round walls stay as angular as they were. Six-node surfaces use the same
    middle nodes as the tets.

    Raises
    ------
    GeometryError
        where a triangle of a surface is no face of a tet
    """
    if mesh.tets.shape[1] == 10:
        return mesh
    pairs = np.sort(mesh.tets[:, _EDGES].reshape(-1, 2), axis=1).astype(np.int64)
    count = len(mesh.points)
    keys, inverse = np.unique(pairs[:, 0] * count + pairs[:, 1], return_inverse=True)
    middle = (mesh.points[keys // count] + mesh.points[keys % count]) / 2
    tets = np.hstack([mesh.tets, count + inverse.reshape(-1, 6)])
    return oriented(replace(mesh, points=np.vstack([mesh.points, middle]), tets=tets))
