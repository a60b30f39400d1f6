"""`--vary key=lo:hi:n` and `key=a,b,c`: texts -> the values that a key of the deck takes."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from typing import Any

from fem_spa.deck import key_path
from fem_spa.errors import InputError
from fem_spa.units import KINDS, brief, kind_of, quantity

MOST_VALUES = 10_000
"""Values of one key, and cases of one sweep: each is a finite-element run."""
_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)", re.DOTALL)
_HOW = "write lo:hi:n, such as geometry.wall=1mm:2mm:5, or values, such as geometry.wall=1mm,1.5mm"


@dataclass(frozen=True)
class Value:
    """One value of a key.

    given : what the deck gets, a TOML value ("1.25 mm", 3, true, [0, 0, -9.81])
    number : in the axis's unit; None for a word
    text : without the unit, as exact as `given`
    """

    given: Any
    number: float | None
    text: str

    @property
    def label(self) -> str:
        """Without the unit, numbers to six digits: for pages, pictures and sentences."""
        return self.text if self.number is None else f"{self.number:.6g}"


@dataclass(frozen=True)
class Axis:
    """A key that varies.

    key : dotted, as in a deck;  path : its words
    unit : of all its numbers, as it was written first ("mm"); "" for plain numbers and words
    values : of the grid; where only a range was given, its two ends
    interval : (low, high) in `unit` of a range; None for a list
    sampled : whether points are drawn from it, so that `values` are only its ends
    """

    key: str
    path: tuple[str, ...]
    unit: str
    values: tuple[Value, ...]
    interval: tuple[float, float] | None = None
    sampled: bool = False

    @property
    def title(self) -> str:
        """`geometry.wall [mm]`, as a column of a table is called."""
        return f"{self.key} [{self.unit}]" if self.unit else self.key

    @property
    def numeric(self) -> bool:
        """Whether its values are numbers, so that they have an order and a distance."""
        return all(value.number is not None for value in self.values)

    def at(self, share: float, whole: bool = False) -> Value:
        """The value at a share (0 to below 1) of the range, to six digits, or of the list.

        whole : only whole numbers are values
        """
        if self.interval is None:
            return self.values[int(share * len(self.values))]
        low, high = self.interval
        if whole:
            first, last = sorted((round(low), round(high)))
            return _number(first + int(share * (last - first + 1)), self.unit)
        return _number(float(f"{low + share * (high - low):.6g}"), self.unit)


def read_axis(text: str, sampled: bool = False) -> Axis:
    """One `--vary`.

    Parameters
    ----------
    text : "key=lo:hi:n" or "key=a,b,c"
    sampled : whether `key=lo:hi` is enough, as points are drawn from the range

    Raises
    ------
    InputError
        in one line
    """
    given = f"--vary {brief(text)}"
    key, equals, what = text.partition("=")
    key, what = key.strip(), what.strip()
    if not equals or not key or not what or "\n" in text:
        raise InputError(f"given {given}: {_HOW}")
    path = tuple(key_path(key, given))
    parts = _split(what, ":")
    if len(parts) > 1 and all(_NUMBER.match(part) for part in parts[:2]):
        return _range(key, path, parts, given, sampled)
    items = _split(what, ",")
    if not all(items):
        raise InputError(f"given {given}: a value is empty; {_HOW}")
    if len(items) > MOST_VALUES:
        raise InputError(f"given {given}: {len(items)} values; at most {MOST_VALUES} are allowed")
    return _list(key, path, items)


def _range(key: str, path: tuple[str, ...], parts: list[str], given: str, sampled: bool) -> Axis:
    if len(parts) == 2 and not sampled:
        raise InputError(f"given {given}: how many values? {_HOW} (--sample needs no number)")
    if len(parts) > 3:
        raise InputError(f"given {given}: lo:hi:n has three parts, here are {len(parts)}")
    count = 2
    if len(parts) == 3:
        if not re.fullmatch(r"\d{1,18}", parts[2]):
            raise InputError(f"given {given}: '{parts[2][:20]}' is not a number of values; {_HOW}")
        count = int(parts[2])
        if not 2 <= count <= MOST_VALUES:
            raise InputError(f"given {given}: {count} values; 2 to {MOST_VALUES} are allowed")
    (low, unit), (high, other) = (_quantity(part, given) for part in parts[:2])
    high *= _factor(other, unit, given)
    if low == high:
        raise InputError(f"given {given}: both ends are {low:g} {unit}".rstrip() + "; give two that differ")
    steps = [low + (high - low) * i / (count - 1) for i in range(count - 1)] + [high]
    values = tuple(_number(float(f"{step:.12g}"), unit) for step in steps)
    return Axis(key, path, unit, values, (low, high), sampled)


def _list(key: str, path: tuple[str, ...], items: list[str]) -> Axis:
    """Numbers of one kind, all in the first one's unit; else words, flags, lists or tables of TOML."""
    try:
        pairs = [_quantity(item, key) for item in items]
        unit = pairs[0][1]
        numbers = [number * _factor(other, unit, key) for number, other in pairs]
    except InputError:
        return Axis(key, path, "", tuple(_word(item) for item in items))
    return Axis(key, path, unit, tuple(_number(float(f"{number:.12g}"), unit) for number in numbers))


def _number(value: float, unit: str) -> Value:
    text = f"{value:.12g}"
    plain: Any = int(value) if value == int(value) and abs(value) < 1e15 else value
    return Value(f"{text} {unit}" if unit else plain, float(value), text)


def _word(item: str) -> Value:
    try:
        given = tomllib.loads(f"value = {item}")["value"]
    except tomllib.TOMLDecodeError:
        given = item
    return Value(given, None, given if isinstance(given, str) else item)


def _quantity(text: str, given: str) -> tuple[float, str]:
    """("1.5 mm") -> (1.5, "mm"); quotes around it do not count."""
    text = text.strip().strip("\"'").strip()
    match = _NUMBER.fullmatch(text)
    if match is None:
        raise InputError(f"given {given}: {brief(text)} is not a number with a unit")
    value, unit = float(match[1]), match[2].strip()
    if value in (float("inf"), float("-inf")):
        raise InputError(f"given {given}: {brief(text)} is not finite")
    if unit:
        _kind(unit, given)
    return value, unit


def _kind(unit: str, given: str) -> str:
    """The SI unit of what a unit measures."""
    found = kind_of(unit)
    if found is None:
        known = "allowed is such as mm, kPa, deg"
        raise InputError(f"given {given}: the unit {brief(unit)} is not known; {known}")
    return found


def _factor(unit: str, wanted: str, given: str) -> float:
    """What turns numbers in `unit` into numbers in `wanted`."""
    if unit == wanted:
        return 1.0
    if not unit or not wanted:
        raise InputError(f"given {given}: a unit is missing; write it at every number, such as 1mm:2mm:5")
    kind, other = _kind(unit, given), _kind(wanted, given)
    if kind != other:
        raise InputError(
            f"given {given}: {unit} is {KINDS[kind].name} and {wanted} is {KINDS[other].name}; "
            "all values of a key are of one kind"
        )
    return quantity(f"1 {unit}", kind) / quantity(f"1 {wanted}", kind)


def _split(text: str, mark: str) -> list[str]:
    """Parts between marks that stand in no quotes and no brackets."""
    parts, depth, quote = [""], 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        elif letter in "[{(":
            depth += 1
        elif letter in ")}]":
            depth -= 1
        elif letter == mark and depth <= 0:
            parts.append("")
            continue
        parts[-1] += letter
    return [part.strip() for part in parts]
