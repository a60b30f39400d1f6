"""A user's STEP file -> named entities in gmsh -> TaggedMesh."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from geometry.cad import Named
from geometry.errors import GeometryError, refusal
from geometry.mesher import CadMeasure, check_request, mesh_named
from geometry.session import MM, session, silence
from geometry.step_text import Point, StepFace, StepText, read_step_text
from geometry.tagged import TaggedMesh


def mesh_step(
    path: Path, unit: float | None, size: float | None, order: int
) -> tuple[TaggedMesh, CadMeasure]:
    """Mesh a STEP file whose solids and faces have the names of design.md.

    Parameters
    ----------
    unit : m a unit of the file's numbers; None: as the file states
    size : element size, m; None: a twentieth of the largest dimension
    order : 1 or 2

    Raises
    ------
    GeometryError
        where the file is damaged, has no solid, or a name is not found again in the geometry
    """
    text = read_step_text(path)
    # OpenCASCADE turns the file's unit into mm whatever it is
    scale = MM if unit is None else MM * unit / text.unit
    with session() as gmsh:
        _import(gmsh, path)
        corners = gmsh.model.getBoundingBox(-1, -1)
    extent = max(corners[k + 3] - corners[k] for k in range(3)) * scale
    size = extent / 20 if size is None else size
    check_request(size, order, extent)

    def build(gmsh: Any) -> tuple[Named, float]:
        _import(gmsh, path)
        return _named(gmsh, path, text), scale

    return mesh_named(build, size, order, f"file {path.name}")


def _import(gmsh: Any, path: Path) -> None:
    try:
        with silence():
            gmsh.model.occ.importShapes(str(path))
        gmsh.model.occ.synchronize()
    except Exception as error:  # gmsh raises plain Exception
        raise GeometryError(
            f"{path.name}: not a readable STEP file ({error}); likely cause: a damaged file; "
            "try: export it again as STEP AP214 or AP242"
        ) from error
    if not gmsh.model.getEntities(3):
        raise refusal(
            f"{path.name}: no solid",
            "at least one solid",
            "a damaged file, or surfaces that were not joined",
            "make a solid of it in the CAD program",
        )


def _named(gmsh: Any, path: Path, text: StepText) -> Named:
    """Names of the file on gmsh's entities, after touching solids were made to share their faces."""
    to_mm = text.unit / MM
    face_names = _match(gmsh, 2, [f for f in text.faces if f.name], text.faces, to_mm, path)
    solid_names = _solid_names(gmsh, path, text, to_mm)
    solids = gmsh.model.getEntities(3)
    owned = {abs(t) for _, t in gmsh.model.getBoundary(solids, combined=False, oriented=False)}
    loose = [(2, t) for _, t in gmsh.model.getEntities(2) if t not in owned]
    if len(solids) > 1 or loose:
        tagged = [(2, tag) for tag in face_names]
        inputs = [*solids, *tagged, *(item for item in loose if item not in tagged)]
        _, pieces = gmsh.model.occ.fragment(inputs[:1], inputs[1:])
        gmsh.model.occ.synchronize()
        moved = dict(zip(inputs, pieces, strict=True))
        face_names = {t: name for old, name in face_names.items() for d, t in moved[(2, old)] if d == 2}
        solid_names = {t: name for old, name in solid_names.items() for d, t in moved[(3, old)] if d == 3}
    volumes: dict[str, list[int]] = {}
    for tag, name in sorted(solid_names.items()):
        volumes.setdefault(name, []).append(tag)
    every = [(3, t) for t in solid_names]
    shell = {abs(t) for _, t in gmsh.model.getBoundary(every, combined=True, oriented=False)}
    inner = {abs(t) for _, t in gmsh.model.getBoundary(every, combined=False, oriented=False)} - shell
    surfaces: dict[str, list[int]] = {}
    for tag, name in sorted(face_names.items()):
        if tag in shell or (tag in inner and name.startswith("layer ")):
            surfaces.setdefault(name, []).append(tag)
    rest = sorted(shell - set(face_names))
    if rest:
        surfaces["outer"] = sorted({*surfaces.get("outer", []), *rest})
    return Named(volumes, surfaces)


def _solid_names(gmsh: Any, path: Path, text: StepText, to_mm: float) -> dict[int, str]:
    """Name of every solid: its own, else its part's label, else `body` where it is the only one."""
    solids = [tag for _, tag in gmsh.model.getEntities(3)]
    names = _match(gmsh, 3, [s for s in text.solids if s.name], text.solids, to_mm, path)
    for tag in solids:
        if tag in names:
            continue
        label = gmsh.model.getEntityName(3, tag).rpartition("/")[2]
        if label and "Open CASCADE" not in label and len(solids) > 1:
            names[tag] = label
        elif len(solids) == 1:
            names[tag] = "body"
        else:
            raise refusal(
                f"{path.name}: solid {tag} of {len(solids)} has no name",
                "a name for every solid, such as `body`",
                "the CAD program did not export names",
                "switch on the export of names, or join the solids to one",
            )
    return names


def _match(
    gmsh: Any, dim: int, wanted: list[StepFace], every: tuple[StepFace, ...], to_mm: float, path: Path
) -> dict[int, str]:
    """gmsh tag -> name of the file, by the vertices, and by the order where these are the same."""
    if not wanted:
        return {}
    by_place: dict[tuple[tuple[int, ...], ...], list[int]] = {}
    for _, tag in gmsh.model.getEntities(dim):
        points = gmsh.model.getBoundary([(dim, tag)], combined=False, oriented=False, recursive=True)
        spots = {tuple(gmsh.model.getValue(0, t, [])) for d, t in points if d == 0}
        by_place.setdefault(_key(spots, 1.0), []).append(tag)
    out: dict[int, str] = {}
    turn: dict[tuple[tuple[int, ...], ...], int] = {}
    for face in every:
        key = _key(set(face.vertices), to_mm)
        tags = by_place.get(key, [])
        number = turn.get(key, 0)
        turn[key] = number + 1
        if not face.name:
            continue
        if not tags:
            raise refusal(
                f"{path.name}: {'face' if dim == 2 else 'solid'} `{face.name}` is not found in the geometry",
                "names on the faces of one part",
                "an assembly whose parts are placed by a transformation",
                "export the actuator as one part",
            )
        out[tags[min(number, len(tags) - 1)]] = face.name
    return out


def _key(points: set[Point] | set[tuple[float, ...]], scale: float) -> tuple[tuple[int, ...], ...]:
    """Positions as whole micrometres-of-micrometres, so that rounding in the file does not matter."""
    return tuple(sorted({tuple(round(x * scale * 1e4) for x in point) for point in points}))
