"""Rigid obstacles as triangles: for the picture of the shape, and as obstacles.vtp for ParaView."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fem_spa.solid.obstacles import Cylinder, Obstacle, Plane

AROUND, ALONG = 48, 24
"""Facets of a full turn, and from pole to pole."""


def surface(obstacle: Obstacle, near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) m and triangles (k, 3), normals out of the obstacle.

    Parameters
    ----------
    near : (m, 3) m, points of the body: planes and bars, which have no end, are drawn about them
    """
    if isinstance(obstacle, Plane):
        return _plate(obstacle, near)
    if isinstance(obstacle, Cylinder):
        return _bar(obstacle, near)
    turn, rise = np.meshgrid(
        np.linspace(0.0, 2 * np.pi, AROUND + 1), np.linspace(-0.5 * np.pi, 0.5 * np.pi, ALONG + 1)
    )
    unit = np.stack([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)], axis=-1)
    size = np.broadcast_to(np.asarray(obstacle.radius, dtype=float), (3,))
    return np.asarray(obstacle.centre) + (unit * size).reshape(-1, 3), _grid(ALONG, AROUND)


def frame(direction: Sequence[float]) -> np.ndarray:
    """(3, 3), rows: two unit vectors across a direction and the direction itself, right-handed."""
    d = np.asarray(direction, dtype=float)
    d = d / np.linalg.norm(d)
    first = np.eye(3)[int(np.argmin(np.abs(d)))]
    first = first - (first @ d) * d
    first = first / np.linalg.norm(first)
    return np.stack([first, np.cross(d, first), d])


def _plate(plane: Plane, near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A rectangle of the plane as large as the body's shadow on it, and a fifth more on every side."""
    axes = frame(plane.normal)
    point = np.asarray(plane.point)
    shadow = (near - point) @ axes[:2].T
    low, high = shadow.min(axis=0), shadow.max(axis=0)
    margin = 0.2 * float((high - low).max())
    u, v = np.meshgrid([low[0] - margin, high[0] + margin], [low[1] - margin, high[1] + margin])
    return point + np.column_stack([u.ravel(), v.ravel()]) @ axes[:2], _grid(1, 1)


def _bar(bar: Cylinder, near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    axes = frame(bar.axis)
    point = np.asarray(bar.point)
    along = (near - point) @ axes[2]
    margin = 0.2 * float(np.ptp(near, axis=0).max())
    turn, s = np.meshgrid(
        np.linspace(0.0, 2 * np.pi, AROUND + 1), [along.min() - margin, along.max() + margin]
    )
    round_ = np.stack([bar.radius * np.cos(turn), bar.radius * np.sin(turn), s], axis=-1)
    return point + round_.reshape(-1, 3) @ axes, _grid(1, AROUND)


def _grid(rows: int, columns: int) -> np.ndarray:
    """Triangles of a grid of (rows + 1) x (columns + 1) points."""
    number = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    return np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])


def vtp(obstacles: Sequence[Obstacle], near: np.ndarray) -> str:
    """A VTK file of all obstacles, their number (from 1) a field of the triangles; lengths in m."""
    points, triangles, number = np.zeros((0, 3)), np.zeros((0, 3), dtype=int), []
    for k, obstacle in enumerate(obstacles):
        p, t = surface(obstacle, near)
        triangles = np.vstack([triangles, t + len(points)])
        points = np.vstack([points, p])
        number += [k + 1] * len(t)

    def array(kind: str, name: str, values: np.ndarray, more: str = "") -> str:
        text = " ".join(f"{v:.9g}" for v in np.asarray(values).ravel())
        return f'<DataArray type="{kind}" Name="{name}"{more} format="ascii">{text}</DataArray>\n'

    three = ' NumberOfComponents="3"'
    return (
        '<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0">\n<PolyData>\n'
        f'<Piece NumberOfPoints="{len(points)}" NumberOfPolys="{len(triangles)}">\n'
        f"<CellData>\n{array('Int32', 'obstacle', np.array(number))}</CellData>\n"
        f"<Points>\n{array('Float64', 'Points', points, three)}</Points>\n"
        f"<Polys>\n{array('Int64', 'connectivity', triangles)}"
        f"{array('Int64', 'offsets', 3 * np.arange(1, len(triangles) + 1))}</Polys>\n"
        "</Piece>\n</PolyData>\n</VTKFile>\n"
    )
