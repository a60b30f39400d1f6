"""The names in a STEP file, from its text (ISO 10303-21).

gmsh hands on the names of parts but not those of faces; a CAD program writes a face's name
into its ADVANCED_FACE. The faces are told apart by their vertices, and where these are the same
by their order in the file.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from geometry.errors import GeometryError

Point = tuple[float, float, float]

_ENTITY = re.compile(r"#(\d+)\s*=\s*([A-Z0-9_]*)\s*\(((?:'(?:[^']|'')*'|[^';])*)\)\s*;", re.DOTALL)
_REFERENCE = re.compile(r"#(\d+)")
_STRING = re.compile(r"\s*'((?:[^']|'')*)'")
_SI = re.compile(r"SI_UNIT\s*\(\s*(\$|\.[A-Z]+\.)\s*,\s*\.METRE\.\s*\)")
_PREFIX = {"$": 1.0, ".MILLI.": 1e-3, ".CENTI.": 1e-2, ".MICRO.": 1e-6, ".DECI.": 1e-1, ".KILO.": 1e3}
_NAMELESS = {"", "NONE", "none"}


@dataclass(frozen=True)
class StepFace:
    """A face of the file: its name ("" where it has none) and its vertices in the file's numbers."""

    name: str
    vertices: tuple[Point, ...]


@dataclass(frozen=True)
class StepText:
    """Faces and solids of a STEP file in the order of its text, and its unit of length in m."""

    faces: tuple[StepFace, ...]
    solids: tuple[StepFace, ...]
    unit: float


def read_step_text(path: Path) -> StepText:
    """Names, vertices and unit of a STEP file.

    Raises
    ------
    GeometryError
        where it cannot be read as STEP
    """
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise GeometryError(f"{path.name}: cannot be read ({error.strerror or error})") from error
    if "ISO-10303-21" not in text[:4000]:
        raise GeometryError(
            f"{path.name}: not a STEP file; allowed: ISO 10303-21 text; "
            "likely cause: another format or a damaged file; try: export it again as STEP AP214 or AP242"
        )
    entities = {
        int(m[1]): (m[2], m[3]) for m in _ENTITY.finditer(re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL))
    }
    faces, solids = [], []
    for kind, arguments in entities.values():
        if kind == "ADVANCED_FACE":
            faces.append(StepFace(_name(arguments), _vertices(entities, arguments)))
        elif kind in ("MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS"):
            solids.append(StepFace(_name(arguments), _vertices(entities, arguments)))
    return StepText(tuple(faces), tuple(solids), _unit(text))


def _name(arguments: str) -> str:
    found = _STRING.match(arguments)
    name = found[1].replace("''", "'").strip() if found else ""
    return "" if name in _NAMELESS else name


def _vertices(entities: dict[int, tuple[str, str]], arguments: str) -> tuple[Point, ...]:
    """Positions of all vertices below an entity, sorted, each once."""
    found: set[Point] = set()
    seen: set[int] = set()
    stack = [int(n) for n in _REFERENCE.findall(arguments)]
    while stack:
        number = stack.pop()
        if number in seen or number not in entities:
            continue
        seen.add(number)
        kind, inner = entities[number]
        if kind == "VERTEX_POINT":
            point = entities.get(int((_REFERENCE.findall(inner) or ["-1"])[0]), ("", ""))[1]
            numbers = re.findall(r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?\.?", point.rpartition("(")[2])
            if len(numbers) == 3:
                found.add((float(numbers[0]), float(numbers[1]), float(numbers[2])))
        elif kind in _WAY_TO_VERTICES:
            stack += [int(n) for n in _REFERENCE.findall(inner)]
    return tuple(sorted(found))


_WAY_TO_VERTICES = {
    "ADVANCED_FACE",
    "CLOSED_SHELL",
    "ORIENTED_CLOSED_SHELL",
    "OPEN_SHELL",
    "FACE_BOUND",
    "FACE_OUTER_BOUND",
    "EDGE_LOOP",
    "VERTEX_LOOP",
    "ORIENTED_EDGE",
    "EDGE_CURVE",
}


def _unit(text: str) -> float:
    if re.search(r"CONVERSION_BASED_UNIT\s*\(\s*'INCH'", text):
        return 0.0254
    found = _SI.search(text)
    return _PREFIX.get(found[1], 1e-3) if found else 1e-3
