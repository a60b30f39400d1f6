"""Model files with effects: a `[model]` table, and `[effects.NAME]` tables that `diagnose` adds.

[scales]                       # what shares in the tables below mean
pressure = "50 kPa"
response = [0.71]              # SI unit of the output, before gain
rest = [0.0]
cycles = 21.5
seconds = 400.0

[effects.creep]
share at 0.8 s = 0.02          # quoted in the file
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from fem_spa.errors import InputError
from fem_spa.loop.base import Base
from fem_spa.loop.compose import Chain
from fem_spa.loop.effects.effect import Effect
from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.reduced.model import ReducedModel
from fem_spa.reduced.registry import read_model
from fem_spa.units import quantity
from materials.bounded import read_toml

if TYPE_CHECKING:
    from fem_spa.loop.base_fem import DeckModel


@dataclass(frozen=True)
class Source:
    """What a model file holds.

    Attributes
    ----------
    effects, thetas : in causal order
    scales : p_max (Pa), scale, rest (d,), cycles, seconds
    deck : of kind "fem", what is solved again, and `forms`: for which effects
    """

    model: ReducedModel
    effects: tuple[Effect, ...] = ()
    thetas: tuple[np.ndarray, ...] = ()
    scales: Mapping[str, Any] | None = None
    deck: DeckModel | None = None
    forms: str = "none"

    def chain(self, base: Base) -> Chain:
        """The chain of a base with the file's effects.

        Raises
        ------
        InputError
            where the file's scales are of another number of outputs
        """
        assert self.scales is not None
        count = len(self.scales["scale"])
        if count != len(base.names):
            raise InputError(
                f"the model's [scales] are of {count} output(s), the records have {', '.join(base.names)}: "
                "give records of the outputs that it was diagnosed with"
            )
        return Chain(base, 1.0, np.zeros(len(base.names)), self.effects, self.thetas, **self.scales)


def read_source(
    path: Path, out: Path | None = None, say: Callable[[str], None] = lambda text: None
) -> Source:
    """Read a model file.

    Parameters
    ----------
    out : folder of results, where what is solved of a deck is kept;  say : told of every solve

    Raises
    ------
    InputError
        for what is missing, unknown, or out of range
    """
    try:
        tables = read_toml(path)
    except OSError as error:
        raise InputError(f"model {path} cannot be read: {error.strerror}; give a model file") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"model {path} is not TOML: {' '.join(str(error).split())}") from None
    unknown = sorted(set(tables) - {"model", "effects", "scales"})
    if unknown:
        raise InputError(f"model {path}: unknown table [{unknown[0]}]; model, effects, scales are allowed")
    table = tables.get("model")
    deck, forms = None, "none"
    if isinstance(table, Mapping) and table.get("kind") == "fem":
        from fem_spa.loop.base_fem import plain, read_deck_model

        deck = read_deck_model(table, path.parent, out, say)
        loaded = deck.gravity or deck.payload or deck.payload_share
        model = cast(ReducedModel, deck if loaded else plain(deck))
        forms = str(table.get("forms", "auto"))
    else:
        model = read_model(path)
    given = tables.get("effects", {})
    if not isinstance(given, Mapping):
        raise InputError(f"model {path}: effects are tables, for example [effects.creep]")
    names = sorted(given, key=lambda n: EFFECTS[n].order if n in EFFECTS else 0)
    thetas = tuple(_theta(path, name, given[name]) for name in names)
    scales = _scales(path, tables.get("scales"), len(model.outputs)) if names else None
    return Source(model, tuple(EFFECTS[name] for name in names), thetas, scales, deck, forms)


def _theta(path: Path, name: str, table: Any) -> np.ndarray:
    if name not in EFFECTS:
        raise InputError(f"model {path}: unknown effect '{name}'; known are {', '.join(EFFECTS)}")
    effect = EFFECTS[name]
    values = []
    known = ", ".join(p.name for p in effect.parameters)
    if not isinstance(table, Mapping):
        raise InputError(f"model {path}: effects.{name} = {table!r}; a table is needed, with {known}")
    wrong = sorted(set(table) - {p.name for p in effect.parameters})
    if wrong:
        raise InputError(
            f"model {path}, effects.{name}: unknown key '{wrong[0]}'; known are {known}. A file of another "
            "version: run diagnose on the first model again"
        )
    for parameter, null in zip(effect.parameters, effect.null, strict=True):
        if parameter.name not in table and not parameter.amplitude and null != 0.0:
            raise InputError(
                f"model {path}, effects.{name}: '{parameter.name}' is missing; needed are {known}"
            )
        value = table.get(parameter.name, float(null))
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InputError(f"model {path}, effects.{name}.{parameter.name}: a plain number is needed")
        if not parameter.low <= value <= parameter.high:
            raise InputError(
                f"model {path}, effects.{name}: {parameter.name} = {value:g}; from {parameter.low:g} to "
                f"{parameter.high:g} is allowed"
            )
        values.append(float(value))
    return np.array(values)


def _scales(path: Path, table: Any, outputs: int) -> dict[str, Any]:
    """The numbers that shares refer to."""
    needed = ("pressure", "response", "rest", "cycles", "seconds")
    if not isinstance(table, Mapping) or set(table) != set(needed):
        raise InputError(f"model {path}: effects need a table [scales] with {', '.join(needed)}")
    count = len(table["response"]) if isinstance(table["response"], list) else 1
    lists = [_numbers(path, key, table[key], min(max(count, 1), outputs)) for key in ("response", "rest")]
    spans = [_numbers(path, key, table[key], 1)[0] for key in ("cycles", "seconds")]
    if np.any(lists[0] == 0.0) or min(spans) <= 0.0:
        raise InputError(f"model {path}, scales: response may not be 0, cycles and seconds must be above 0")
    return {
        "scale": lists[0],
        "rest": lists[1],
        "p_max": quantity(table["pressure"], "Pa", "scales.pressure", positive=True),
        "cycles": float(spans[0]),
        "seconds": float(spans[1]),
    }


def _numbers(path: Path, key: str, given: Any, count: int) -> np.ndarray:
    """(count,) finite numbers of [scales]."""
    values = given if isinstance(given, list) else [given]
    plain = all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values)
    if len(values) != count or not plain or not np.isfinite(np.asarray(values, float)).all():
        raise InputError(f"model {path}, scales: {key} = {given!r}; {count} plain number(s) are needed")
    return np.asarray(values, float)


def source_tables(source: Source, chain: Chain, out: Path) -> dict[str, Any]:
    """The tables of a model file in the folder `out`: refitted base, the effects it brought and those of
    `chain`."""
    base = chain.base
    values = base.refitted()
    parameters = source.model.parameters
    if base.gain and "gain" in parameters:
        values["gain"] = chain.gain * parameters["gain"].value
    for name, offset in zip(base.names, chain.offset, strict=True):
        key = "offset" if len(base.names) == 1 else f"offset_{name}"
        if key in parameters:
            own = 0.0 if source.model.kind == "kelvin-voigt" else parameters[key].value
            values[key] = own * (chain.gain if base.gain else 1.0) + float(offset)
    inside = {k: float(np.clip(v, parameters[k].low, parameters[k].high)) for k, v in values.items()}
    tables: dict[str, Any] = {"model": source.model.with_values(**inside).table()}
    if "deck" in tables["model"]:
        deck = Path(tables["model"]["deck"]).resolve()
        tables["model"]["deck"] = Path(os.path.relpath(deck, out.resolve())).as_posix()
    both = [*zip(source.effects, source.thetas, strict=True), *zip(chain.effects, chain.thetas, strict=True)]
    if both:
        tables["scales"] = {
            "pressure": f"{chain.p_max / 1e3:.12g} kPa",
            "response": [float(x) for x in chain.scale * chain.gain],
            "rest": [float(x) for x in (chain.gain * chain.rest + chain.offset if base.gain else chain.rest)],
            "cycles": chain.cycles,
            "seconds": chain.seconds,
        }
        tables["effects"] = {
            effect.name: {p.name: float(f"{v:.10g}") for p, v in zip(effect.parameters, theta, strict=True)}
            for effect, theta in both
        }
    return tables
