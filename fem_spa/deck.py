"""The deck, a run's input: TOML tables -> checked values with units, or one line saying why not.

The tables and keys are those that other programs rely on; nothing here knows meshes or solvers.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import UnionType
from typing import Any, Self, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError

from fem_spa.deck_tables import (
    Geometry,
    LayerTable,
    LoadsTable,
    MaterialTable,
    Measure,
    Observe,
    SolverTable,
    Strict,
    Supports,
)
from fem_spa.errors import InputError
from fem_spa.units import brief
from materials.bounded import parse_toml, read_text


class Drawing(BaseModel):
    """What `fem-spa mesh` needs of a deck: its [geometry]; the rest is not looked at.

    `name` is the deck's file name without its ending, `folder` the place that its paths start from, `meshes`
    a folder in which meshes are kept and looked for (a sweep's), or None.
    """

    model_config = ConfigDict(extra="ignore", frozen=True)
    geometry: Geometry
    _name: str = "deck"
    _folder: Path = Path()
    _meshes: Path | None = None

    @property
    def name(self) -> str:
        """The name that the output folder takes."""
        return self._name

    @property
    def folder(self) -> Path:
        """Where the deck's relative paths start."""
        return self._folder

    @property
    def meshes(self) -> Path | None:
        """Where meshes are kept (`fem_spa.mesh_store`)."""
        return self._meshes

    def with_meshes(self, folder: Path) -> Self:
        """A copy that takes its mesh from a folder, and keeps it there."""
        changed = self.model_copy()
        changed._meshes = folder
        return changed


class Deck(Drawing):
    """A whole deck, checked as far as that goes without its mesh."""

    model_config = Strict
    materials: dict[str, MaterialTable] = {}
    layers: dict[str, LayerTable] = {}
    supports: Supports = Supports()
    loads: LoadsTable
    observe: Observe = Observe()
    solver: SolverTable = SolverTable()

    def table(self) -> dict[str, Any]:
        """The deck as plain tables, units as text: written as TOML it gives the same run again."""
        return self.model_dump(exclude_none=True)


def read_deck(path: str | Path, overrides: Sequence[str] = ()) -> Deck:
    """Read a deck file and apply `--set` overrides.

    Parameters
    ----------
    path : the .toml file
    overrides : texts ``key=value``: the key dotted, the value TOML or a plain word

    Raises
    ------
    InputError
        The file cannot be read, is not TOML, or says what a deck cannot say.
    """
    path = Path(path)
    return parse_deck(read_tables(path, overrides), name=path.stem, folder=path.parent)


def read_drawing(path: str | Path, overrides: Sequence[str] = ()) -> Drawing:
    """Read the [geometry] of a deck file and nothing else; see `read_deck`."""
    path = Path(path)
    try:
        drawing = Drawing.model_validate(read_tables(path, overrides))
    except ValidationError as error:
        raise InputError(_reason(error)) from None
    drawing._name, drawing._folder = path.stem, path.parent
    _check_geometry(drawing.geometry)
    return drawing


def read_tables(path: Path, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """The tables of a deck file, with the overrides in them; nothing but TOML is checked."""
    try:
        text = read_text(path)
    except FileNotFoundError:
        raise InputError(f"given {path}: there is no such file; give the path of a deck (.toml)") from None
    except IsADirectoryError:
        raise InputError(f"given {path}: this is a folder; give the path of a deck (.toml)") from None
    except UnicodeDecodeError:
        raise InputError(f"given {path}: this is not a text file; a deck is TOML in UTF-8") from None
    except OSError as error:
        raise InputError(f"given {path}: it cannot be read ({error.strerror})") from None
    try:
        tables = parse_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"given {path}: this is not valid TOML: {str(error).splitlines()[0]}") from None
    for override in overrides:
        set_value(tables, override)
    return tables


def parse_deck(
    tables: Mapping[str, Any], name: str = "deck", folder: str | Path = ".", meshes: Path | None = None
) -> Deck:
    """Check the tables of a deck that is already read; see `read_deck`."""
    try:
        deck = Deck.model_validate(tables)
    except ValidationError as error:
        raise InputError(_reason(error)) from None
    deck._name, deck._folder, deck._meshes = name, Path(folder), meshes
    _check(deck)
    return deck


def set_value(tables: dict[str, Any], override: str) -> None:
    """Apply one ``key=value`` to the tables of a deck, in place."""
    key, equals, value = override.partition("=")
    if not equals or not key.strip() or "\n" in override:
        raise InputError(
            f"given --set {brief(override)}: write key=value, for example loads.pressure='20 kPa'"
        )
    path = key_path(key, f"--set {brief(override)}")
    try:
        parsed = parse_toml(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        parsed = value.strip()
    put(tables, path, parsed, f"--set {brief(override)}")


def key_path(key: str, given: str) -> list[str]:
    """The words of a dotted key; `given` is what the error line says of it."""
    try:
        return _first_path(parse_toml(f"{key} = 0"))
    except (tomllib.TOMLDecodeError, StopIteration):  # StopIteration: the key is a comment
        raise InputError(f"given {given}: {brief(key.strip())} is not a dotted key") from None


def put(tables: dict[str, Any], path: Sequence[str], value: Any, given: str) -> None:
    """Set the value at a path of a deck's tables, in place."""
    table = tables
    for depth, word in enumerate(path[:-1]):
        table = table.setdefault(word, {})
        if not isinstance(table, dict):
            raise InputError(f"given {given}: {'.'.join(path[: depth + 1])} is not a table in this deck")
    table[path[-1]] = value


def _first_path(table: Mapping[str, Any]) -> list[str]:
    key, value = next(iter(table.items()))
    return [key, *_first_path(value)] if isinstance(value, Mapping) else [key]


def nearest(given: str, allowed: Iterable[str]) -> str:
    """``"; did you mean 'wall'? allowed: ..."``: the end of the error line of a name that is not there."""
    names = sorted(allowed)
    close = difflib.get_close_matches(given.lower(), names, 1, 0.5)
    guess = f"; did you mean '{close[0]}'?" if close else ";"
    return f"{guess} allowed: {', '.join(names)}" if names else "; none is allowed here"


def refuse_unknown(given: Iterable[str], allowed: Iterable[str], where: str) -> None:
    """Refuse the first name of `given` that is not in `allowed`; `where` is the dotted table."""
    names = list(allowed)
    for name in given:
        if name not in names:
            raise InputError(f"given {where}.{name}: there is no such key{nearest(name, names)}")


def _reason(error: ValidationError) -> str:
    """The one line for what pydantic found first; an unknown key comes before all else."""
    found = sorted(error.errors(include_url=False), key=lambda e: e["type"] != "extra_forbidden")[0]
    location = [part for part in found["loc"] if part != ""]
    where = ".".join(str(part) for part in location)
    given, kind, context = found.get("input"), found["type"], found.get("ctx", {})
    if kind == "extra_forbidden":
        fields = _fields_at(Deck, location[:-1])
        return f"given {where}: there is no such key{nearest(str(location[-1]), fields)}"
    if kind == "missing":
        example = _EXAMPLES.get(where, "")
        return f"{where} is missing: it is needed{example}"
    if kind == "literal_error":
        return f"given {brief(given)} for {where}: allowed are {context['expected']}"
    if kind == "value_error":
        return f"given {brief(given)} for {where}: {context['error']}"
    if kind in ("model_type", "dict_type"):
        return f"given {brief(given)} for {where}: a table is needed ([{where}])"
    if kind in ("too_short", "too_long"):
        return f"given {brief(given)} for {where}: three numbers are needed{_EXAMPLES.get(where, '')}"
    if kind in _NEEDED:
        return f"given {brief(given)} for {where}: {_NEEDED[kind]}{_EXAMPLES.get(where, '')}"
    words = found["msg"].replace("Input should be", "it must be")
    return f"given {brief(given)} for {where}: {words[0].lower()}{words[1:]}"


_NEEDED = {
    "list_type": "a list is needed",
    "bool_type": "true or false is needed, without quotes",
    "string_type": "a text in quotes is needed",
    "float_type": "a number is needed",
    "float_parsing": "a number is needed",
    "int_type": "a whole number is needed",
}
_EXAMPLES = {
    "geometry": ', for example [geometry] with shape = "pneunet"',
    "loads": ', for example [loads] with pressure = "20 kPa"',
    "loads.path": ', for example path = ["5 kPa", "10 kPa"]',
    "loads.gravity": ", for example gravity = [0, 0, -9.81] (m/s^2)",
    "loads.tip_force": ', for example tip_force = [0, 0, "0.5 N"]',
    "loads.tip_displacement": ', for example tip_displacement = [0, 0, "2 mm"]',
    "loads.contact": ": contact = true",
    "supports.fixed": ', for example fixed = ["base"]',
    "observe.blocked": ": blocked = true",
    "solver.stop_at_touch": ": stop_at_touch = true",
}


def _fields_at(model: Any, location: Sequence[Any]) -> list[str]:
    """The keys that the table at `location` of a deck may have."""
    for part in location:
        if isinstance(model, type) and issubclass(model, BaseModel):
            model = model.model_fields[part].annotation
        else:
            model = get_args(model)[-1]  # the value of a dict, the item of a list
        while get_origin(model) in (Union, UnionType):
            model = next(kind for kind in get_args(model) if kind is not type(None))
    return list(model.model_fields) if isinstance(model, type) and issubclass(model, BaseModel) else []


def _check_geometry(geometry: Geometry) -> None:
    """A shape or a file, and not both."""
    if (geometry.shape is None) == (geometry.file is None):
        both = "both are given" if geometry.shape is not None else "neither is given"
        raise InputError(
            f"geometry needs either shape (a built-in one) or file (your own mesh or STEP): {both}"
        )


def _check(deck: Deck) -> None:
    """What no single value shows."""
    loads = deck.loads
    _check_geometry(deck.geometry)
    for name, material in deck.materials.items():
        if (material.card is None) == (material.law is None):
            raise InputError(
                f'materials.{name} needs either card or law, for example card = "dragon-skin-30"'
            )
        if material.card is not None:
            refuse_unknown(material.parameters, ("card", "bulk", "density"), f"materials.{name}")
    for number, obstacle in enumerate(loads.obstacles or []):
        if len(obstacle.model_dump(exclude_none=True)) != 1:
            raise InputError(f"loads.obstacles.{number} must be one of: plane, sphere, cylinder")
    _check_control(loads)
    if deck.observe.blocked and loads.tip_displacement is not None:
        raise InputError(
            "observe.blocked and loads.tip_displacement both hold the tip: leave one of them out"
        )
    if deck.observe.blocked and loads.tip_force is not None:
        raise InputError(
            "observe.blocked holds the tip, so loads.tip_force has no effect: leave one of them out"
        )


_END_OF_PATH = {
    "pressure": ("pressure",),
    "volume": ("volume", "volume_ratio"),
    "gas-mass": ("gas_mass_ratio",),
}


def _check_control(loads: LoadsTable) -> None:
    """The end of the path must be given in what is controlled, and once."""
    wanted = _END_OF_PATH[loads.control]
    given = [key for keys in _END_OF_PATH.values() for key in keys if getattr(loads, key) is not None]
    for key in given:
        if key not in wanted:
            control = next(word for word, keys in _END_OF_PATH.items() if key in keys)
            raise InputError(
                f'given loads.{key} with control = "{loads.control}": set control = "{control}", '
                f"or give {' or '.join('loads.' + word for word in wanted)}"
            )
    if len(given) != 1:
        raise InputError(f"loads needs {' or '.join(wanted)} ({'both are' if given else 'none is'} given)")
    if loads.path and loads.points:
        raise InputError(
            "given loads.path and loads.points: give one of them (points = N makes N equal load points)"
        )


def end_of_path(loads: LoadsTable) -> tuple[str, dict[str, Measure]]:
    """The key that says where the path ends (``"pressure"``, ``"volume"``, ...) and its value a cavity."""
    key = next(key for key in _END_OF_PATH[loads.control] if getattr(loads, key) is not None)
    return key, getattr(loads, key)
