"""Solids, voids and planes drawn in gmsh's OpenCASCADE kernel -> named parts of one body."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from geometry.errors import GeometryError

DimTag = tuple[int, int]
FLAT = 1e-5
"""Distance in mm within which a face counts as lying in a plane."""


@dataclass(frozen=True)
class Plane:
    """The plane where coordinate `axis` (0, 1, 2) has the value `at`, mm.

    Only faces count whose other coordinates stay within `reach` of zero.
    """

    axis: int
    at: float
    reach: float = math.inf


@dataclass
class Parts:
    """What a shape has drawn, before it is cut into one another.

    Attributes
    ----------
    volumes : name -> solids (dim 3 tags); where two overlap the earlier name keeps the common part
    cavities : network name -> solids that are taken out of the body
    layers : layer name -> surfaces (dim 2 tags) inside the body
    planes : surface name -> planes; a boundary face in one of them gets the name; earlier names first
    """

    volumes: dict[str, list[int]]
    cavities: dict[str, list[int]] = field(default_factory=dict)
    layers: dict[str, list[int]] = field(default_factory=dict)
    planes: dict[str, list[Plane]] = field(default_factory=dict)


@dataclass(frozen=True)
class Named:
    """Entities of the current gmsh model by the name of their group (dim 3 and dim 2 tags)."""

    volumes: dict[str, list[int]]
    surfaces: dict[str, list[int]]


def fuse(gmsh: Any, solids: Sequence[int]) -> list[int]:
    """Unite solids; coplanar faces become one."""
    if len(solids) == 1:
        return list(solids)
    united, _ = gmsh.model.occ.fuse([(3, solids[0])], [(3, tag) for tag in solids[1:]])
    return [tag for _, tag in united]


def split(gmsh: Any, parts: Parts) -> Named:
    """Cut the parts into one another, take the voids out, and name every face.

    The voids are cut as solids and then removed, so that the faces of a cavity are known by
    topology (they lie between the body and that void), not by a guess from coordinates.

    Raises
    ------
    GeometryError
        where a cavity, a layer or a volume is not there after the cut
    """
    occ = gmsh.model.occ
    inputs: list[DimTag] = []
    owners: list[tuple[str, str]] = []
    for kind, dim, groups in (
        ("volume", 3, parts.volumes),
        ("cavity", 3, parts.cavities),
        ("layer", 2, parts.layers),
    ):
        for name, tags in groups.items():
            inputs += [(dim, tag) for tag in tags]
            owners += [(kind, name)] * len(tags)
    if len(inputs) > 1:
        _, pieces = occ.fragment(inputs[:1], inputs[1:])
    else:
        pieces = [inputs]
    by_owner: dict[tuple[str, str], set[int]] = {}
    for owner, outcome in zip(owners, pieces, strict=True):
        by_owner.setdefault(owner, set()).update(tag for _, tag in outcome)

    voids = {name: by_owner[("cavity", name)] for name in parts.cavities}
    taken = set().union(*voids.values()) if voids else set()
    volumes: dict[str, list[int]] = {}
    for name in parts.volumes:
        volumes[name] = sorted(by_owner[("volume", name)] - taken)
        taken |= set(volumes[name])
        if not volumes[name]:
            raise GeometryError(f"volume `{name}` is empty after the cavities were cut out; make it larger")
    solid = [(3, tag) for tags in volumes.values() for tag in tags]
    occ.synchronize()
    boundary = {abs(tag) for _, tag in gmsh.model.getBoundary(solid, combined=True, oriented=False)}
    inside = {abs(tag) for _, tag in gmsh.model.getBoundary(solid, combined=False, oriented=False)} - boundary

    surfaces: dict[str, list[int]] = {}
    for name, air in voids.items():
        faces = {
            abs(t) for _, t in gmsh.model.getBoundary([(3, t) for t in air], combined=True, oriented=False)
        }
        surfaces[f"cavity {name}"] = sorted(faces & boundary)
    for name in parts.layers:
        surfaces[f"layer {name}"] = sorted(by_owner[("layer", name)] & inside)
    rest = boundary - {tag for tags in surfaces.values() for tag in tags}
    for name, planes in parts.planes.items():
        surfaces[name] = sorted(tag for tag in rest if any(lies_in(gmsh, tag, plane) for plane in planes))
        rest -= set(surfaces[name])
    if rest:
        surfaces["outer"] = sorted(rest)
    for name, faces_of in surfaces.items():
        if not faces_of:
            raise GeometryError(f"surface `{name}` is empty after the cavities were cut out; check the sizes")
    keep = {tag for tags in volumes.values() for tag in tags}
    occ.remove([(3, t) for _, t in gmsh.model.getEntities(3) if t not in keep], recursive=True)
    needed = boundary | inside
    occ.remove([(2, t) for _, t in occ.getEntities(2) if t not in needed], recursive=True)
    occ.synchronize()
    return Named(volumes, surfaces)


def lies_in(gmsh: Any, face: int, plane: Plane) -> bool:
    """Whether a face lies in a plane, by its bounding box."""
    box = gmsh.model.occ.getBoundingBox(2, face)
    if max(abs(box[plane.axis] - plane.at), abs(box[plane.axis + 3] - plane.at)) > FLAT:
        return False
    return all(abs(box[k]) < plane.reach + FLAT for k in range(6) if k % 3 != plane.axis)


def polygon(gmsh: Any, points: Iterable[tuple[float, float, float]]) -> int:
    """A plane face from its corners, mm."""
    occ = gmsh.model.occ
    corners = [occ.addPoint(*point) for point in points]
    lines = [occ.addLine(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    return int(occ.addPlaneSurface([occ.addCurveLoop(lines)]))


def extrude(gmsh: Any, face: int, vector: tuple[float, float, float]) -> int:
    """The solid that a face sweeps along a vector, mm."""
    made = gmsh.model.occ.extrude([(2, face)], *vector)
    return next(int(tag) for dim, tag in made if dim == 3)


def box(gmsh: Any, low: tuple[float, float, float], high: tuple[float, float, float]) -> int:
    """A box between two corners, mm."""
    return int(gmsh.model.occ.addBox(*low, *(b - a for a, b in zip(low, high, strict=True))))
