"""Meshes kept in a folder, one a drawing, for runs that differ in materials and loads only.

A kept mesh is the one that meshing gave, to the last bit (meshing the same drawing twice gives points that
differ by some 1e-18 m); its file is whole or not there, and of two written at once the first one stays.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import uuid
import zipfile
from collections.abc import Callable
from dataclasses import asdict
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa import __version__
from fem_spa.deck import Drawing
from fem_spa.errors import InputError
from fem_spa.output.files import write_whole
from geometry.tagged import TaggedMesh


def mesh_key(drawing: Drawing, shape: Any) -> str:
    """Digest of all that a mesh depends on: the shape's lengths or the file's content, element size, mesher.

    Parameters
    ----------
    shape : the built-in one (`fem_spa.prepare.built_in`); None for a file

    Raises
    ------
    InputError
        The file cannot be read.
    """
    geometry = drawing.geometry
    what: dict[str, Any] = {"gmsh": _mesher(), "fem_spa": __version__}
    what["size"] = None if geometry.size is None else geometry.size.si
    if shape is not None:
        what |= {
            "shape": geometry.shape,
            "lengths": asdict(shape),
            "size": what["size"] or shape.default_size,
        }
    else:
        path = drawing.folder / str(geometry.file)
        try:
            what |= {"file": hashlib.sha256(path.read_bytes()).hexdigest(), "unit": geometry.unit}
        except OSError as error:
            raise InputError(
                f"given {path} for geometry.file: it cannot be read ({error.strerror})"
            ) from None
    text = json.dumps(what, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@cache
def _mesher() -> str:
    return version("gmsh")


def place(folder: Path, key: str) -> Path:
    """Where the mesh of a key is kept."""
    return folder / f"{key}.npz"


def kept(folder: Path, drawing: Drawing, shape: Any, make: Callable[[], TaggedMesh]) -> TaggedMesh:
    """The mesh of a drawing: read from `folder`, or made and written there."""
    path = place(folder, mesh_key(drawing, shape))
    found = read_kept(path)
    if found is None:
        path.unlink(missing_ok=True)  # a damaged one
        fresh = make()
        folder.mkdir(parents=True, exist_ok=True)
        _write_first(path, _bytes(fresh))
        found = read_kept(path) or fresh
    return found


def has(folder: Path, drawing: Drawing, shape: Any) -> bool:
    """Whether `kept` has something to read."""
    return folder.is_dir() and place(folder, mesh_key(drawing, shape)).is_file()


def keep(folder: Path, drawing: Drawing, shape: Any, mesh: TaggedMesh) -> None:
    """Write the mesh of a drawing where `kept` finds it, in the place of all that are there."""
    folder.mkdir(parents=True, exist_ok=True)
    path = place(folder, mesh_key(drawing, shape))
    write_whole(path, _bytes(mesh))
    for other in folder.glob("*.npz"):
        if other != path:
            other.unlink(missing_ok=True)


def _write_first(path: Path, content: bytes) -> None:
    """Write a file that is not there yet; where another has written it meanwhile, that one stays."""
    beside = path.with_name(f"{path.stem}.{uuid.uuid4().hex}.part")
    write_whole(beside, content)
    try:
        os.link(beside, path)
    except FileExistsError:
        pass
    except OSError:  # a file system without links
        os.replace(beside, path)
    beside.unlink(missing_ok=True)


def _bytes(mesh: TaggedMesh) -> bytes:
    arrays: dict[str, np.ndarray] = {"points": mesh.points, "tets": mesh.tets}
    names = {"volumes": list(mesh.volumes), "surfaces": list(mesh.surfaces)}
    arrays |= {f"volume{i}": rows for i, rows in enumerate(mesh.volumes.values())}
    arrays |= {f"surface{i}": faces for i, faces in enumerate(mesh.surfaces.values())}
    about = json.dumps({**names, "source": mesh.source, "notes": list(mesh.notes), "hash": mesh.hash()})
    buffer = io.BytesIO()
    np.savez(buffer, about=np.array(about), **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


def read_kept(path: Path) -> TaggedMesh | None:
    """None where there is none, or its file is damaged."""
    try:
        with np.load(path, allow_pickle=False) as file:
            about = json.loads(str(file["about"]))
            mesh = TaggedMesh(
                points=file["points"],
                tets=file["tets"],
                volumes={name: file[f"volume{i}"] for i, name in enumerate(about["volumes"])},
                surfaces={name: file[f"surface{i}"] for i, name in enumerate(about["surfaces"])},
                source=about["source"],
                notes=tuple(about["notes"]),
            )
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    return mesh if mesh.hash() == about["hash"] else None
