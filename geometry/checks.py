"""What a tagged mesh must satisfy before it is solved; run after every meshing and every reading."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from geometry.element_quality import FLAT, quality
from geometry.errors import GeometryError, millimetres, refusal
from geometry.measures import area, area_vectors, body_volume, cavity_volume, face_areas, symmetry_names
from geometry.tagged import TaggedMesh
from geometry.topology import boundary, corner_keys, missing_edges, open_edges, place

if TYPE_CHECKING:
    from geometry.mesher import CadMeasure

SMALLEST, LARGEST = 1e-3, 3.0
"""Largest dimension a body may have, m."""


def check(
    mesh: TaggedMesh,
    *,
    surfaces: Sequence[str] = (),
    volumes: Sequence[str] = (),
    cavity_needed: bool = True,
    cad: CadMeasure | None = None,
) -> None:
    """Run all the checks.

    Parameters
    ----------
    surfaces, volumes : names that must be there (others may be)
    cavity_needed : whether at least one `cavity NAME` must be there
    cad : volumes and areas to be met, where they are known

    Raises
    ------
    GeometryError
        with the group, the element or the place, the likely cause and what to try
    """
    check_numbers(mesh)
    check_groups(mesh, surfaces, volumes, cavity_needed)
    check_extent(mesh)
    check_elements(mesh)
    check_surfaces(mesh)
    check_symmetry(mesh)
    check_cavities(mesh)
    if cad is not None:
        check_against_cad(mesh, cad)


def check_numbers(mesh: TaggedMesh) -> None:
    """Shapes of the arrays, finite coordinates, node numbers in range, every tet in exactly one volume."""
    if mesh.points.ndim != 2 or mesh.points.shape[1] != 3 or mesh.tets.ndim != 2 or not len(mesh.tets):
        raise refusal(
            f"mesh of points {mesh.points.shape} and tets {mesh.tets.shape}",
            "points (n, 3) and at least one tet",
            "a surface mesh, or an empty one",
            "mesh the volumes in gmsh (3D)",
        )
    if mesh.tets.shape[1] not in (4, 10):
        raise refusal(f"tets of {mesh.tets.shape[1]} nodes", "4 or 10")
    bad = np.flatnonzero(~np.isfinite(mesh.points).all(axis=1))
    if len(bad):
        raise refusal(
            f"node {bad[0]} has a coordinate that is not finite", "finite coordinates", "a damaged file"
        )
    for name, nodes in {"tets": mesh.tets, **mesh.surfaces}.items():
        if len(nodes) and not 0 <= nodes.min() <= nodes.max() < len(mesh.points):
            raise refusal(
                f"{name}: node number out of range", f"0 to {len(mesh.points) - 1}", "a damaged file"
            )
    times = np.zeros(len(mesh.tets), dtype=np.int64)
    for part in mesh.volumes.values():
        np.add.at(times, part, 1)
    if (times != 1).any():
        tet = int(np.flatnonzero(times != 1)[0])
        where = place(mesh.points[mesh.tets[tet, :4]].mean(axis=0))
        raise refusal(
            f"element {tet} at {where} is in {times[tet]} named volumes",
            "exactly one",
            "a volume without a physical group, or in two",
            "give every volume one physical group, such as `body`",
        )


def check_groups(
    mesh: TaggedMesh, surfaces: Sequence[str], volumes: Sequence[str], cavity_needed: bool
) -> None:
    """Every needed group is there, and no group is empty."""
    found = ", ".join(f"`{n}`" for n in (*mesh.volumes, *mesh.surfaces)) or "none"
    remedy = "name the physical groups (gmsh) or faces (STEP) so"
    for kind, names, have in (("volume", volumes, mesh.volumes), ("surface", surfaces, mesh.surfaces)):
        missing = [f"`{name}`" for name in names if name not in have]
        if missing:
            raise refusal(f"missing {kind} {', '.join(missing)}", f"groups found: {found}", "", remedy)
        for name, items in have.items():
            if not len(items):
                raise refusal(f"{kind} `{name}` is empty", "at least one element a group", "", remedy)
    if cavity_needed and not mesh.cavities:
        raise refusal("no surface `cavity NAME`", f"groups found: {found}", "", remedy)


def check_extent(mesh: TaggedMesh) -> None:
    """The body is of a size that a soft actuator can have."""
    size = float(np.ptp(mesh.points[np.unique(mesh.tets)], axis=0).max())
    if size < SMALLEST:
        raise refusal(
            f"body of {millimetres(size)}",
            f"{millimetres(SMALLEST)} to {millimetres(LARGEST)}",
            "mesh in metres said to be mm",
            "unit = 'm'",
        )
    if size > LARGEST:
        raise refusal(
            f"body of {size:.4g} m",
            f"{millimetres(SMALLEST)} to {millimetres(LARGEST)}",
            "mesh in mm said to be metres",
            "unit = 'mm'",
        )


def check_elements(mesh: TaggedMesh) -> None:
    """No element is inverted or flat."""
    report = quality(mesh)
    if not report.worst >= FLAT:
        kind = "inverted" if report.worst < 0 else "flat"
        total = report.inverted + report.flat
        raise refusal(
            f"{kind} element {report.worst_element} at {place(report.worst_at)}, scaled Jacobian "
            f"{report.worst:.3g} ({report.inverted} inverted, {report.flat} flat of {report.elements})",
            f"at least {FLAT:g}",
            "a node moved across a face, or a coarse curved element on a thin wall"
            if total < 20
            else "a damaged mesh",
            "a finer mesh, or gmsh's Optimize / HighOrderOptimize",
        )


def check_surfaces(mesh: TaggedMesh) -> None:
    """All surfaces but layers lie on the boundary with the normal out; cavities share no face with others."""
    count = len(mesh.points)
    shell = boundary(mesh)
    signed = {tuple(f) for f in _rolled(shell).tolist()} if len(shell) < 2_000_000 else None
    keys = np.sort(corner_keys(shell, count))
    owner: dict[str, np.ndarray] = {}
    for name, faces in mesh.surfaces.items():
        if name.startswith("layer "):
            continue
        mine = corner_keys(faces, count)
        spot = np.minimum(np.searchsorted(keys, mine), len(keys) - 1)
        inside = np.flatnonzero(keys[spot] != mine)
        if len(inside):
            raise refusal(
                f"surface `{name}`: {len(inside)} of {len(faces)} triangles lie inside the body, first "
                f"{place(mesh.points[faces[inside[0], :3]].mean(axis=0))}",
                "boundary faces (inner surfaces are called `layer NAME`)",
                "two volumes that touch, with the face between them in the group",
            )
        if signed is not None and any(tuple(face) not in signed for face in _rolled(faces).tolist()):
            raise refusal(
                f"surface `{name}` has triangles whose normal points into the body", "normals out of it"
            )
        if len(np.unique(mine)) != len(mine):
            raise refusal(
                f"surface `{name}` has the same triangle twice", "each triangle once", "a group made twice"
            )
        owner[name] = mine
    for name in owner:
        if name.startswith("cavity ") or name == "symmetry" or name.startswith("symmetry "):
            for other, theirs in owner.items():
                if other != name and np.isin(owner[name], theirs).any():
                    raise refusal(f"surfaces `{name}` and `{other}` share faces", "each face in one of them")


def _rolled(faces: np.ndarray) -> np.ndarray:
    """Corners of triangles, turned so that the smallest comes first (the orientation is kept)."""
    corners = faces[:, :3]
    first = np.argmin(corners, axis=1)
    return np.take_along_axis(corners, (first[:, None] + np.arange(3)) % 3, axis=1)


def check_symmetry(mesh: TaggedMesh) -> None:
    """Every symmetry surface is plane."""
    size = float(np.ptp(mesh.points, axis=0).max())
    for name in symmetry_names(mesh):
        faces = mesh.surfaces[name]
        total = area_vectors(mesh.points, faces).sum(axis=0)
        whole = face_areas(mesh.points, faces).sum()
        nodes = mesh.points[np.unique(faces)]
        normal = total / max(float(np.linalg.norm(total)), 1e-300)
        off = np.abs((nodes - nodes[0]) @ normal)
        if np.linalg.norm(total) < (1 - 1e-9) * whole - 1e-12 * size**2 or off.max() > 1e-6 * size:
            worst = nodes[int(np.argmax(off))]
            raise refusal(
                f"surface `{name}` is not plane: off by {millimetres(float(off.max()))} at {place(worst)}",
                "one plane a symmetry surface",
                "faces of another surface in the group, or two planes under one name",
                "several planes are called `symmetry x`, `symmetry y`, `symmetry z`",
            )


def check_cavities(mesh: TaggedMesh) -> None:
    """Every cavity is closed, but for its edges on symmetry planes, and encloses air."""
    planes = symmetry_names(mesh)
    normals = [area_vectors(mesh.points, mesh.surfaces[n]).sum(axis=0) for n in planes]
    for name in mesh.cavities:
        faces = mesh.surfaces[f"cavity {name}"]
        loose = missing_edges(open_edges(faces), [mesh.surfaces[n] for n in planes])
        if len(loose):
            raise refusal(
                f"cavity `{name}` is open: {len(loose)} free edges, the first at "
                f"{place(mesh.points[loose[0]].mean(axis=0))}",
                "a closed surface (edges may end on a symmetry surface)",
                "an air inlet, or a face that was left out of the group",
                "close the inlet in the drawing and put every wall of the chamber into the group",
            )
        vectors = area_vectors(mesh.points, faces)
        rest = vectors.sum(axis=0)
        if normals:
            base = np.array(normals) / np.linalg.norm(normals, axis=1)[:, None]
            rest = rest - base.T @ np.linalg.lstsq(base.T, rest, rcond=None)[0]
        total = float(face_areas(mesh.points, faces).sum())
        if np.linalg.norm(rest) > 1e-9 * total:
            raise refusal(
                f"cavity `{name}`: area vectors sum to {np.linalg.norm(rest) / total:.2g} of its area",
                "zero, with the symmetry plane counted",
                "a chamber that is cut by a plane which is no symmetry surface",
            )
        volume = cavity_volume(mesh, name)
        if not volume > 0:
            raise refusal(
                f"cavity `{name}` encloses {volume * 1e9:.4g} mm^3",
                "a positive volume of air",
                "the outside of the body was named a cavity",
            )


def check_against_cad(mesh: TaggedMesh, cad: CadMeasure) -> None:
    """Volumes and areas of the groups are those of the CAD, within what their order can do."""
    allowed = 0.01 if cad.curved else 0.15
    for kind, wanted, measure in (("volume", cad.volumes, body_volume), ("surface", cad.areas, area)):
        for name, value in wanted.items():
            mine = measure(mesh, name)
            if abs(mine - value) > allowed * value:
                raise GeometryError(
                    f"{kind} `{name}` of the mesh differs from the drawing by {mine / value - 1:+.2%}; "
                    f"allowed: {allowed:.0%}; likely cause: elements too coarse for the round walls; "
                    "try: a smaller element size, or order 2"
                )
