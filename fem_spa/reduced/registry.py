"""The reduced models by kind, and their files. A new kind is one module and one line here.

A module of a kind has `read(table, where) -> ReducedModel`: the `[model]` table, and the folder that file
names in it are relative to. `kind = "fem"` solves a deck and is read where decks are solved; what it gives
is a `curve`.
"""

from __future__ import annotations

import importlib
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from fem_spa.errors import InputError
from fem_spa.reduced.model import ReducedModel
from fem_spa.reduced.tables import toml_text
from fem_spa.units import brief
from materials.bounded import read_toml

KINDS: dict[str, str] = {
    "curve": "fem_spa.reduced.curve",
    "kelvin-voigt": "fem_spa.reduced.viscoelastic",
    "chain": "fem_spa.reduced.chain",
    "rod": "fem_spa.reduced.rod",
    "pneunet": "fem_spa.reduced.finger",
    "segments": "fem_spa.reduced.segments",
    "surface": "fem_spa.reduced.surface",
}


def read_model(source: Path | str | Mapping[str, Any], where: Path | None = None) -> ReducedModel:
    """The model of a file, or of a table.

    Parameters
    ----------
    source : path of a TOML file with a `[model]` table, or that table
    where : folder that file names in the table are relative to; default: the file's, or the working folder

    Raises
    ------
    InputError : the file cannot be read, has no `[model]`, an unknown kind, key or unit, a value out of range
    """
    table = model_table(source)
    if where is None:
        where = Path() if isinstance(source, Mapping) else Path(source).parent
    kind = table.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        from fem_spa.deck import nearest

        raise InputError(
            f"given {brief(kind)} for model.kind: there is no such model{nearest(str(kind), KINDS)}"
        )
    return cast(ReducedModel, importlib.import_module(KINDS[kind]).read(table, where))


def model_table(source: Path | str | Mapping[str, Any]) -> Mapping[str, Any]:
    """The `[model]` table of a file, of all its tables, or as given; InputError where there is none."""
    if isinstance(source, Mapping):
        tables: Mapping[str, Any] = source
    else:
        try:
            tables = read_toml(Path(source))
        except OSError as error:
            raise InputError(
                f"given {source}: it cannot be read ({error.strerror}); give a model file"
            ) from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise InputError(f"given {source}: this is not TOML: {' '.join(str(error).split())}") from None
    table = tables.get("model", tables if "kind" in tables else None)
    if not isinstance(table, Mapping):
        raise InputError(
            f"given {brief(source) if isinstance(source, Mapping) else source}: a [model] table is needed"
        )
    return table


def model_text(model: ReducedModel) -> str:
    """The model as a TOML file that `read_model` reads back."""
    return toml_text(model.table())
