"""gmsh, started for one job and gone after it: quiet, one thread, repeatable."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from geometry.errors import GeometryError

MM = 1e-3
"""CAD is drawn in mm: OpenCASCADE's tolerance of 1e-7 is absolute, too coarse for numbers in metres."""

_LOCK = threading.RLock()  # gmsh is one global state a process

_OPTIONS: dict[str, float] = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Mesh.RandomSeed": 1,
    "Mesh.RandomFactor": 1e-9,
    "Mesh.RandomFactor3D": 1e-12,
    "Geometry.OCCParallel": 0,
    "Geometry.OCCImportLabels": 1,
    "Mesh.Algorithm": 6,
    "Mesh.MaxNumThreads1D": 1,
    "Mesh.MaxNumThreads2D": 1,
    "Mesh.MaxNumThreads3D": 1,
}


@contextmanager
def silence() -> Iterator[None]:
    """Keep what C++ code writes to file descriptor 1 from the terminal.

    OpenCASCADE's STEP reader and gmsh's Delaunay code print there, past gmsh's option General.Terminal.
    """
    sys.stdout.flush()
    kept = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(nowhere)
        os.close(kept)


@contextmanager
def session() -> Iterator[Any]:
    """gmsh with an empty model; whatever it says or leaves is gone afterwards.

    Where the caller has gmsh running already, its models and options are kept as they were.

    Raises
    ------
    GeometryError
        in place of every error of gmsh, with gmsh's last words
    """
    import gmsh

    with _LOCK:
        nested = bool(gmsh.isInitialized())
        kept: dict[str, float] = {}
        current = ""
        if nested:
            current = gmsh.model.getCurrent()
            kept = {name: gmsh.option.getNumber(name) for name in _OPTIONS}
        else:
            gmsh.initialize(argv=[], readConfigFiles=False, interruptible=False)
        try:
            for name, value in _OPTIONS.items():
                gmsh.option.setNumber(name, value)
            gmsh.model.add("fem_spa")
            try:
                yield gmsh
            except GeometryError:
                raise
            except Exception as error:  # gmsh raises plain Exception
                if type(error) is not Exception:
                    raise
                raise GeometryError(
                    f"gmsh could not do it: {error}; try another element size or other sizes"
                ) from error
        finally:
            if nested:
                gmsh.model.remove()
                for name, value in kept.items():
                    gmsh.option.setNumber(name, value)
                if current:
                    gmsh.model.setCurrent(current)
            else:
                gmsh.finalize()
