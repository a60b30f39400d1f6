"""Units at the file boundary: `"18 mm"` becomes 0.018 (m). Inside the program everything is SI.

Common units are read without pint, whose import takes longer than the whole of `--help`; any other
unit that pint knows is read by pint. Both give the same number (tests/cli/test_units.py).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache
from typing import Any

from fem_spa.errors import InputError

ATMOSPHERE = 101325.0
"""Standard atmosphere, Pa: no vacuum is deeper than this."""


@dataclass(frozen=True)
class Kind:
    """What a unit measures: the words and the example of an error line."""

    name: str
    example: str


KINDS: dict[str, Kind] = {
    "m": Kind("a length", "18 mm"),
    "m^2": Kind("an area", "24 mm^2"),
    "m^3": Kind("a volume", "30 ml"),
    "Pa": Kind("a pressure or modulus", "20 kPa"),
    "N": Kind("a force", "0.5 N"),
    "kg": Kind("a mass", "20 g"),
    "kg/m^3": Kind("a density", "1080 kg/m^3"),
    "m/s^2": Kind("an acceleration", "9.81 m/s^2"),
    "rad": Kind("an angle", "30 deg"),
    "rad/(N*m)": Kind("a compliance against a moment", "10 deg/(N*m)"),
    "s": Kind("a time", "0.5 s"),
    "1": Kind("a plain number", "0.45"),
}

_COMMON: dict[str, dict[str, float]] = {
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "µm": 1e-6, "km": 1e3, "in": 0.0254, "inch": 0.0254},
    "m^2": {"m^2": 1.0, "mm^2": 1e-6, "cm^2": 1e-4},
    "m^3": {"m^3": 1.0, "mm^3": 1e-9, "cm^3": 1e-6, "ml": 1e-6, "mL": 1e-6, "l": 1e-3, "L": 1e-3},
    "Pa": {"Pa": 1.0, "hPa": 1e2, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "mbar": 1e2, "bar": 1e5, "N/mm^2": 1e6},
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    "kg": {"kg": 1.0, "g": 1e-3, "mg": 1e-6},
    "kg/m^3": {"kg/m^3": 1.0, "g/cm^3": 1e3},
    "m/s^2": {"m/s^2": 1.0},
    "rad": {"rad": 1.0, "deg": math.pi / 180.0},
    "rad/(N*m)": {"rad/(N*m)": 1.0, "deg/(N*m)": math.pi / 180.0},
    "s": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    "1": {"": 1.0, "1": 1.0},
}

_NUMBER = re.compile(
    r"\s*([+-]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|(?:inf(?:inity)?|nan)(?!\w)))\s*(.*?)\s*",
    re.IGNORECASE,
)


def quantity(
    given: Any,
    unit: str,
    name: str | None = None,
    *,
    low: float | None = None,
    high: float | None = None,
    positive: bool = False,
    infinite: bool = False,
    zero: bool = False,
) -> float:
    """Read a number with its unit.

    Parameters
    ----------
    given : text such as ``"18 mm"``; a bare number only where `unit` is ``"1"``
    unit : the SI unit of the answer, one of `KINDS`
    name : what is being read, for the error line (``"geometry.wall"``); None leaves it out
    low, high : allowed range, ends included, in `unit`
    positive : whether zero and less are refused
    infinite : whether ``"inf"`` is allowed
    zero : whether a bare 0, which has the same size in every unit, is allowed

    Returns
    -------
    float in `unit`

    Raises
    ------
    InputError
        In one line: what was given, what is needed, an example.
    """
    value = _value(given, unit, name, infinite, zero)
    if math.isnan(value):
        raise InputError(_line(given, name, "this is not a number"))
    if math.isinf(value) and not (infinite and value > 0.0):
        raise InputError(_line(given, name, "it must be finite"))
    if positive and value <= 0.0:
        raise InputError(_line(given, name, "it must be greater than zero"))
    if low is not None and value < low:
        raise InputError(_line(given, name, f"the least allowed is {show(low, unit)}"))
    if high is not None and value > high and not (infinite and math.isinf(value)):
        raise InputError(_line(given, name, f"the most allowed is {show(high, unit)}"))
    return value


def _value(given: Any, unit: str, name: str | None, infinite: bool, zero: bool) -> float:
    """`given` in `unit`, before any range is looked at."""
    kind = KINDS[unit]
    needed = f"{kind.name} is needed, for example " + (kind.example if unit == "1" else f"'{kind.example}'")
    if isinstance(given, bool) or not isinstance(given, (int, float, str)):
        raise InputError(_line(given, name, needed))
    if isinstance(given, (int, float)):
        if unit == "1" or (zero and given == 0) or not math.isfinite(given):
            return float(given)
        guess = f"'{given:g} {kind.example.split(' ', 1)[1]}'"
        raise InputError(_line(given, name, f"a unit is missing; write for example {guess}"))
    match = _NUMBER.fullmatch(given)
    if match is None:
        raise InputError(_line(given, name, needed))
    number, written = float(match[1]), match[2].replace("**", "^")
    if not math.isfinite(number):
        if math.isnan(number) or written == "":
            return number
        raise InputError(_line(given, name, needed))
    factor = _COMMON[unit].get(written)
    if factor is not None:
        return _scaled(number, factor)
    if not written and not (zero and number == 0.0):
        raise InputError(_line(given, name, f"a unit is missing; {needed}"))
    return number if not written else _value_by_pint(given, number, written, unit, name, needed)


def _scaled(number: float, factor: float) -> float:
    """`number * factor`, rounded once: 18 mm is 0.018 m to the last bit."""
    parts = round(1.0 / factor)
    return number / parts if factor < 1.0 and factor == 1.0 / parts else number * factor


def _value_by_pint(
    given: str, number: float, written: str, unit: str, name: str | None, needed: str
) -> float:
    """The slow path: any unit that pint knows."""
    registry = _registry()
    try:
        found = registry.Quantity(number, written)
        target = "dimensionless" if unit == "1" else unit
        if found.is_compatible_with(target):
            return float(found.to(target).magnitude)
    except Exception:  # pint answers nonsense with a dozen kinds of exception, of the tokenizer's too
        raise InputError(_line(given, name, f"the unit '{written}' is not known; {needed}")) from None
    raise InputError(_line(given, name, needed))


@cache
def _registry() -> Any:
    """pint's registry, made once."""
    import pint

    return pint.UnitRegistry()


def kind_of(unit: str) -> str | None:
    """The SI unit, one of `KINDS`, of what a unit measures; None for a unit that is not known."""
    written = unit.strip().replace("**", "^")
    for si, known in _COMMON.items():
        if written in known:
            return si
    for si in (*(kind for kind in KINDS if kind != "1"), "1"):
        try:
            quantity(f"1 {unit}", si)
        except InputError:
            continue
        return si
    return None


def _line(given: Any, name: str | None, reason: str) -> str:
    """The one line of an error; without a name only its second half."""
    return reason if name is None else f"given {brief(given)} for {name}: {reason}"


def brief(given: Any) -> str:
    """What was given, as a deck shows it, on one line and not longer than 60 characters."""
    text = (
        f"'{given}'"
        if isinstance(given, str)
        else str(given).lower()
        if isinstance(given, bool)
        else str(given)
    )
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."


_HABIT: dict[str, tuple[tuple[float, str], ...]] = {
    "m": ((1.0, "m"), (1e-3, "mm"), (1e-6, "um")),
    "Pa": ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa")),
    "m^3": ((1e-6, "ml"), (1e-9, "mm^3")),
}


def show(value: float, unit: str) -> str:
    """A value in SI as people write it: ``show(0.018, "m")`` is ``"18 mm"``; the text can be read back."""
    if unit == "1":
        return f"{value:.12g}"
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    for factor, written in _HABIT.get(unit, ()):
        if abs(value) >= factor * (1.0 - 1e-12):
            return f"{value / factor:.12g} {written}"
    smallest = _HABIT.get(unit, ((1.0, unit),))[-1]
    return f"{value / smallest[0]:.12g} {smallest[1]}"
