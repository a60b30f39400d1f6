"""The deck, a run's input: TOML tables -> checked values with units, or one line saying why not.

The tables and keys are those that other programs rely on; nothing here knows meshes or solvers.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    PlainValidator,
    ValidationError,
)

from fem_spa.errors import InputError
from fem_spa.units import ATMOSPHERE, brief, quantity


@dataclass(frozen=True)
class Measure:
    """A quantity as it was written, and its value in SI."""

    text: str | float
    si: float


def measure(unit: str, **limits: Any) -> Any:
    """The type of a deck value in `unit`; `limits` are those of `fem_spa.units.quantity`."""
    return Annotated[
        Measure,
        PlainValidator(lambda given: Measure(given, quantity(given, unit, **limits))),
        PlainSerializer(lambda value: value.text),
    ]


def per_cavity(value: Any) -> Any:
    """The type of a value for every cavity, or of a table cavity -> value; the key "" means every cavity."""
    return Annotated[
        dict[str, value],
        BeforeValidator(lambda given: given if isinstance(given, Mapping) else {"": given}),
        PlainSerializer(lambda table: _texts(table[""] if set(table) == {""} else table)),
    ]


def _texts(value: Any) -> Any:
    return {k: v.text for k, v in value.items()} if isinstance(value, Mapping) else value.text


HIGHEST_PRESSURE = 100e6
PRESSURE_LIMITS = {"low": -ATMOSPHERE, "high": HIGHEST_PRESSURE}
VOLUME_LIMITS = {"positive": True, "high": 1.0}
RATIO_LIMITS = {"positive": True, "high": 1000.0}

Three = Field(min_length=3, max_length=3)
Strict = ConfigDict(extra="forbid", frozen=True)
Open = ConfigDict(extra="allow", frozen=True)
Axis = Literal["x", "y", "z"]
Flag = Annotated[bool, Field(strict=True)]
Count = Annotated[int, Field(strict=True, ge=1, le=100_000)]
Number = Annotated[float, Field(allow_inf_nan=False, ge=-1000.0, le=1000.0)]
Length = measure("m", high=2.0, low=-2.0, zero=True)
Force = measure("N", high=1e4, low=-1e4, zero=True)


class Geometry(BaseModel):
    """A built-in shape, whose parameters are the remaining keys, or a file."""

    model_config = Open
    shape: str | None = None
    file: str | None = None
    unit: str | None = None
    size: measure("m", low=1e-5, high=0.5) | None = None  # type: ignore[valid-type]

    @property
    def parameters(self) -> dict[str, Any]:
        """The keys that belong to the shape."""
        return dict(self.model_extra or {})


class MaterialTable(BaseModel):
    """A card, or a law whose parameters are the remaining keys."""

    model_config = Open
    card: str | None = None
    law: str | None = None
    bulk: measure("Pa", low=1e3, infinite=True) | None = None  # type: ignore[valid-type]
    density: measure("kg/m^3", low=1.0, high=25e3) | None = None  # type: ignore[valid-type]

    @property
    def parameters(self) -> dict[str, Any]:
        """The keys that belong to the law."""
        return dict(self.model_extra or {})


class LayerTable(BaseModel):
    """A membrane on an inner surface."""

    model_config = Strict
    modulus: measure("Pa", low=1e3, high=1e13)  # type: ignore[valid-type]
    thickness: measure("m", low=1e-7, high=0.1)  # type: ignore[valid-type]
    poisson: Annotated[float, Field(gt=-1.0, le=0.5)] = 0.3


class Supports(BaseModel):
    """What is held."""

    model_config = Strict
    fixed: list[str] = ["base"]
    symmetry: dict[str, Axis] | None = None


class Plane(BaseModel):
    model_config = Strict
    point: Annotated[list[Length], Three]  # type: ignore[valid-type]
    normal: Annotated[list[Number], Three]


class Sphere(BaseModel):
    model_config = Strict
    centre: Annotated[list[Length], Three]  # type: ignore[valid-type]
    radius: measure("m", positive=True, high=2.0)  # type: ignore[valid-type]


class Cylinder(BaseModel):
    model_config = Strict
    point: Annotated[list[Length], Three]  # type: ignore[valid-type]
    axis: Annotated[list[Number], Three]
    radius: measure("m", positive=True, high=2.0)  # type: ignore[valid-type]


class Obstacle(BaseModel):
    """A rigid body in the way: one of three."""

    model_config = Strict
    plane: Plane | None = None
    sphere: Sphere | None = None
    cylinder: Cylinder | None = None


class LoadsTable(BaseModel):
    """What drives the actuator, and in which order."""

    model_config = Strict
    pressure: per_cavity(measure("Pa", **PRESSURE_LIMITS)) | None = None  # type: ignore[valid-type]
    volume: per_cavity(measure("m^3", **VOLUME_LIMITS)) | None = None  # type: ignore[valid-type]
    volume_ratio: per_cavity(measure("1", **RATIO_LIMITS)) | None = None  # type: ignore[valid-type]
    gas_mass_ratio: per_cavity(measure("1", **RATIO_LIMITS)) | None = None  # type: ignore[valid-type]
    path: list[Any] | None = None
    points: Annotated[int, Field(strict=True, ge=1, le=10_000)] | None = None
    gravity: Annotated[list[Number], Three] | None = None
    tip_force: Annotated[list[Force], Three] | None = None  # type: ignore[valid-type]
    tip_displacement: Annotated[list[Length], Three] | None = None  # type: ignore[valid-type]
    control: Literal["pressure", "volume", "gas-mass"] = "pressure"
    contact: Flag = True
    obstacles: list[Obstacle] | None = None


class Observe(BaseModel):
    """What is read off."""

    model_config = Strict
    angle: Literal["tip-face", "chord", "tangent"] = "tip-face"
    blocked: Flag = False


class SolverTable(BaseModel):
    """How the path is walked; the answer does not depend on it."""

    model_config = Strict
    imposed_steps: Count | None = None
    tolerance: Annotated[float, Field(gt=0.0, le=1e-3)] = 1e-8
    max_iterations: Annotated[int, Field(strict=True, ge=3, le=200)] = 15


class Deck(BaseModel):
    """A whole deck, checked as far as that goes without its mesh.

    `name` is the deck's file name without its ending, `folder` the place that its paths start from.
    """

    model_config = Strict
    geometry: Geometry
    materials: dict[str, MaterialTable] = {}
    layers: dict[str, LayerTable] = {}
    supports: Supports = Supports()
    loads: LoadsTable
    observe: Observe = Observe()
    solver: SolverTable = SolverTable()
    _name: str = "deck"
    _folder: Path = Path()

    @property
    def name(self) -> str:
        """The name that the output folder takes."""
        return self._name

    @property
    def folder(self) -> Path:
        """Where the deck's relative paths start."""
        return self._folder

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
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"given {path}: there is no such file; give the path of a deck (.toml)") from None
    except IsADirectoryError:
        raise InputError(f"given {path}: this is a folder; give the path of a deck (.toml)") from None
    except UnicodeDecodeError:
        raise InputError(f"given {path}: this is not a text file; a deck is TOML in UTF-8") from None
    except OSError as error:
        raise InputError(f"given {path}: it cannot be read ({error.strerror})") from None
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"given {path}: this is not valid TOML: {str(error).splitlines()[0]}") from None
    for override in overrides:
        set_value(tables, override)
    return parse_deck(tables, name=path.stem, folder=path.parent)


def parse_deck(tables: Mapping[str, Any], name: str = "deck", folder: str | Path = ".") -> Deck:
    """Check the tables of a deck that is already read; see `read_deck`."""
    try:
        deck = Deck.model_validate(tables)
    except ValidationError as error:
        raise InputError(_reason(error)) from None
    deck._name, deck._folder = name, Path(folder)
    _check(deck)
    return deck


def set_value(tables: dict[str, Any], override: str) -> None:
    """Apply one ``key=value`` to the tables of a deck, in place."""
    key, equals, value = override.partition("=")
    if not equals or not key.strip() or "\n" in override:
        raise InputError(
            f"given --set {brief(override)}: write key=value, for example loads.pressure='20 kPa'"
        )
    try:
        path = _first_path(tomllib.loads(f"{key} = 0"))
    except tomllib.TOMLDecodeError:
        raise InputError(f"given --set {brief(override)}: '{key.strip()}' is not a dotted key") from None
    try:
        parsed = tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        parsed = value.strip()
    table = tables
    for depth, word in enumerate(path[:-1]):
        table = table.setdefault(word, {})
        if not isinstance(table, dict):
            raise InputError(
                f"given --set {brief(override)}: {'.'.join(path[: depth + 1])} is not a table in this deck"
            )
    table[path[-1]] = parsed


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
        return f"given {brief(given)} for {where}: three numbers are needed"
    words = found["msg"].replace("Input should be", "it must be")
    return f"given {brief(given)} for {where}: {words[0].lower()}{words[1:]}"


_EXAMPLES = {
    "geometry": ', for example [geometry] with shape = "pneunet"',
    "loads": ', for example [loads] with pressure = "20 kPa"',
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


def _check(deck: Deck) -> None:
    """What no single value shows."""
    geometry, loads = deck.geometry, deck.loads
    if (geometry.shape is None) == (geometry.file is None):
        both = "both are given" if geometry.shape is not None else "neither is given"
        raise InputError(
            f"geometry needs either shape (a built-in one) or file (your own mesh or STEP): {both}"
        )
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
    if loads.obstacles:
        raise InputError(
            "loads.obstacles: obstacles come with contact mechanics, which this version does not have"
        )
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
