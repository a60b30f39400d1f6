"""Shapes with parameters -> tagged meshes of tetrahedra. This room knows nothing of mechanics.

Everything inside is SI: metres and radians. Importing this package and listing its shapes loads
neither numpy nor gmsh; what is heavy is loaded where it is first used.

>>> import geometry
>>> shape = geometry.SHAPES["pneunet"](slow_chambers=0, fast_chambers=2)   # doctest: +SKIP
>>> mesh = shape.mesh(size=3e-3)                                             # doctest: +SKIP
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from geometry.errors import GeometryError
from geometry.parameters import Parameter, parameters
from geometry.registry import SHAPES
from geometry.shape import Shape

if TYPE_CHECKING:
    from geometry.checks import check
    from geometry.element_quality import Quality, quality
    from geometry.files import read_mesh, write_mesh
    from geometry.measures import area, body_volume, cavity_volume
    from geometry.second_order import to_second_order
    from geometry.tagged import TaggedMesh

__all__ = [
    "SHAPES",
    "GeometryError",
    "Parameter",
    "Quality",
    "Shape",
    "TaggedMesh",
    "area",
    "body_volume",
    "cavity_volume",
    "check",
    "parameters",
    "quality",
    "read_mesh",
    "to_second_order",
    "write_mesh",
]

_LATER = {
    "Quality": "element_quality",
    "TaggedMesh": "tagged",
    "area": "measures",
    "body_volume": "measures",
    "cavity_volume": "measures",
    "check": "checks",
    "quality": "element_quality",
    "read_mesh": "files",
    "to_second_order": "second_order",
    "write_mesh": "files",
}


def __getattr__(name: str) -> Any:
    """Load what needs numpy when it is first asked for (PEP 562)."""
    if name not in _LATER:
        raise AttributeError(f"module 'geometry' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(f"geometry.{_LATER[name]}"), name)
    globals()[name] = value
    return value
