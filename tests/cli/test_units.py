"""Units at the boundary: the quick path agrees with pint, and what is wrong is said in one line."""

from __future__ import annotations

import math

import pint
import pytest

from fem_spa.errors import InputError
from fem_spa.units import _COMMON, kind_of, quantity, show

PINT = pint.UnitRegistry()


@pytest.mark.parametrize(
    "unit,written", [(u, w) for u, table in _COMMON.items() for w in table if w not in ("", "1")]
)
def test_quick_units_are_those_of_pint(unit: str, written: str) -> None:
    expected = PINT.Quantity(7.25, written).to(unit).magnitude
    assert quantity(f"7.25 {written}", unit) == pytest.approx(expected, rel=1e-14)


def test_everyday_values_are_exact() -> None:
    assert quantity("18 mm", "m") == 0.018
    assert quantity("0.11 MPa", "Pa") == 110000.0
    assert quantity("5e3Pa", "Pa") == 5000.0
    assert quantity("2 psi", "Pa") == pytest.approx(13789.514586, rel=1e-9)
    assert quantity("1.08 g/cm**3", "kg/m^3") == 1080.0
    assert quantity(0.45, "1") == 0.45
    assert math.isinf(quantity("inf", "Pa", infinite=True))
    assert quantity(0, "m", zero=True) == 0.0


@pytest.mark.parametrize(
    "given,options,words",
    [
        ("18 kPa", {}, ["'18 kPa'", "geometry.wall", "a length is needed", "'18 mm'"]),
        (18, {}, ["unit is missing", "'18 mm'"]),
        ("18", {}, ["unit is missing"]),
        ("18 foo", {}, ["'foo' is not known"]),
        ("18 mm mm", {}, ["a length is needed"]),
        ("nan mm", {}, ["not a number"]),
        (float("nan"), {}, ["not a number"]),
        ("inf", {}, ["finite"]),
        ("-3 mm", {"positive": True}, ["greater than zero"]),
        ("10 m", {"high": 2.0}, ["most allowed is 2 m"]),
        ("1 um", {"low": 1e-5}, ["least allowed is 10 um"]),
        (True, {}, ["a length is needed"]),
        ([1], {}, ["a length is needed"]),
        ("", {}, ["a length is needed"]),
        ("__import__('os')", {}, ["a length is needed"]),
        ("3 mm; 4 mm", {}, ["is not known"]),
    ],
)
def test_refused_in_one_line(given: object, options: dict, words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        quantity(given, "m", "geometry.wall", **options)
    assert "\n" not in str(caught.value)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    "value,unit", [(0.018, "m"), (3.2e-5, "m"), (1.1e5, "Pa"), (2e9, "Pa"), (3e-5, "m^3"), (0.0, "m")]
)
def test_shown_values_read_back(value: float, unit: str) -> None:
    assert quantity(show(value, unit), unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    "unit,si",
    [("mm", "m"), ("kPa", "Pa"), ("psi", "Pa"), ("deg", "rad"), ("g/cm^3", "kg/m^3")],
)
def test_a_unit_says_what_it_measures(unit: str, si: str) -> None:
    assert kind_of(unit) == si


@pytest.mark.parametrize("unit", ["mn", "kelvin", "mm mm mm mm"])
def test_a_unit_of_nothing_here(unit: str) -> None:
    assert kind_of(unit) is None
