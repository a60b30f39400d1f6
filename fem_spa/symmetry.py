"""Planes of symmetry: the deck's are those of the mesh, and no load goes across them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fem_spa.deck import Deck
from fem_spa.deck_tables import Measure
from fem_spa.errors import InputError
from fem_spa.units import brief
from geometry.measures import area, area_vectors, symmetry_names
from geometry.tagged import TaggedMesh


def find_symmetry(deck: Deck, mesh: TaggedMesh) -> dict[str, str]:
    """Surface -> axis of its normal: the deck's planes, or those of a built-in shape; a file's must be said.

    Raises
    ------
    InputError
        A surface called `symmetry...` is not declared, or a declared one is no plane along its axis.
    """
    names = symmetry_names(mesh)
    declared: Mapping[str, str] | None = deck.supports.symmetry
    if declared is None and deck.geometry.shape is not None:
        declared = {name: axis for name in names if (axis := _normal_axis(mesh, name)) is not None}
    declared = declared or {}
    check_declared(declared, names, {name: _normal_axis(mesh, name) for name in names})
    for name, axis in declared.items():
        given = f"given {brief(axis)} for supports.symmetry.{name}"
        if name in ("tip", "base") or name.startswith(("cavity ", "layer ")):
            raise InputError(f"{given}: this surface is no cut of the body; name the plane of the cut")
        right = _normal_axis(mesh, name)
        if right is None:
            raise InputError(
                f"{given}: the surface is no plane with its normal along x, y or z; "
                "name the plane of the cut, or turn the body so that the cut is normal to an axis"
            )
        if right != axis:
            raise InputError(f"{given}: the surface's normal is along {right}; write '{right}'")
    return dict(declared)


def check_declared(
    declared: Mapping[str, str], surfaces: Sequence[str], axes: Mapping[str, str | None] | None = None
) -> None:
    """Refuse a surface called `symmetry...` that is left free: a half body without its plane is open."""
    for name in surfaces:
        if (name == "symmetry" or name.startswith("symmetry ")) and name not in declared:
            key = name if name == "symmetry" else f'"{name}"'
            axis = (axes or {}).get(name) or "y"
            raise InputError(
                f"the mesh has a surface '{name}', and supports.symmetry does not name it: a half body "
                f'without its plane is open; give [supports] symmetry = {{ {key} = "{axis}" }} (the normal)'
            )


def _normal_axis(mesh: TaggedMesh, name: str) -> str | None:
    """The axis along the normal of a surface; None where it is no plane normal to an axis."""
    faces = mesh.surfaces[name]
    total = np.abs(area_vectors(mesh.points, faces).sum(axis=0))
    axis = int(np.argmax(total))
    flat = np.ptp(mesh.points[faces][..., axis]) <= 1e-6 * np.ptp(mesh.points, axis=0).max()
    return "xyz"[axis] if flat and total[axis] >= (1.0 - 1e-6) * area(mesh, name) else None


def check_across(deck: Deck, mesh: TaggedMesh, symmetry: Mapping[str, str], shape: Any) -> None:
    """Refuse a load along the normal of a plane of symmetry: the mirror image would bear its opposite.

    A plane across the tip's normal mirrors the tip to another end, so the tip's own loads may go along it.
    """
    tip = np.zeros(3)
    if "tip" in mesh.surfaces:
        tip = area_vectors(mesh.points, mesh.surfaces["tip"]).sum(axis=0)
        tip = tip / max(float(np.linalg.norm(tip)), 1e-300)
    whole = "" if shape is None else " (half = false)" if hasattr(shape, "half") else " (share = 1)"
    for key in ("gravity", "tip_force", "tip_displacement"):
        for name, axis in symmetry.items():
            i = "xyz".index(axis)
            given = (getattr(deck.loads, key) or (0.0, 0.0, 0.0))[i]
            value, text = (given.si, given.text) if isinstance(given, Measure) else (given, given)
            if value and not (key != "gravity" and abs(tip[i]) > 0.5):
                raise InputError(
                    f"given {brief(text)} along {axis} for loads.{key}: it is across the plane of symmetry "
                    f"'{name}', which allows 0 there; mesh the whole actuator{whole}"
                )
