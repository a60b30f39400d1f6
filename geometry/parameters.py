"""Parameters of shapes: dataclass fields that know their unit, their range and their meaning.

A shape declares its sizes with `length`, `angle`, `count`, `flag` and `pattern`; the command line
lists them with `parameters(cls)`, the deck reader converts text by `Parameter.unit`, and
`check_ranges(shape)` refuses what is outside, before gmsh is asked.
"""

from __future__ import annotations

import dataclasses
import math
import numbers
from dataclasses import dataclass
from typing import Any

from geometry.errors import millimetres, refusal


@dataclass(frozen=True)
class Parameter:
    """One parameter of a shape.

    Attributes
    ----------
    name : field name
    kind : "length", "angle", "count", "flag" or "pattern"
    unit : "m", "rad" or "1" (counts, flags and patterns)
    default : value in that unit
    doc : meaning, in one line
    low, high : allowed range, inclusive, in that unit (None for flags and patterns)
    symbol : the paper's symbol, "" where the paper has none
    letters : characters a pattern may consist of
    """

    name: str
    kind: str
    unit: str
    default: Any
    doc: str
    low: float | None = None
    high: float | None = None
    symbol: str = ""
    letters: str = ""

    @property
    def default_text(self) -> str:
        """The default as a person would write it: "18 mm", "45 deg", "9", "true"."""
        return self.text(self.default)

    def text(self, value: Any) -> str:
        """A value of this parameter as a person would write it."""
        if self.kind == "length":
            return millimetres(value)
        if self.kind == "angle":
            return f"{math.degrees(value):.6g} deg"
        if self.kind == "flag":
            return str(bool(value)).lower()
        return repr(value) if self.kind == "pattern" else str(value)

    @property
    def range_text(self) -> str:
        """The allowed range as a person would write it."""
        if self.kind == "flag":
            return "true or false"
        if self.kind == "pattern":
            return f"text of the characters {', '.join(repr(c) for c in self.letters)}"
        return f"{self.text(self.low)} to {self.text(self.high)}"


def _declare(kind: str, unit: str, default: Any, doc: str, **more: Any) -> Any:
    return dataclasses.field(default=default, metadata={"kind": kind, "unit": unit, "doc": doc, **more})


def length(default: float, doc: str, low: float = 1e-5, high: float = 0.5, symbol: str = "") -> Any:
    """A field that is a length in m, from `low` to `high` (default 10 micrometres to 0.5 m)."""
    return _declare("length", "m", default, doc, low=low, high=high, symbol=symbol)


def angle(default: float, doc: str, low: float, high: float, symbol: str = "") -> Any:
    """A field that is an angle in rad, from `low` to `high`."""
    return _declare("angle", "rad", default, doc, low=low, high=high, symbol=symbol)


def count(default: int, doc: str, low: int = 0, high: int = 60, symbol: str = "") -> Any:
    """A field that is a whole number, from `low` to `high`."""
    return _declare("count", "1", default, doc, low=low, high=high, symbol=symbol)


def flag(default: bool, doc: str) -> Any:
    """A field that is true or false."""
    return _declare("flag", "1", default, doc)


def pattern(default: str, doc: str, letters: str) -> Any:
    """A field that is text made of the given characters."""
    return _declare("pattern", "1", default, doc, letters=letters)


def parameters(shape: Any) -> tuple[Parameter, ...]:
    """The parameters of a shape (class or instance), in the order of declaration."""
    return tuple(
        Parameter(name=item.name, default=item.default, **item.metadata)
        for item in dataclasses.fields(shape)
        if "kind" in item.metadata
    )


def check_ranges(shape: Any) -> None:
    """Refuse every parameter of a shape that is of the wrong kind, not finite or out of its range.

    Raises
    ------
    GeometryError
        naming the first such parameter
    """
    for item in parameters(shape):
        value = getattr(shape, item.name)
        where = f"{shape.name}: {item.name} = "
        if item.kind == "flag":
            if not (isinstance(value, bool) or type(value).__name__ == "bool"):
                raise refusal(f"{where}{value!r}", "true or false")
            continue
        if item.kind == "pattern":
            if not isinstance(value, str) or any(letter not in item.letters for letter in value):
                raise refusal(f"{where}{value!r}", item.range_text)
            continue
        if isinstance(value, bool) or not isinstance(value, numbers.Real):
            raise refusal(f"{where}{value!r}", f"a number, {item.range_text}")
        if not math.isfinite(value):
            raise refusal(f"{where}{value}", f"a finite number, {item.range_text}")
        if item.kind == "count" and not isinstance(value, numbers.Integral):
            raise refusal(f"{where}{value!r}", f"a whole number, {item.range_text}")
        assert item.low is not None and item.high is not None
        value = float(value)
        if not item.low <= value <= item.high:
            cause, remedy = _out_of_range(item, value)
            raise refusal(f"{where}{item.text(getattr(shape, item.name))}", item.range_text, cause, remedy)


def _out_of_range(item: Parameter, value: float) -> tuple[str, str]:
    if item.kind != "length":
        return "", f"the default is {item.default_text}"
    assert item.low is not None and item.high is not None
    if value > item.high and item.low <= value * 1e-3 <= item.high:
        return "millimetres given where metres are meant", "give the unit with the number, such as '3 mm'"
    if 0 < value < item.low:
        return "metres said to be millimetres, or thinner than can be cast or printed", (
            "give the unit with the number, such as '3 mm'"
        )
    if value <= 0:
        return "", f"a positive length; the default is {item.default_text}"
    return "", f"the default is {item.default_text}"
