"""Obstacles of a deck -> rigid bodies in SI, outside the body at rest and symmetric where it is cut."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from fem_spa.deck import Deck
from fem_spa.deck_tables import Measure
from fem_spa.deck_tables import Obstacle as ObstacleTable
from fem_spa.errors import InputError
from fem_spa.solid.obstacles import Cylinder, Obstacle, Plane, Sphere
from fem_spa.units import show
from geometry.tagged import TaggedMesh

NEAR = 1e-6
"""m: a body that is no deeper than this in an obstacle at rest rests on it."""


def obstacles(deck: Deck, mesh: TaggedMesh, symmetry: Mapping[str, str]) -> tuple[Obstacle, ...]:
    """The obstacles of [loads], in order.

    Parameters
    ----------
    mesh : for the body at rest and its planes of symmetry
    symmetry : surface -> axis of its normal

    Raises
    ------
    InputError
        A direction has no length, the body at rest is in an obstacle, or a plane of symmetry would give
        the obstacle an image elsewhere.
    """
    found = []
    for number, table in enumerate(deck.loads.obstacles or []):
        obstacle, where = _read(table, f"loads.obstacles.{number}")
        _check_clear(obstacle, mesh, where)
        _check_symmetry(obstacle, mesh, symmetry, where)
        found.append(obstacle)
    return tuple(found)


def _read(table: ObstacleTable, where: str) -> tuple[Obstacle, str]:
    """The obstacle of one entry, and the dotted name of its table."""
    if table.plane is not None:
        where = f"{where}.plane"
        direction = _direction(table.plane.normal, f"{where}.normal")
        return Plane(_point(table.plane.point), direction), where
    if table.cylinder is not None:
        where = f"{where}.cylinder"
        direction = _direction(table.cylinder.axis, f"{where}.axis")
        return Cylinder(_point(table.cylinder.point), direction, table.cylinder.radius.si), where
    assert table.sphere is not None
    radius = table.sphere.radius
    size = radius.si if isinstance(radius, Measure) else _point(radius)
    return Sphere(_point(table.sphere.centre), size), f"{where}.sphere"


def _point(values: Any) -> tuple[float, float, float]:
    x, y, z = (value.si for value in values)
    return x, y, z


def _direction(values: Any, where: str) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    if not any((x, y, z)):
        raise InputError(f"given [0, 0, 0] for {where}: a direction has a length, for example [0, 0, 1]")
    return x, y, z


def _check_clear(obstacle: Obstacle, mesh: TaggedMesh, where: str) -> None:
    from fem_spa.solid.obstacle_distance import distance

    gap = distance(obstacle, mesh.points)[0]
    worst = int(np.argmin(gap))
    if gap[worst] < -NEAR:
        at = ", ".join(f"{1e3 * c:.1f}" for c in mesh.points[worst])
        depth = show(float(f"{-gap[worst]:.3g}"), "m")
        hint = " (the normal points out of the obstacle, towards the body)" if "plane" in where else ""
        raise InputError(
            f"{where}: the body at rest is {depth} deep in it at ({at}) mm; it must be outside: "
            f"move the obstacle{hint}"
        )


def _check_symmetry(obstacle: Obstacle, mesh: TaggedMesh, symmetry: Mapping[str, str], where: str) -> None:
    size = float(np.ptp(mesh.points, axis=0).max())
    for name, i, level in _planes(mesh, symmetry):
        if not _is_own_image(obstacle, i, level, 1e-9 * size):
            raise InputError(
                f"{where}: its mirror image in the plane of symmetry '{name}' ({'xyz'[i]} = "
                f"{show(float(f'{level:.6g}'), 'm')}) is another obstacle; centre it on that plane, "
                "or mesh the whole actuator"
            )


def _planes(mesh: TaggedMesh, symmetry: Mapping[str, str]) -> Iterator[tuple[str, int, float]]:
    """Name, axis number and coordinate (m) of every plane of symmetry."""
    for name, axis in symmetry.items():
        i = "xyz".index(axis)
        yield name, i, float(mesh.points[mesh.surfaces[name][:, :3], i].mean())


def _is_own_image(obstacle: Obstacle, i: int, level: float, near: float) -> bool:
    if isinstance(obstacle, Plane):
        return bool(abs(obstacle.normal[i]) <= 1e-9 * np.linalg.norm(obstacle.normal))
    if isinstance(obstacle, Sphere):
        return abs(obstacle.centre[i] - level) <= near
    along = np.asarray(obstacle.axis) / np.linalg.norm(obstacle.axis)
    across = abs(abs(along[i]) - 1.0) <= 1e-9
    return bool(across or (abs(along[i]) <= 1e-9 and abs(obstacle.point[i] - level) <= near))
