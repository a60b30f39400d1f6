"""Rigid obstacles that a body may press on: data only."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Plane:
    """A half space that the body stays out of.

    point : m, on its face;  normal : points out of the obstacle, towards the body
    """

    point: tuple[float, float, float]
    normal: tuple[float, float, float]


@dataclass(frozen=True)
class Sphere:
    """A ball, or an ellipsoid where `radius` is three semi-axes along x, y, z.  centre, radius : m"""

    centre: tuple[float, float, float]
    radius: float | tuple[float, float, float]


@dataclass(frozen=True)
class Cylinder:
    """A round bar without ends.  point, radius : m;  axis : its direction"""

    point: tuple[float, float, float]
    axis: tuple[float, float, float]
    radius: float


Obstacle = Plane | Sphere | Cylinder
