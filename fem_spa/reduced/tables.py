"""The `[model]` tables of model files: quantities of any unit, and the keys that every kind has.

[model]
kind = "kelvin-voigt"
k1 = "82.85 kPa/mm"
intervals = { k1 = ["81 kPa/mm", "85 kPa/mm"] }      # 95 %, once calibrated
sources = { k1 = "Table III" }
valid = { low = ["-50 kPa"], high = ["90 kPa"], error = "0.3 mm", source = "steps.csv" }
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from typing import Any

from fem_spa.errors import InputError
from fem_spa.reduced.model import Output, Parameter, Range
from fem_spa.units import ATMOSPHERE, brief, quantity

COMMON = ("kind", "intervals", "sources", "valid")
"""Keys that a table of any kind may have."""

_FACTORS = {
    "": 1.0,
    **{
        "N*m*s/rad": 1.0,
        "g": 1e-3,
        "m": 1.0,
        "mm": 1e-3,
        "deg": math.pi / 180,
        "rad": 1.0,
        "N": 1.0,
        "s": 1.0,
        "kPa": 1e3,
        "Pa": 1.0,
    },
    **{
        "kPa/mm": 1e6,
        "kPa*s/mm": 1e6,
        "mm/kPa": 1e-6,
        "N*m/rad": 1.0,
        "rad/(N*m)": 1.0,
        "N*m": 1.0,
        "kg": 1.0,
        "1/s": 1.0,
    },
}
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")


@cache
def factor(unit: str) -> float:
    """What one `unit` is in SI: 1e6 for "kPa/mm". InputError where pint does not know the unit."""
    return _FACTORS[unit] if unit in _FACTORS else float(_pint(unit).to_base_units().magnitude)


@cache
def same_kind(one: str, other: str) -> bool:
    """Whether two units measure the same thing; "deg" and "" do, as pint has it."""
    return one == other or bool(_pint(one).is_compatible_with(_pint(other)))


def _pint(unit: str) -> Any:
    from fem_spa.units import _registry

    try:
        return _registry().Quantity(1.0, unit)
    except Exception:  # pint answers nonsense with a dozen kinds of exception
        raise InputError(f"the unit '{unit}' is not known; give one such as kPa, mm, deg, kPa/mm") from None


def amount(given: Any, unit: str, name: str, low: float = -math.inf, high: float = math.inf) -> float:
    """A number with its unit, in SI.

    Parameters
    ----------
    given : text such as "82.85 kPa/mm"; a bare number only where `unit` is ""
    unit : what is expected, of any kind ("kPa/mm"); another unit of that kind is converted
    name : for the error line ("model.k1");  low, high : allowed range, ends included, SI

    Raises
    ------
    InputError : no number, no unit or one of another kind, not finite, out of range
    """
    if unit == "":
        value = quantity(given, "1", name)
    else:
        match = _NUMBER.fullmatch(given) if isinstance(given, str) else None
        if match is None or not match[2]:
            raise InputError(f"given {brief(given)} for {name}: a quantity such as '1 {unit}' is needed")
        if not same_kind(match[2], unit):
            raise InputError(f"given {brief(given)} for {name}: this is not in {unit} or a unit like it")
        value = float(match[1]) * factor(match[2])
    if not low <= value <= high:
        allowed = f"{shown(low, unit)} to {shown(high, unit)}"
        raise InputError(f"given {brief(given)} for {name}: allowed is {allowed}")
    return value


def shown(value: float, unit: str) -> str:
    """A value in SI as text in `unit`, to be read back: "82.85 kPa/mm"."""
    return f"{value / factor(unit):.12g} {unit}".strip()


def refuse_unknown(table: Mapping[str, Any], allowed: Iterable[str]) -> None:
    """InputError for the first key that neither this kind nor every kind has."""
    names = [*COMMON, *allowed]
    for key in table:
        if key not in names:
            from fem_spa.deck import nearest

            kind = table.get("kind")
            raise InputError(f"given model.{key}: kind '{kind}' has no such key{nearest(key, names)}")


def changed(
    parameters: Mapping[str, Parameter], values: Mapping[str, float], kind: str
) -> dict[str, Parameter]:
    """`parameters` with other values (SI); their intervals go, for they belong to the old values.

    Raises
    ------
    InputError : a name that is not there, or a value out of bounds or not a number
    """
    result = dict(parameters)
    for name, value in values.items():
        if name not in result:
            from fem_spa.deck import nearest

            raise InputError(f"given {name}: {kind} has no such parameter{nearest(name, result)}")
        p = result[name]
        if not p.low <= value <= p.high:
            allowed = f"{shown(p.low, p.unit)} to {shown(p.high, p.unit)}"
            raise InputError(f"given {shown(value, p.unit)} for {name}: allowed is {allowed}")
        result[name] = replace(p, value=float(value), interval=None)
    return result


def read_parameters(table: Mapping[str, Any], parameters: Mapping[str, Parameter]) -> dict[str, Parameter]:
    """`parameters` with the values, intervals and sources that a table has for them."""
    result = dict(parameters)
    intervals, sources = _inner(table, "intervals", result), _inner(table, "sources", result)
    for name, p in parameters.items():
        if name in table:
            p = replace(p, value=amount(table[name], p.unit, f"model.{name}", p.low, p.high), source="")
        if name in intervals:
            ends = intervals[name]
            if not isinstance(ends, list) or len(ends) != 2:
                raise InputError(f"given {brief(ends)} for model.intervals.{name}: two values are needed")
            low, high = (amount(end, p.unit, f"model.intervals.{name}") for end in ends)
            p = replace(p, interval=(low, high))
        result[name] = replace(p, source=str(sources[name])) if name in sources else p
    return result


def _inner(table: Mapping[str, Any], key: str, parameters: Mapping[str, Parameter]) -> Mapping[str, Any]:
    inner = table.get(key, {})
    if not isinstance(inner, Mapping):
        raise InputError(f"given {brief(inner)} for model.{key}: a table of parameter names is needed")
    for name in inner:
        if name not in parameters:
            from fem_spa.deck import nearest

            raise InputError(f"given model.{key}.{name}: no such parameter{nearest(name, parameters)}")
    return inner


def read_valid(table: Mapping[str, Any], outputs: tuple[Output, ...]) -> Range | None:
    """The range of a calibration, or None where the table has none."""
    if "valid" not in table:
        return None
    valid = table["valid"]
    if not isinstance(valid, Mapping) or not {"low", "high"} <= set(valid) <= {
        "low",
        "high",
        "error",
        "source",
    }:
        raise InputError("model.valid: low, high (a pressure a chamber), error and source are its keys")
    ends = []
    for end in ("low", "high"):
        given = valid[end] if isinstance(valid[end], list) else [valid[end]]
        ends.append(tuple(quantity(p, "Pa", f"model.valid.{end}", low=-ATMOSPHERE, zero=True) for p in given))
    error = amount(valid["error"], outputs[0].unit, "model.valid.error", 0.0) if "error" in valid else None
    return Range(ends[0], ends[1], error, str(valid.get("source", "")))


def common_table(
    kind: str,
    parameters: Mapping[str, Parameter],
    valid: Range | None,
    outputs: tuple[Output, ...],
    names: Iterable[str] | None = None,
) -> dict[str, Any]:
    """kind, parameters (or only `names` of them), intervals, sources and range as a `[model]` table."""
    kept = {n: p for n, p in parameters.items() if names is None or n in set(names)}
    table: dict[str, Any] = {"kind": kind}
    table |= {name: shown(p.value, p.unit) if p.unit else p.value for name, p in kept.items()}
    intervals = {
        n: [shown(x, p.unit) if p.unit else x for x in p.interval] for n, p in kept.items() if p.interval
    }
    sources = {n: p.source for n, p in kept.items() if p.source}
    table |= {"intervals": intervals} if intervals else {}
    table |= {"sources": sources} if sources else {}
    if valid is not None:
        low, high = ([shown(p, "kPa") for p in ends] for ends in (valid.low, valid.high))
        table["valid"] = {"low": low, "high": high}
        if valid.error is not None:
            table["valid"]["error"] = shown(valid.error, outputs[0].unit)
        if valid.source:
            table["valid"]["source"] = valid.source
    return table


def toml_text(table: Mapping[str, Any]) -> str:
    """`[model]` and its keys as TOML; inner tables inline."""
    return "[model]\n" + "".join(f"{key} = {_toml(value)}\n" for key, value in table.items())


def _toml(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(k)} = {_toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value)
    return json.dumps(value, ensure_ascii=False)
