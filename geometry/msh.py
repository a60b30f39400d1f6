"""gmsh .msh files through meshio, behind this one module."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Any

import numpy as np

from geometry.errors import GeometryError, refusal
from geometry.tagged import TaggedMesh
from geometry.topology import oriented

_TETS = {"tetra": 4, "tetra10": 10}
_TRIANGLES = {"triangle": 3, "triangle6": 6}
_IGNORED = {"vertex", "line", "line3", *_TRIANGLES}


def read_msh(path: Path, scale: float) -> TaggedMesh:
    """A .msh file as a tagged mesh, oriented, not yet checked.

    Parameters
    ----------
    scale : m a unit of the file's numbers

    Raises
    ------
    GeometryError
        where the file is damaged, has no tets, or has cells other than tets
    """
    raw = _read(path)
    kinds = {block.type for block in raw.cells}
    foreign = sorted(kinds - _IGNORED - set(_TETS))
    if foreign:
        raise refusal(
            f"{path.name}: cells of type {', '.join(foreign)}",
            "tets of 4 or 10 nodes",
            "recombined or transfinite meshing",
            "mesh with tets in gmsh",
        )
    tet_kinds = sorted(kinds & set(_TETS))
    if len(tet_kinds) != 1:
        raise refusal(
            f"{path.name}: {' and '.join(tet_kinds) or 'no tets'}",
            "tets of one order",
            "" if tet_kinds else "a surface mesh, or volumes without a physical group",
            "mesh the volumes (3D) and give them a physical group",
        )
    if raw.points.shape[1] != 3:
        raise refusal(f"{path.name}: {raw.points.shape[1]} coordinates a point", "3")
    groups = _groups(raw)
    tets, volumes, notes = _volumes(raw, groups, tet_kinds[0])
    surfaces: dict[str, list[np.ndarray]] = {}
    for block, names in zip(raw.cells, groups, strict=True):
        if block.type in _TRIANGLES:
            for name, rows in names.items():
                surfaces.setdefault(name, []).append(np.asarray(block.data)[rows, :3])
    used, inverse = np.unique(tets, return_inverse=True)
    row = np.full(len(raw.points), -1, dtype=np.int64)
    row[used] = np.arange(len(used))
    faces = {name: row[np.vstack(parts)] for name, parts in surfaces.items()}
    for name, block in faces.items():
        if (block < 0).any():
            raise refusal(
                f"{path.name}: surface `{name}` has nodes that no tet has",
                "faces of tets",
                "surface and volume were meshed apart",
                "mesh them together in one gmsh model",
            )
    mesh = TaggedMesh(
        points=np.asarray(raw.points, dtype=float)[used] * scale,
        tets=inverse.reshape(tets.shape).astype(np.int64),
        volumes=volumes,
        surfaces=faces,
        source=f"file {path.name}",
        notes=notes,
    )
    from geometry.files import surface_and_rest

    return surface_and_rest(oriented(mesh))


def _read(path: Path) -> Any:
    """meshio's mesh; whatever it says or raises becomes one GeometryError."""
    from meshio import gmsh

    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            mesh = gmsh.read(path)
            reached = max((int(block.data.max()) for block in mesh.cells if block.data.size), default=-1)
    except (Exception, SystemExit) as error:  # damaged files make meshio raise whatever its parser meets
        words = str(error).strip() or said.getvalue().strip() or type(error).__name__
        raise GeometryError(
            f"{path.name}: not a readable gmsh .msh file ({words[:120]}); allowed: MSH 2.2, 4.0 or 4.1; "
            "likely cause: another format or a damaged file; try: save it again from gmsh"
        ) from error
    if reached >= len(mesh.points):
        raise refusal(
            f"{path.name}: an element names a node that is not there", "a whole file", "a damaged file"
        )
    return mesh


def _groups(raw: Any) -> list[dict[str, np.ndarray]]:
    """For every cell block: physical name -> its rows of that block."""
    titles = {(int(dim), int(tag)): name for name, (tag, dim) in raw.field_data.items()}
    physical = raw.cell_data.get("gmsh:physical")
    out: list[dict[str, np.ndarray]] = []
    for index, block in enumerate(raw.cells):
        found: dict[str, np.ndarray] = {}
        dim = 3 if block.type in _TETS else 2 if block.type in _TRIANGLES else 1
        for (its_dim, _), name in titles.items():
            rows = raw.cell_sets.get(name)
            if its_dim == dim and rows is not None and rows[index] is not None and len(rows[index]):
                found[name] = np.asarray(rows[index], dtype=np.int64)
        if physical is not None and not found:
            for tag in np.unique(physical[index]):
                name = titles.get((dim, int(tag)), f"physical {int(tag)}")
                if tag > 0:
                    found[name] = np.flatnonzero(np.asarray(physical[index]) == tag)
        out.append(found)
    return out


def _volumes(
    raw: Any, groups: list[dict[str, np.ndarray]], kind: str
) -> tuple[np.ndarray, dict[str, np.ndarray], tuple[str, ...]]:
    """All tets, the element numbers of every named volume, and notes."""
    blocks: list[np.ndarray] = []
    members: dict[str, list[np.ndarray]] = {}
    start = 0
    for block, names in zip(raw.cells, groups, strict=True):
        if block.type != kind:
            continue
        blocks.append(np.asarray(block.data))
        for name, rows in names.items():
            members.setdefault(name, []).append(start + rows)
        start += len(block.data)
    if not members:
        return np.vstack(blocks), {"body": np.arange(start)}, ("volumes without a name were called `body`",)
    return np.vstack(blocks), {name: np.concatenate(parts) for name, parts in members.items()}, ()


def as_meshio(mesh: TaggedMesh, scale: float, named_fields: bool) -> Any:
    """A tagged mesh as a meshio mesh: tets and named triangles.

    Parameters
    ----------
    scale : m a unit of the numbers to be written
    named_fields : True: one 0/1 cell field a group (ParaView); False: gmsh physical groups
    """
    import meshio

    second = mesh.tets.shape[1] == 10
    cells: list[tuple[str, np.ndarray]] = []
    tags: list[int] = []
    field_data: dict[str, np.ndarray] = {}
    for number, (name, rows) in enumerate(mesh.volumes.items(), start=1):
        cells.append(("tetra10" if second else "tetra", mesh.tets[rows]))
        field_data[name] = np.array([number, 3])
        tags.append(number)
    for number, (name, faces) in enumerate(mesh.surfaces.items(), start=1):
        cells.append(("triangle6" if second else "triangle", faces))
        field_data[name] = np.array([number, 2])
        tags.append(number)
    points = mesh.points / scale
    if named_fields:
        names = [*mesh.volumes, *mesh.surfaces]
        lengths = [len(block) for _, block in cells]
        fields = {
            name: [np.full(n, int(k == own), dtype=np.int8) for k, n in enumerate(lengths)]
            for own, name in enumerate(names)
        }
        return meshio.Mesh(points, cells, cell_data=fields)
    marks = [np.full(len(block), tag, dtype=np.int32) for tag, (_, block) in zip(tags, cells, strict=True)]
    data = {"gmsh:physical": marks, "gmsh:geometrical": [mark.copy() for mark in marks]}
    return meshio.Mesh(points, cells, cell_data=data, field_data=field_data)
