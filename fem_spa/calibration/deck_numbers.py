"""Numbers of a deck by name: what they are, a problem with other values, and the deck that says so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.calibration.walls import thickness_mode
from fem_spa.deck import Deck, nearest, parse_deck
from fem_spa.errors import InputError
from fem_spa.prepare import Setup, prepare
from fem_spa.solid.knobs import Knob, knob, knob_names
from fem_spa.solid.problem import Problem
from fem_spa.units import show

OFFSET = "offset"
"""A constant of the measured output, an angle sensor's zero; no deck holds it, calibration.json does."""


@dataclass(frozen=True)
class Numbers:
    """A deck, prepared, and the numbers of it that vary.

    names : in order;  start : name -> value in SI;  unit : name -> SI unit
    mode : how the nodes move for `walls.scale`, or None;  lengths : those that are a shape's parameters
    """

    deck: Deck
    setup: Setup
    names: tuple[str, ...]
    start: Mapping[str, float]
    unit: Mapping[str, str]
    mode: np.ndarray | None
    lengths: tuple[str, ...]

    def problem(self, values: Mapping[str, float]) -> Problem:
        """The problem with these values (SI); a shape's lengths are drawn and meshed anew."""
        problem = self._drawn(values).problem
        for name in self.names:
            if name not in self.lengths and name != OFFSET and values[name] != self.start[name]:
                problem = knob(problem, name, self.mode).turn(problem, values[name])
        return problem

    def knobs(self, problem: Problem) -> list[Knob]:
        """Knobs at the values that a problem has; those of scales start from 1 there."""
        return [knob(problem, n, self.mode) for n in self.names if n not in self.lengths and n != OFFSET]

    def per_log(self, name: str, value: float) -> float:
        """What turns d/d(knob) at a problem with this value into d/d(log value)."""
        return 1.0 if name.endswith(".scale") and name != "walls.scale" else value

    def _drawn(self, values: Mapping[str, float]) -> Setup:
        changed = {n: values[n] for n in self.lengths if values[n] != self.start[n]}
        if not changed:
            return self.setup
        tables = self.deck.table()
        for name, value in changed.items():
            tables["geometry"][name.removeprefix("geometry.")] = show(value, "m")
        return prepare(parse_deck(tables, self.deck.name, self.deck.folder))

    def tables(self, values: Mapping[str, float], mesh_file: str | None = None) -> dict[str, Any]:
        """The deck's tables with these values, every default written out.

        mesh_file : name of the mesh with the moved nodes, where `walls.scale` varies
        """
        problem = self.problem(values)
        out = _copy(self.setup.resolved)
        for name in self.names:
            group, _, word = name.rpartition(".")
            if name in self.lengths:
                out["geometry"][word] = show(values[name], "m")
            elif name.startswith("materials."):
                volume = group.removeprefix("materials.")
                out["materials"][volume] = _material(problem, volume)
            elif name.startswith("layers."):
                layer = group.removeprefix("layers.")
                unit = self.unit[name]
                out["layers"][layer][word] = values[name] if unit == "1" else show(values[name], unit)
            elif name == "walls.scale":
                out["geometry"] = {"file": str(mesh_file), "unit": "m"}
        return out


def numbers(deck: Deck, vary: Sequence[str]) -> Numbers:
    """Look the names up in a deck.

    Raises
    ------
    InputError
        The deck has no such number; walls and a length vary together; nothing varies.
    """
    setup = prepare(deck)
    problem = setup.problem
    if problem.loads.control != "pressure":
        raise InputError(
            f'given control = "{problem.loads.control}": records tell pressures; calibrate with '
            'control = "pressure"'
        )
    lengths = _lengths(deck)
    start: dict[str, float] = {}
    unit: dict[str, str] = {}
    for name in vary:
        if name in start:
            raise InputError(f"given --vary {name} twice: once is enough")
        if name in lengths:
            start[name], unit[name] = lengths[name], "m"
        elif name == OFFSET:
            start[name], unit[name] = 0.0, "output"
        else:
            allowed = [*knob_names(problem), *lengths, OFFSET]
            if name not in allowed and not name.startswith(("materials.", "layers.")):
                raise InputError(f"given --vary {name}: this deck has no such number{nearest(name, allowed)}")
            found = knob(problem, name, np.zeros((1, 3)))
            start[name], unit[name] = found.value, found.unit
    chosen = tuple(name for name in vary if name in lengths)
    if "walls.scale" in vary and chosen:
        raise InputError(f"given --vary walls.scale and {chosen[0]}: both change the walls; vary one of them")
    mode = thickness_mode(problem.mesh, problem.symmetry) if "walls.scale" in vary else None
    return Numbers(deck, setup, tuple(vary), start, unit, mode, chosen)


def _lengths(deck: Deck) -> dict[str, float]:
    """Lengths of a built-in shape: `geometry.NAME` -> m."""
    if deck.geometry.shape is None:
        return {}
    from fem_spa.prepare import built_in
    from geometry.parameters import parameters

    shape = built_in(deck)
    return {
        f"geometry.{item.name}": float(getattr(shape, item.name))
        for item in parameters(shape)
        if item.unit == "m" and getattr(shape, item.name) > 0
    }


def _material(problem: Problem, volume: str) -> dict[str, Any]:
    """The table of a material, its numbers written out."""
    material = problem.materials[volume]
    table: dict[str, Any] = {"law": material.law.file or material.law.name}
    for word, unit in material.law.parameters.items():
        value = float(material.parameters[word])
        table[word] = value if unit == "1" else show(value, unit)
    if np.isfinite(material.bulk) and material.law.bulk is None:
        table["bulk"] = show(material.bulk, "Pa")
    if material.density is not None:
        table["density"] = show(material.density, "kg/m^3")
    return table


def _copy(tables: Mapping[str, Any]) -> dict[str, Any]:
    return {key: _copy(value) if isinstance(value, Mapping) else value for key, value in tables.items()}


def moved_mesh(found: Numbers, values: Mapping[str, float], path: Path) -> None:
    """Write the mesh with scaled walls, numbers in m."""
    from geometry.files import write_mesh

    write_mesh(found.problem(values).mesh, path, "m")
