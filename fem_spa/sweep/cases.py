"""Every combination of the varied keys as a checked deck with a name; nothing is meshed, run or written."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import re
import warnings
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from fem_spa.deck import Deck, parse_deck, put, read_tables
from fem_spa.deck_tables import Measure
from fem_spa.errors import InputError
from fem_spa.mesh_store import mesh_key
from fem_spa.sweep.axes import MOST_VALUES, Axis, Value, read_axis
from fem_spa.units import quantity

MOST_CASES = MOST_VALUES
MOST_KEYS = 16
_COUNTS = ("loads.points", "solver.imposed_steps", "solver.max_iterations")


@dataclass(frozen=True)
class Case:
    """One design.

    Attributes
    ----------
    name : of its folder: digest of the deck as resolved, numbers in SI
    values : one an axis
    deck : None where it is refused
    mesh : key of its mesh;  refused : why no run is possible, or ""
    """

    name: str
    values: tuple[Value, ...]
    deck: Deck | None
    mesh: str = ""
    refused: str = ""


@dataclass(frozen=True)
class Plan:
    """What a sweep is to run.

    axes, cases : in the order of the table
    twins : combinations left out because another one is the same design
    sample : points drawn; 0 is the whole grid
    """

    axes: tuple[Axis, ...]
    cases: tuple[Case, ...]
    twins: int = 0
    sample: int = 0


def make_plan(
    path: Path,
    vary: Sequence[str],
    sample: str | None,
    seed: int,
    overrides: Sequence[str],
    meshes: Path | None,
) -> Plan:
    """Read `--vary` and `--sample`, check every combination as a deck.

    Parameters
    ----------
    path : the deck's file;  overrides : `--set`, before anything varies
    meshes : folder of the meshes that cases share

    Raises
    ------
    InputError
        A key that the deck does not know, a value of a wrong kind, more cases than are sensible.
    """
    tables = read_tables(path, overrides)
    count = _sample(sample)
    if not vary:
        raise InputError("given no --vary: say what varies, such as --vary geometry.wall=1mm:2mm:5")
    if len(vary) > MOST_KEYS:
        raise InputError(f"given {len(vary)} keys to vary: at most {MOST_KEYS} are allowed")
    axes = [read_axis(text, sampled=count > 0) for text in vary]
    _refuse_nested(axes)
    total = count or math.prod(len(axis.values) for axis in axes)
    if total > MOST_CASES:
        how = " x ".join(str(len(axis.values)) for axis in axes)
        raise InputError(
            f"given {how} = {total} cases: at most {MOST_CASES} are allowed, each is a finite-element run; "
            "give fewer values, or --sample sobol:N"
        )
    combinations = (
        _drawn(axes, tables, count, seed) if count else itertools.product(*(a.values for a in axes))
    )
    cases: dict[str, Case] = {}
    twins = 0
    for values in combinations:
        case = _case(path, tables, axes, values, meshes)
        twins += case.name in cases
        cases.setdefault(case.name, case)
    found = tuple(cases.values())
    _refuse_names(found)
    if all(case.refused for case in found):
        raise InputError(f"no case can be run; the first one: {found[0].refused}")
    return Plan(tuple(axes), found, twins, count)


def _refuse_names(cases: Sequence[Case]) -> None:
    """Refuse volumes, surfaces and cavities that a mesh file does not have (a shape's need no mesh)."""
    from fem_spa.prepare import check_names, make_mesh

    meshes: dict[str, Any] = {}
    for case in cases:
        deck = case.deck
        if deck is None or not str(deck.geometry.file).lower().endswith(".msh"):
            continue
        if case.mesh not in meshes:
            meshes[case.mesh] = make_mesh(parse_deck(deck.table(), deck.name, deck.folder))
        check_names(deck, meshes[case.mesh].volumes, meshes[case.mesh].surfaces)


def _sample(text: str | None) -> int:
    """N of "sobol:N"; 0 for None."""
    if text is None:
        return 0
    match = re.fullmatch(r"sobol:(\d{1,18})", text.strip())
    if match is None or not 2 <= int(match[1]) <= MOST_CASES:
        raise InputError(f"given {text} for --sample: write sobol:N, N from 2 to {MOST_CASES}")
    return int(match[1])


def _refuse_nested(axes: Sequence[Axis]) -> None:
    """A key twice, or a key within another one's table, has no meaning."""
    for i, axis in enumerate(axes):
        for other in axes[:i]:
            size = min(len(axis.path), len(other.path))
            if axis.path[:size] == other.path[:size]:
                both = f"{other.key} and {axis.key}" if axis.key != other.key else f"{axis.key} twice"
                raise InputError(f"given --vary {both}: one would replace the other; vary one of them")


def _drawn(axes: Sequence[Axis], tables: Mapping[str, Any], count: int, seed: int) -> list[tuple[Value, ...]]:
    """Points of a scrambled Sobol sequence; those of a larger count begin with those of a smaller one."""
    from scipy.stats import qmc

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that counts which are no power of two are less even
        shares = qmc.Sobol(len(axes), scramble=True, rng=seed).random(count)
    whole = [_counts(axis, tables) for axis in axes]
    return [
        tuple(axis.at(float(u), w) for axis, u, w in zip(axes, row, whole, strict=True)) for row in shares
    ]


def _counts(axis: Axis, tables: Mapping[str, Any]) -> bool:
    """Whether a key takes whole numbers only."""
    if axis.key in _COUNTS:
        return True
    item = _shape_parameters(tables).get(axis.path[-1]) if axis.path[:1] == ("geometry",) else None
    return item is not None and item.kind == "count"


def _shape_parameters(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters of the deck's built-in shape by name; none where it has no known shape."""
    from geometry.parameters import parameters
    from geometry.registry import SHAPES

    geometry = tables.get("geometry", {})
    name = str(geometry.get("shape")) if isinstance(geometry, Mapping) else ""
    return {item.name: item for item in parameters(SHAPES[name])} if name in SHAPES else {}


def _case(
    path: Path, tables: Mapping[str, Any], axes: Sequence[Axis], values: Sequence[Value], meshes: Path | None
) -> Case:
    """A combination as a case.

    What is wrong with a key or a single value ends the sweep before it begins; sizes or numbers that do not
    go together make a row with the reason.
    """
    from fem_spa.prepare import before_mesh
    from geometry.errors import GeometryError
    from materials.errors import MaterialError

    changed = deepcopy(dict(tables))
    for axis, value in zip(axes, values, strict=True):
        put(changed, axis.path, value.given, f"--vary {axis.key}")
    _absolute_laws(changed)
    deck = parse_deck(changed, path.stem, path.parent.resolve(), meshes)
    _refuse_sizes(axes, values, changed)
    try:
        shape, materials, _ = before_mesh(deck)
    except (GeometryError, MaterialError) as error:
        return Case(_digest(_plain(deck)), tuple(values), None, refused=str(error))
    mesh = mesh_key(deck, shape)
    resolved = _plain(deck) | {"geometry": mesh}
    resolved["materials"] = {
        name: [_law(m.law), m.parameters, m.bulk, m.density] for name, m in materials.items()
    }
    return Case(_digest(resolved), tuple(values), deck, mesh)


def _absolute_laws(tables: Mapping[str, Any]) -> None:
    """A user's law is found from the working folder, which on a cluster is another one."""
    materials = tables.get("materials")
    for table in materials.values() if isinstance(materials, dict) else ():
        if isinstance(table, dict) and str(table.get("law")).endswith(".py"):
            table["law"] = str(Path(table["law"]).resolve())


def _law(law: Any) -> str:
    """A law by name, a user's own by the content of its file."""
    return _digest(Path(law.file).read_text(encoding="utf-8")) if law.file else str(law.name)


def _refuse_sizes(axes: Sequence[Axis], values: Sequence[Value], tables: Mapping[str, Any]) -> None:
    """A length of a shape that is out of its own range is a slip, whatever the other ones are."""
    known = _shape_parameters(tables)
    for axis, value in zip(axes, values, strict=True):
        item = known.get(axis.path[1]) if axis.path[0] == "geometry" and len(axis.path) == 2 else None
        if item is None or item.low is None:
            continue
        number = quantity(value.given, item.unit, axis.key)
        if not item.low <= number <= item.high:
            raise InputError(f"given {value.given} for {axis.key}: {item.range_text} is allowed")
        if item.kind == "count" and not number.is_integer():
            raise InputError(f"given {value.given} for {axis.key}: a whole number is needed")


def _plain(value: Any) -> Any:
    """Tables of a deck with every default, quantities as numbers in SI."""
    if isinstance(value, Measure):
        return value.si
    if isinstance(value, BaseModel):
        fields = {name: _plain(getattr(value, name)) for name in type(value).model_fields}
        return fields | {name: _plain(item) for name, item in (value.model_extra or {}).items()}
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, (list, tuple)) else value


def _digest(content: Any) -> str:
    text = content if isinstance(content, str) else json.dumps(content, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:12]
