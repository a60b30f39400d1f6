"""Named parts in gmsh -> tetrahedra -> TaggedMesh, with the CAD's own volumes and areas beside it."""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from geometry.cad import Named
from geometry.errors import GeometryError, millimetres, refusal
from geometry.session import session, silence
from geometry.tagged import TaggedMesh

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

MOST_ELEMENTS = 3_000_000
HXT, DELAUNAY = 10, 1  # gmsh's numbers of its algorithms for volumes
ATTEMPTS = ((8, HXT), (12, HXT), (16, DELAUNAY), (32, HXT), (32, DELAUNAY))
"""Elements a full turn of a round wall, and algorithm: tried in turn until the mesh is good.

Two curved elements a quarter turn at least: below that a round wall loses more than 1 % of its area.
"""
GOOD = 0.01
"""gmsh's signed inverse condition number that ends the attempts."""

# gmsh's ten-node tet ends with the edges 23, 13; ours (VTK) with 13, 23
GMSH_TET10 = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]


@dataclass(frozen=True)
class CadMeasure:
    """Volumes (m^3) and areas (m^2) of the named groups as the CAD kernel has them.

    `curved` says whether the mesh follows curved walls (order 2), which sets how near it must come.
    """

    volumes: dict[str, float]
    areas: dict[str, float]
    curved: bool


def check_request(size: float, order: int, extent: float) -> None:
    """Refuse an element size or an order that cannot be meant.

    Raises
    ------
    GeometryError
        where order is not 1 or 2, or size is not a number in m between 10 micrometres and `extent`
    """
    if order not in (1, 2):
        raise refusal(f"order = {order!r}", "1 (straight four-node tets) or 2 (curved ten-node tets)")
    if isinstance(size, bool) or not isinstance(size, numbers.Real) or not math.isfinite(size):
        raise refusal(f"element size {size!r}", "a finite length in m")
    if size > extent:
        raise refusal(
            f"element size {millimetres(size)}",
            f"at most the body's largest dimension, {millimetres(extent)}",
            "mm given where m are meant" if size > 0.1 else "",
            "a quarter of the body's smallest outer dimension or less",
        )
    if size < 1e-5:
        raise refusal(
            f"element size {millimetres(size)}",
            "at least 0.01 mm",
            "m said to be mm" if size > 0 else "",
            f"{millimetres(extent / 40)}",
        )


def estimate_elements(volume: float, area: float, size: float) -> float:
    """About how many tets a body of a volume (m^3) and a surface (m^2) gets at an element size (m)."""
    return volume / (0.10 * size**3) + 1.5 * area / (0.433 * size**2)


def mesh_named(
    build: Callable[[Any], tuple[Named, float]],
    size: float,
    order: int,
    source: str,
    examine: Callable[[TaggedMesh, CadMeasure], None] = lambda mesh, cad: None,
) -> tuple[TaggedMesh, CadMeasure]:
    """Build a model in gmsh, mesh it, and take the mesh out; with finer round walls where that fails.

    Every attempt has a gmsh of its own, as gmsh refuses to mesh again after a failure.

    Parameters
    ----------
    build : draws or imports into the gmsh it is given; returns volumes and surfaces by name, and the
        metres a unit of the model
    size : element size, m
    order : 1 or 2
    source : the model in words
    examine : raises GeometryError where the mesh does not pass; the last attempt's is passed on

    Raises
    ------
    GeometryError
        where the mesh would be larger than three million elements, gmsh fails, or no attempt passes
    """
    words = ""
    for number, (per_turn, algorithm) in enumerate(ATTEMPTS):
        last = number == len(ATTEMPTS) - 1
        with session() as gmsh:
            named, scale = build(gmsh)
            cad = _measure(gmsh, named, scale, order)
            _check_count(cad, size)
            try:
                with silence():  # gmsh's Delaunay code prints, past General.Terminal
                    worst = _mesh(gmsh, size / scale, order, per_turn, algorithm, repair=number > 1)
            except Exception as error:  # gmsh raises plain Exception
                words = str(error)
                continue
            if worst <= GOOD and not (last and worst > -1.0):
                continue
            mesh = _extract(gmsh, named, order, source, scale)
        try:
            examine(mesh, cad)
        except GeometryError:
            if last:
                raise
            continue
        return mesh, cad
    raise GeometryError(
        f"no good tets of it ({words or 'inverted elements'}); likely cause: elements too coarse "
        f"for a thin round wall; try: an element size below {millimetres(size)}"
    )


def _measure(gmsh: Any, named: Named, scale: float, order: int) -> CadMeasure:
    mass = gmsh.model.occ.getMass
    return CadMeasure(
        volumes={n: sum(mass(3, t) for t in tags) * scale**3 for n, tags in named.volumes.items()},
        areas={n: sum(mass(2, t) for t in tags) * scale**2 for n, tags in named.surfaces.items()},
        curved=order == 2,
    )


def _check_count(cad: CadMeasure, size: float) -> None:
    expected = estimate_elements(sum(cad.volumes.values()), sum(cad.areas.values()), size)
    if expected > MOST_ELEMENTS:
        coarser = size * (expected / MOST_ELEMENTS) ** 0.5
        raise refusal(
            f"element size {millimetres(size)} would give about {expected:.2g} elements",
            f"at most {MOST_ELEMENTS:.2g}",
            "an element size far below the thinnest wall",
            f"{millimetres(coarser)} or more",
        )


def _mesh(gmsh: Any, size: float, order: int, per_turn: int, algorithm: int, repair: bool) -> float:
    """One attempt, at an element size in the model's unit: the quality of the worst element, -1 for none.

    Where curving spoils many elements they are repaired only if told so: finer round walls are quicker.
    """
    option = gmsh.option.setNumber
    option("Mesh.MeshSizeMax", size)
    option("Mesh.MeshSizeMin", 0.0)
    option("Mesh.MeshSizeFromPoints", 0)
    option("Mesh.MeshSizeExtendFromBoundary", 1)
    option("Mesh.MeshSizeFromCurvature", per_turn)
    option("Mesh.Algorithm3D", algorithm)
    option("Mesh.Optimize", 1)
    option("Mesh.ElementOrder", 1)
    option("Mesh.SecondOrderLinear", 0)
    option("Mesh.HighOrderThresholdMin", 0.1)
    gmsh.model.mesh.generate(3)
    if _worst(gmsh, 4, "gamma") < 0.1:
        gmsh.model.mesh.optimize("Netgen")
    if order == 1:
        return _worst(gmsh, 4, "minSICN")
    gmsh.model.mesh.setOrder(2)
    tags, _ = gmsh.model.mesh.getElementsByType(11)
    bad = (
        np.count_nonzero(np.asarray(gmsh.model.mesh.getElementQualities(tags, "minSJ")) < 0.1)
        if len(tags)
        else 0
    )
    if bad and (repair or bad < 0.02 * len(tags)):
        # where it cannot mend all, it throws out of a parallel region, which ends the process: let it go on
        option("General.AbortOnError", 0)
        gmsh.model.mesh.optimize("HighOrder")
        option("General.AbortOnError", 2)
    return _worst(gmsh, 11, "minSICN")


def _worst(gmsh: Any, kind: int, measure: str) -> float:
    """gmsh's quality of the worst element of a type; -1 where there is none."""
    tags, _ = gmsh.model.mesh.getElementsByType(kind)
    return float(np.min(gmsh.model.mesh.getElementQualities(tags, measure))) if len(tags) else -1.0


def _extract(gmsh: Any, named: Named, order: int, source: str, scale: float) -> TaggedMesh:
    node_tags, coordinates, _ = gmsh.model.mesh.getNodes()
    row = np.full(int(node_tags.max()) + 1, -1, dtype=np.int64)
    row[node_tags.astype(np.int64)] = np.arange(len(node_tags))
    tet_type, tet_nodes, tri_type, tri_nodes = (11, 10, 9, 6) if order == 2 else (4, 4, 2, 3)

    def elements(kind: int, width: int, tags: Iterable[int]) -> np.ndarray:
        blocks = [gmsh.model.mesh.getElementsByType(kind, tag)[1] for tag in tags]
        return row[np.concatenate(blocks).astype(np.int64)].reshape(-1, width)

    tets = [elements(tet_type, tet_nodes, tags) for tags in named.volumes.values()]
    surfaces = {name: elements(tri_type, tri_nodes, tags) for name, tags in named.surfaces.items()}
    ends = np.cumsum([0] + [len(block) for block in tets])
    volumes = {name: np.arange(a, b) for name, a, b in zip(named.volumes, ends[:-1], ends[1:], strict=True)}
    all_tets = np.concatenate(tets)
    if order == 2:
        all_tets = all_tets[:, GMSH_TET10]
    used = np.unique(all_tets)
    new = np.full(len(node_tags), -1, dtype=np.int64)
    new[used] = np.arange(len(used))
    from geometry.topology import oriented

    return oriented(
        TaggedMesh(
            points=coordinates.reshape(-1, 3)[used] * scale,
            tets=new[all_tets],
            volumes=volumes,
            surfaces={name: new[faces] for name, faces in surfaces.items()},
            source=source,
        )
    )
