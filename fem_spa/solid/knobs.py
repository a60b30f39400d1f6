"""Numbers of a problem that can be turned: material parameters, layers, the scale of all walls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fem_spa.errors import InputError
from fem_spa.solid.problem import Material, Problem
from geometry.second_order import to_second_order


@dataclass(frozen=True)
class Knob:
    """One number of a problem.

    name : as decks say it, dotted;  value, unit : SI
    turn : (problem, value) -> the same problem with another value
    """

    name: str
    value: float
    unit: str
    turn: Callable[[Problem, float], Problem]


def knob(problem: Problem, name: str, mode: np.ndarray | None = None) -> Knob:
    """The knob of a dotted name.

    Parameters
    ----------
    name : `materials.VOLUME.PARAMETER` (of its law, `bulk`, `density`, or `scale`: of all moduli of the
        law and a finite bulk modulus), `layers.NAME.modulus`, `.thickness`, `.poisson`, or `walls.scale`
    mode : (n_points, 3) m, for `walls.scale`: how the nodes of the second-order mesh move for a scale of 2

    Raises
    ------
    InputError
        The problem has no such number.
    """
    kind, _, rest = name.partition(".")
    group, _, word = rest.rpartition(".")
    if kind == "materials" and group in problem.materials:
        return _material_knob(name, group, word, problem.materials[group])
    if kind == "layers" and group in problem.layers and word in _LAYER:
        layer = problem.layers[group]

        def of_layer(p: Problem, value: float) -> Problem:
            return replace(p, layers={**p.layers, group: replace(p.layers[group], **{word: value})})

        return Knob(name, float(getattr(layer, word)), _LAYER[word], of_layer)
    if name == "walls.scale" and mode is not None:
        mesh = to_second_order(problem.mesh)

        def of_walls(p: Problem, value: float) -> Problem:
            return replace(p, mesh=replace(mesh, points=mesh.points + (value - 1.0) * mode))

        return Knob(name, 1.0, "1", of_walls)
    raise InputError(f"given {name}: allowed are {', '.join(knob_names(problem))}")


_LAYER = {"modulus": "Pa", "thickness": "m", "poisson": "1"}


def knob_names(problem: Problem) -> list[str]:
    """What `knob` takes for this problem."""
    names = []
    for volume, material in problem.materials.items():
        words = [*material.law.parameters, "scale"]
        words += ["bulk"] if np.isfinite(material.bulk) and material.law.bulk is None else []
        words += ["density"] if material.density is not None else []
        names += [f"materials.{volume}.{word}" for word in words]
    names += [f"layers.{layer}.{word}" for layer in problem.layers for word in _LAYER]
    return [*names, "walls.scale"]


def _material_knob(name: str, volume: str, word: str, material: Material) -> Knob:
    law = material.law

    def put(p: Problem, **changes: object) -> Problem:
        changed = replace(p.materials[volume], **changes)  # type: ignore[arg-type]
        return replace(p, materials={**p.materials, volume: changed})

    def own_bulk(parameters: dict[str, float]) -> float:
        return material.bulk if law.bulk is None else float(law.bulk(**parameters))

    if word in law.parameters:

        def of_law(p: Problem, value: float) -> Problem:
            parameters = {**p.materials[volume].parameters, word: value}
            return put(p, parameters=parameters, bulk=own_bulk(parameters))

        return Knob(name, float(material.parameters[word]), law.parameters[word], of_law)
    if word == "scale":

        def of_scale(p: Problem, value: float) -> Problem:
            parameters = {
                key: number * value if law.parameters[key] == "Pa" else number
                for key, number in p.materials[volume].parameters.items()
            }
            return put(p, parameters=parameters, bulk=p.materials[volume].bulk * value)

        return Knob(name, 1.0, "1", of_scale)
    units = {"bulk": "Pa", "density": "kg/m^3"}
    value = getattr(material, word) if word in units else None
    if value is None or not np.isfinite(value) or (word == "bulk" and law.bulk is not None):
        words = ", ".join([*law.parameters, "scale"])
        raise InputError(f"given {name}: the material of {volume} has no such number to vary; try {words}")
    return Knob(name, float(value), units[word], lambda p, v: put(p, **{word: v}))
