"""`--vary` texts become the values that a deck gets, in one unit; what is wrong is one line."""

from __future__ import annotations

import pytest

from fem_spa.errors import InputError
from fem_spa.sweep.axes import Axis, read_axis
from fem_spa.units import quantity


def given(axis: Axis) -> list[object]:
    return [value.given for value in axis.values]


def test_a_range_has_both_ends_and_even_steps_in_the_first_unit() -> None:
    axis = read_axis("geometry.wall=1mm:0.3cm:5")
    assert axis.title == "geometry.wall [mm]"
    assert given(axis) == ["1 mm", "1.5 mm", "2 mm", "2.5 mm", "3 mm"]
    assert [quantity(text, "m") for text in given(axis)] == pytest.approx([1e-3, 1.5e-3, 2e-3, 2.5e-3, 3e-3])
    assert given(read_axis("loads.pressure=20 kPa:-0.1bar:4")) == ["20 kPa", "10 kPa", "0 kPa", "-10 kPa"]
    assert given(read_axis("solver.tolerance=1e-8:3e-8:3")) == [1e-8, 2e-8, 3e-8]


def test_whole_numbers_stay_whole() -> None:
    """A count is refused by the deck where it is a float."""
    assert given(read_axis("loads.points=4:8:3")) == [4, 6, 8]
    assert all(isinstance(value, int) for value in given(read_axis("geometry.slow_chambers=3,5")))


def test_lists_are_numbers_of_one_unit_or_words_as_toml_has_them() -> None:
    pressures = read_axis("loads.pressure.slow=10kPa, 0.2 bar,'30 kPa'")
    assert given(pressures) == ["10 kPa", "20 kPa", "30 kPa"] and pressures.unit == "kPa"
    assert given(read_axis("loads.contact=true,false")) == [True, False]
    assert given(read_axis("loads.gravity=[0,0,-9.81],[9.81,0,0]")) == [[0, 0, -9.81], [9.81, 0, 0]]
    cards = read_axis("materials.body.card=dragon-skin-30,'own, of 2024.toml'")
    assert given(cards) == ["dragon-skin-30", "own, of 2024.toml"] and not cards.numeric
    assert given(read_axis("materials.body.bulk=1MPa,inf"))[0] == "1MPa"


def test_points_of_a_range_are_within_it_and_counts_are_whole() -> None:
    axis = read_axis("geometry.wall=1mm:2mm", sampled=True)
    assert [axis.at(u).given for u in (0.0, 0.25, 0.999)] == ["1 mm", "1.25 mm", "1.999 mm"]
    count = read_axis("geometry.slow_chambers=3:5", sampled=True)
    assert [count.at(u, whole=True).given for u in (0.0, 0.3, 0.34, 0.66, 0.67, 0.999)] == [3, 3, 4, 4, 5, 5]
    words = read_axis("materials.body.card=a,b", sampled=True)
    assert [words.at(u).given for u in (0.0, 0.49, 0.5, 0.99)] == ["a", "a", "b", "b"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("geometry.wall", "write lo:hi:n"),
        ("=1mm:2mm:3", "write lo:hi:n"),
        ("geometry.wall=", "write lo:hi:n"),
        ("geometry.wall=1mm:2mm", "how many values"),
        ("geometry.wall=1mm:2mm:three", "not a number of values"),
        ("geometry.wall=1mm:2mm:1", "2 to 10000"),
        ("geometry.wall=1mm:2mm:99999999999999999", "2 to 10000"),
        ("geometry.wall=1mm:2mm:3:4", "three parts"),
        ("geometry.wall=1mm:2kPa:3", "kPa is a pressure"),
        ("geometry.wall=1mm:2:3", "a unit is missing"),
        ("geometry.wall=1mm:2mn:3", "'mn' is not known"),
        ("geometry.wall=1mm:1mm:3", "two that differ"),
        ("geometry.wall=1e999mm:2mm:3", "not finite"),
        ("geometry.wall=1mm,,2mm", "a value is empty"),
        ("two words=1:2:3", "not a dotted key"),
    ],
)
def test_what_is_wrong_is_named_in_one_line(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read_axis(text)
    assert "\n" not in str(caught.value) and "--vary" in str(caught.value)
