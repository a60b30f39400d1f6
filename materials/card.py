"""Material cards: a law with its numbers, their source, and the range in which they may be trusted.

A card is a TOML file as in docs/materials.md. Those in materials/cards/ are known by name; any
other is given by its path.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from materials.bounded import read_toml
from materials.errors import MaterialError
from materials.laws import Law
from materials.names import allowed
from materials.registry import SmallStrain, law, resolve, small_strain
from materials.units import factor, quantity

FOLDER = Path(__file__).parent / "cards"
MODES = ("uniaxial", "equibiaxial", "planar")
_KEYS = (
    "name",
    "law",
    "parameters",
    "density",
    "bulk",
    "source",
    "note",
    "trusted_stretch",
    "fit",
    "stability",
    "inelastic",
)
_LAW_KIND = {"Pa": "pressure", "1": "number"}


@dataclass(frozen=True)
class Card:
    """A material ready for use; SI throughout.

    Parameters
    ----------
    name : as decks call it
    law : the law
    parameters : name -> value, every parameter of the law (Pa or dimensionless)
    intervals : name -> (low, high), 95 % interval of a fitted parameter
    bulk : bulk modulus, Pa; inf is incompressible
    density : kg/m^3, None where nobody stated it
    source : citation, or the test files with their sha256, one a line
    note : what to know before use
    trusted_stretch : least and largest principal stretch for which stated, not fitted, numbers are meant;
        None where nobody said, and where there are tests (`stretch_range` holds theirs)
    fit : modes, r2, rmse (Pa), stretch_range, as read
    stability : `stable` and mode -> (low, high), as read
    inelastic : `[inelastic]` table as read
    path : the file it came from
    """

    name: str
    law: Law
    parameters: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    bulk: float = math.inf
    density: float | None = None
    source: str = ""
    note: str = ""
    trusted_stretch: tuple[float, float] | None = None
    fit: Mapping[str, Any] = field(default_factory=dict)
    stability: Mapping[str, Any] = field(default_factory=dict)
    inelastic: Mapping[str, Any] = field(default_factory=dict)
    path: Path | None = None

    @property
    def stretch_range(self) -> tuple[float, float] | None:
        """Least and largest principal stretch of the tests behind the card; None where not stated."""
        value = self.fit.get("stretch_range")
        return None if value is None else (float(value[0]), float(value[1]))

    @property
    def stable(self) -> bool | None:
        """Whether the law is stable all over the scanned range; None where it was not scanned."""
        return self.stability.get("stable")

    @property
    def stable_ranges(self) -> dict[str, tuple[float, float]]:
        """Mode -> (low, high) of the stretch inside which the law is stable."""
        return {mode: (float(r[0]), float(r[1])) for mode, r in self.stability.items() if mode in MODES}

    @property
    def small_strain(self) -> SmallStrain:
        """mu, K, nu, E at rest."""
        return small_strain(self.law, self.parameters, self.bulk)


def card_names() -> list[str]:
    """Names of the cards that come with the program."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def load_card(name: str | Path) -> Card:
    """The card called `name`, or in the file `name` (a path: has a separator or ends in .toml).

    Raises
    ------
    MaterialError : no such card (nearest names given), unreadable file, broken TOML, or wrong content
    """
    text = str(name)
    if text.endswith(".toml") or "/" in text or "\\" in text:
        path = Path(text)
        if not path.is_file():
            raise MaterialError(
                f'card file "{text}" is not there; give a path, or one of: {", ".join(card_names())}'
            )
    else:
        path = FOLDER / f"{text}.toml"
        if text not in card_names():
            raise MaterialError(
                f'card "{text}" is not known; {allowed(text, card_names())}, or a path ending in .toml'
            )
    where = f'card "{text}"'
    try:
        table = read_toml(path)
    except tomllib.TOMLDecodeError as error:
        raise MaterialError(f"{where} is not valid TOML: {error}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise MaterialError(f"{where} cannot be read: {_one_line(error)}") from None
    return parse_card(table, where, path)


def parse_card(table: Mapping[str, Any], where: str, path: Path | None = None) -> Card:
    """A card from the table of its TOML; `where` begins every error."""
    for key in table:
        if key not in _KEYS:
            raise MaterialError(f'{where}: key "{key}" is not known; {allowed(key, _KEYS)}')
    if not isinstance(table.get("law"), str):
        raise MaterialError(f'{where}: `law` is missing; write for example law = "yeoh"')
    try:
        named = str(table["law"])
        if named.endswith(".py") and path is not None:
            named = str(path.parent / named)
        found = law(named)
    except MaterialError as error:
        raise MaterialError(f"{where}: {error}") from None
    rows = _table(table, "parameters", where)
    if not rows:
        raise MaterialError(
            f'{where}: [parameters] is missing; law "{found.name}" needs {", ".join(found.parameters)}'
        )
    values: dict[str, float] = {}
    intervals: dict[str, tuple[float, float]] = {}
    for name, row in rows.items():
        if name not in found.parameters:
            raise MaterialError(
                f'{where}: law "{found.name}" has no parameter "{name}"; {allowed(name, found.parameters)}'
            )
        values[name], interval = _parameter(row, _LAW_KIND[found.parameters[name]], f"{where}, {name}")
        if interval is not None:
            intervals[name] = interval
    bulk = quantity(table.get("bulk", "inf"), "pressure", f"{where}, bulk")
    density = quantity(table["density"], "density", f"{where}, density") if "density" in table else None
    if density is not None and not 10.0 <= density <= 25000.0:
        raise MaterialError(
            f"{where}: density is {density:g} kg/m^3; 10 to 25000 is allowed: is its unit wrong?"
        )
    card = Card(
        name=str(table.get("name", path.stem if path else "")),
        law=found,
        parameters=resolve(found, values, where),
        intervals=intervals,
        bulk=bulk,
        density=density,
        source=_source(table.get("source", "")),
        note=str(table.get("note", "")),
        trusted_stretch=_trusted(table, where),
        fit=_table(table, "fit", where),
        stability=_table(table, "stability", where),
        inelastic=_table(table, "inelastic", where),
        path=path,
    )
    _check_ranges(card, where)
    try:
        small_strain(found, card.parameters, bulk)
    except MaterialError as error:
        raise MaterialError(f"{where}: {error}") from None
    return card


def _one_line(error: Exception) -> str:
    return str(error).replace("\n", " ")


def _table(table: Mapping[str, Any], key: str, where: str) -> Mapping[str, Any]:
    value = table.get(key, {})
    if not isinstance(value, Mapping):
        raise MaterialError(f"{where}: `{key}` is {value!r}; a table [{key}] is needed")
    return value


def _source(value: object) -> str:
    if isinstance(value, list):
        rows = [
            f"{v['file']} sha256 {v['sha256']}"
            if isinstance(v, Mapping) and {"file", "sha256"} <= set(v)
            else str(v)
            for v in value
        ]
        return "\n".join(rows)
    return str(value)


def _parameter(row: object, kind: str, what: str) -> tuple[float, tuple[float, float] | None]:
    """Value and interval of one parameter: {value, unit, low, high} or "0.11 MPa"."""
    if not isinstance(row, Mapping):
        return quantity(row, kind, what), None
    for key in row:
        if key not in ("value", "unit", "low", "high"):
            raise MaterialError(
                f'{what}: key "{key}" is not known; {allowed(key, ("value", "unit", "low", "high"))}'
            )
    if "value" not in row or ("unit" not in row and kind != "number"):
        raise MaterialError(f'{what}: needs value and unit, such as {{ value = 0.11, unit = "MPa" }}')
    try:
        scale = factor(str(row.get("unit", "1")), kind)
    except MaterialError as error:
        raise MaterialError(f"{what}: {error}") from None
    numbers = [row.get(key) for key in ("value", "low", "high")]
    for key, number in zip(("value", "low", "high"), numbers, strict=True):
        if number is not None and (isinstance(number, bool) or not isinstance(number, int | float)):
            raise MaterialError(f"{what}: {key} is {number!r}; a number is needed")
    value, low, high = (None if n is None else float(n) * scale for n in numbers)
    assert value is not None
    return value, None if low is None or high is None else (low, high)


def _trusted(table: Mapping[str, Any], where: str) -> tuple[float, float] | None:
    value = table.get("trusted_stretch")
    if value is None:
        return None
    if not _is_range(value) or not value[0] <= 1.0 <= value[1]:
        raise MaterialError(
            f"{where}: trusted_stretch is {value!r}; [low, high] with 0 < low <= 1 <= high is needed"
        )
    if "stretch_range" in _table(table, "fit", where):
        raise MaterialError(
            f"{where}: trusted_stretch is for stated numbers, and [fit] stretch_range for fitted ones; "
            "leave one of them out"
        )
    return float(value[0]), float(value[1])


def _is_range(value: object) -> bool:
    return (
        isinstance(value, list | tuple)
        and len(value) == 2
        and all(isinstance(v, int | float) and not isinstance(v, bool) for v in value)
        and 0 < value[0] <= value[1]
    )


def _check_ranges(card: Card, where: str) -> None:
    ranges = {f"[stability] {mode}": card.stability.get(mode) for mode in MODES}
    ranges["[fit] stretch_range"] = card.fit.get("stretch_range")
    for what, value in ranges.items():
        if value is None:
            continue
        if not _is_range(value):
            raise MaterialError(f"{where}: {what} is {value!r}; [low, high] with 0 < low <= high is needed")
    if not isinstance(card.stable, bool | None):
        raise MaterialError(f"{where}: [stability] stable is {card.stable!r}; true or false is needed")
