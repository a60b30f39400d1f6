"""Reading a user's mesh or drawing, and writing a tagged mesh for gmsh and ParaView."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from geometry.checks import check
from geometry.errors import GeometryError, refusal
from geometry.tagged import TaggedMesh

UNITS: dict[str, float] = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
"""Units of a file's numbers, in m."""

MOST_BYTES = 1_000_000_000
"""Of a file that is read: a mesh of some million elements. Looked at before memory is taken."""

READABLE = (".msh", ".step", ".stp")
WRITABLE = (".msh", ".vtu")


def unit_factor(unit: str | None, path: Path) -> float:
    """Metres a unit of the file's numbers.

    Raises
    ------
    GeometryError
        where the unit is missing or unknown
    """
    if unit is None:
        raise refusal(
            f"{path.name}: no unit", ", ".join(UNITS), "a .msh file does not say its unit", "unit = 'mm'"
        )
    if unit not in UNITS:
        raise refusal(f"{path.name}: unit {unit!r}", ", ".join(UNITS))
    return UNITS[unit]


def read_mesh(
    path: str | Path,
    unit: str | None = None,
    size: float | None = None,
    order: int = 2,
    required: Sequence[str] = ("base", "tip"),
) -> TaggedMesh:
    """Read a gmsh .msh or a STEP file whose groups have the names of design.md.

    Volumes may have any names (a single unnamed one becomes `body`). At least one surface
    `cavity NAME` must be there. Boundary faces without a name are added to `outer`.

    Parameters
    ----------
    path : .msh (any version that meshio reads; 4- or 10-node tets), .step or .stp
    unit : "m", "cm", "mm", "um" or "in": of the file's numbers. A STEP file states its own unit,
        which is used where none is given; a .msh file does not, so there it is needed
    size : element size, m; STEP only; None: a twentieth of the largest dimension
    order : 1 or 2; STEP only (a .msh keeps its order; see to_second_order)
    required : surfaces that must be there

    Returns
    -------
    TaggedMesh
        in m, right-handed, boundary normals out of the body, checked (geometry.checks)

    Raises
    ------
    GeometryError
        where the file cannot be read, groups are missing (those found are named) or the mesh is bad
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in READABLE:
        raise refusal(f"{path.name}: file type {suffix!r}", ", ".join(READABLE))
    if not path.is_file():
        raise refusal(f"{path}: no such file", "a file that exists", "a path relative to another folder")
    if path.stat().st_size > MOST_BYTES:
        raise refusal(
            f"{path.name}: {path.stat().st_size / 1e9:.3g} GB",
            f"at most {MOST_BYTES / 1e9:g} GB",
            "",
            "a coarser mesh",
        )
    if suffix == ".msh":
        from geometry.msh import read_msh

        if size is not None:
            raise refusal(
                f"{path.name}: element size given", "none: a .msh file is meshed already", "", "a STEP file"
            )
        mesh = read_msh(path, unit_factor(unit, path))
        cad = None
    else:
        from geometry.step import mesh_step

        mesh, cad = mesh_step(path, None if unit is None else unit_factor(unit, path), size, order)
    check(mesh, surfaces=required, cad=cad)
    return mesh


def write_mesh(mesh: TaggedMesh, path: str | Path, unit: str = "m") -> Path:
    """Write a mesh as .msh (gmsh 2.2 with physical names; read_mesh reads it back) or .vtu (ParaView).

    Parameters
    ----------
    path : file to write; its folder must exist
    unit : of the numbers in the file

    Returns
    -------
    Path
        of the file written

    Raises
    ------
    GeometryError
        where the ending or the unit is unknown, or the file cannot be written
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in WRITABLE:
        raise refusal(f"{path.name}: file type {suffix!r}", ", ".join(WRITABLE))
    scale = unit_factor(unit, path)
    from geometry.msh import as_meshio

    content = as_meshio(mesh, scale, named_fields=suffix == ".vtu")
    try:
        if suffix == ".msh":
            from meshio import gmsh

            gmsh.write(path, content, fmt_version="2.2", binary=False, float_fmt=".16e")
        else:
            from meshio import vtu

            vtu.write(path, content)
    except OSError as error:
        raise GeometryError(f"{path}: cannot be written ({error.strerror or error})") from error
    return path


def surface_and_rest(mesh: TaggedMesh) -> TaggedMesh:
    """The mesh with every boundary face that has no name added to `outer` (and a note where any was)."""
    from dataclasses import replace

    from geometry.topology import boundary, corner_keys

    shell = boundary(mesh)
    count = len(mesh.points)
    named = [corner_keys(faces, count) for faces in mesh.surfaces.values()]
    rest = shell[~np.isin(corner_keys(shell, count), np.concatenate(named))] if named else shell
    if not len(rest):
        return mesh
    outer = mesh.surfaces.get("outer")
    surfaces = dict(mesh.surfaces)
    surfaces["outer"] = rest if outer is None else np.vstack([outer, rest])
    note = f"{len(rest)} boundary triangles without a name were added to `outer`"
    return replace(mesh, surfaces=surfaces, notes=(*mesh.notes, note))
