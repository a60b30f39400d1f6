"""Quantities of material files as SI numbers: "0.11 MPa" -> 110000.0. No library: cards load at once."""

from __future__ import annotations

import math
import re

from materials.errors import MaterialError
from materials.names import allowed

UNITS: dict[str, tuple[str, float]] = {
    "Pa": ("pressure", 1.0),
    "kPa": ("pressure", 1e3),
    "MPa": ("pressure", 1e6),
    "GPa": ("pressure", 1e9),
    "N/m^2": ("pressure", 1.0),
    "N/mm^2": ("pressure", 1e6),
    "N/cm^2": ("pressure", 1e4),
    "bar": ("pressure", 1e5),
    "psi": ("pressure", 6894.757293168),
    "kgf/cm^2": ("pressure", 98066.5),
    "kg/m^3": ("density", 1.0),
    "g/cm^3": ("density", 1e3),
    "g/cc": ("density", 1e3),
    "g/mL": ("density", 1e3),
    "kg/L": ("density", 1e3),
    "N": ("force", 1.0),
    "mN": ("force", 1e-3),
    "kN": ("force", 1e3),
    "gf": ("force", 9.80665e-3),
    "kgf": ("force", 9.80665),
    "lbf": ("force", 4.4482216152605),
    "m": ("length", 1.0),
    "cm": ("length", 1e-2),
    "mm": ("length", 1e-3),
    "um": ("length", 1e-6),
    "in": ("length", 0.0254),
    "m^2": ("area", 1.0),
    "cm^2": ("area", 1e-4),
    "mm^2": ("area", 1e-6),
    "s": ("time", 1.0),
    "ms": ("time", 1e-3),
    "min": ("time", 60.0),
    "h": ("time", 3600.0),
    "1": ("number", 1.0),
    "%": ("number", 1e-2),
}

_QUANTITY = re.compile(
    r"^\s*([+-]?(?:inf|nan|\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?))\s*(\S.*?)?\s*$"
)


def factor(unit: str, kind: str) -> float:
    """SI value of one `unit`, which must be a unit of `kind` (pressure, density, force, length, ...)."""
    text = unit.strip().replace("²", "^2").replace("³", "^3").replace("**", "^").replace(" ", "") or "1"
    text = re.sub(r"(?<=m)([23])$", r"^\1", text)
    if text not in UNITS:
        raise MaterialError(
            f'unit "{unit}" is not known; {allowed(unit, [u for u in UNITS if UNITS[u][0] == kind])}'
        )
    given, value = UNITS[text]
    if given != kind:
        fitting = ", ".join(u for u in UNITS if UNITS[u][0] == kind)
        raise MaterialError(f'unit "{unit}" is a {given}, but a {kind} is needed; allowed: {fitting}')
    return value


def quantity(text: object, kind: str, what: str) -> float:
    """Number in SI of "0.11 MPa" (or of a bare `inf`, or of a number where `kind` is "number").

    Raises MaterialError naming `what`, the text and what is allowed.
    """
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        raise MaterialError(f'{what} is {text!r}; give a quantity with its unit, such as "{_EXAMPLE[kind]}"')
    match = _QUANTITY.match(str(text))
    if match is None:
        raise MaterialError(
            f'{what} is "{text}", which is not a number with a unit; write for example "{_EXAMPLE[kind]}"'
        )
    value, unit = float(match.group(1)), match.group(2)
    if math.isinf(value) and unit is None:
        return value
    if unit is None and kind != "number":
        raise MaterialError(f'{what} is "{text}" without a unit; write for example "{_EXAMPLE[kind]}"')
    try:
        return value * factor(unit or "1", kind)
    except MaterialError as error:
        raise MaterialError(f"{what}: {error}") from None


_EXAMPLE = {
    "pressure": "0.11 MPa",
    "density": "1080 kg/m^3",
    "force": "2.5 N",
    "length": "25 mm",
    "area": "24 mm^2",
    "time": "10 s",
    "number": "0.5",
}
