"""The outside of an actuator as triangles on paper: mirrored to the whole, turned to its bending plane x-z.

The projection is a cabinet one: the plane x-z keeps its lengths and angles, so that a scale bar and a
bending angle can be read off; the depth y goes a third of its length up to the right.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

DEPTH = (0.28, 0.16)
"""Share of a point's y that is added to its x and to its z on paper."""

_FOUR = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])


@dataclass(frozen=True)
class Outside:
    """Triangles of the outer surface.

    rest : (n, 3) m;  triangles : (k, 3), normals out of the body
    node : (n,) node of the space that each point is or mirrors;  sign : (n, 3) of its displacement
    """

    rest: np.ndarray
    triangles: np.ndarray
    node: np.ndarray
    sign: np.ndarray

    def moved(self, displacement: np.ndarray) -> np.ndarray:
        """(n, 3) m, where the points are after `displacement` ((n_nodes, 3) m)."""
        return self.rest + self.sign * displacement[self.node]


def outside(space: Any, symmetry: Mapping[str, str]) -> Outside:
    """What can be seen of `space`: boundary faces without cavities, each symmetry plane mirrored.

    Parameters
    ----------
    space : with points (n, 3) m, boundary (k, 6), surfaces name -> (k, 6)
    symmetry : surface -> "x", "y" or "z"
    """
    hidden = [
        faces for name, faces in space.surfaces.items() if name.startswith("cavity ") or name in symmetry
    ]
    faces = space.boundary
    if hidden:
        inner = _keys(np.vstack([np.asarray(f)[:, :3] for f in hidden]), len(space.points))
        shown = faces[~np.isin(_keys(faces[:, :3], len(space.points)), inner)]
        faces = shown if len(shown) else faces
    node, local = np.unique(faces, return_inverse=True)
    triangles = local.reshape(-1, 6)[:, _FOUR].reshape(-1, 3)
    rest, sign = space.points[node], np.ones((len(node), 3))
    for surface, axis in symmetry.items():
        i = "xyz".index(axis)
        plane = float(np.mean(space.points[np.asarray(space.surfaces[surface]).ravel(), i]))
        other, flip = rest.copy(), sign.copy()
        other[:, i] = 2.0 * plane - other[:, i]
        flip[:, i] *= -1.0
        triangles = np.vstack([triangles, triangles[:, ::-1] + len(rest)])
        rest, sign, node = np.vstack([rest, other]), np.vstack([sign, flip]), np.concatenate([node, node])
    return Outside(rest, triangles, node, sign)


def bending_plane(space: Any, symmetry: Mapping[str, str]) -> str:
    """The normal, "x", "y" or "z", of the plane in which the actuator bends: that of the symmetry plane which
    holds its axis; "y" where none does."""
    across = np.zeros(3)
    if "tip" in space.surfaces:
        corners = space.points[np.asarray(space.surfaces["tip"])[:, :3]]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
        across = np.abs(across) / max(float(np.linalg.norm(across)), 1e-300)
    for normal in "yxz":
        if normal in symmetry.values() and across["xyz".index(normal)] < 0.5:
            return normal
    return "y"


def turned(points: np.ndarray, normal: str) -> np.ndarray:
    """Points (n, 3) turned so that the plane with a normal becomes x-z, to be put on paper."""
    x, y, z = points.T
    return {"y": points, "x": np.column_stack([y, -x, z]), "z": np.column_stack([x, -z, y])}[normal]


def on_paper(points: np.ndarray) -> np.ndarray:
    """(n, 3): right and up on paper, and depth away from the reader, all in the unit of `points`."""
    x, y, z = points.T
    return np.column_stack([x + DEPTH[0] * y, z + DEPTH[1] * y, y])


def shading(points: np.ndarray, triangles: np.ndarray, crease: float = 40.0) -> np.ndarray:
    """Brightness of each triangle's three corners, (k, 3) of 0..1: light from above, left and the reader.

    Parameters
    ----------
    points, triangles : as of `Outside`; points at one place count as one
    crease : degrees between two triangles at a point from which on the edge between them is seen
    """
    a, b, c = points[triangles[:, 0]], points[triangles[:, 1]], points[triangles[:, 2]]
    area = np.cross(b - a, c - a)
    flat = area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), 1e-300)
    size = float(np.ptp(points, axis=0).max())
    cell = np.round(points / (1e-6 * size)).astype(np.int64)
    _, place = np.unique((cell[:, 0] * 4194301 + cell[:, 1]) * 4194301 + cell[:, 2], return_inverse=True)
    group = place.ravel()[triangles].ravel()  # corner 3 k + i of triangle k -> its place
    order = np.argsort(group, kind="stable")
    count = np.bincount(group)
    start = np.concatenate([[0], np.cumsum(count)[:-1]])
    many = count[group]  # corners that meet each corner
    corner = np.repeat(np.arange(len(group)), many)
    within = np.arange(len(corner)) - np.repeat(np.cumsum(many) - many, many)
    other = order[np.repeat(start[group], many) + within] // 3
    alike = np.einsum("ij,ij->i", flat[corner // 3], flat[other]) > np.cos(np.radians(crease))
    normal = np.stack(
        [np.bincount(corner[alike], area[other[alike], i], len(group)) for i in range(3)], axis=1
    )
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    sky = 0.5 + 0.5 * (normal @ (LIGHT / np.linalg.norm(LIGHT)))
    return (DARKEST + (1.0 - DARKEST) * sky).reshape(-1, 3)


LIGHT = np.array([-0.35, -0.75, 0.65])
DARKEST = 0.5
"""Brightness of a face that looks away from the light."""


def _keys(corners: np.ndarray, count: int) -> np.ndarray:
    """One number for the three corners of a face, whatever their order."""
    key = np.sort(corners, axis=1).astype(np.int64)
    return (key[:, 0] * count + key[:, 1]) * count + key[:, 2]
