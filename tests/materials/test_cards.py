"""Cards: those that come with the program, round trip, and refusals in one line."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from material_samples import NEEDS_DATA, data_folder

from materials.card import card_names, load_card
from materials.card_writer import card_toml
from materials.errors import MaterialError
from materials.job import Options, fit_tests
from materials.units import quantity

GOOD = """
name = "x"
law = "yeoh"
source = "somewhere"
density = "1.08 g/cm^3"
[parameters]
C10 = { value = 0.11, unit = "MPa", low = 0.10, high = 0.12 }
C20 = "20 kPa"
[fit]
stretch_range = [1.0, 2.5]
[stability]
stable = false
uniaxial = [0.5, 3.0]
"""


@pytest.mark.parametrize("name", card_names())
def test_every_card_loads_and_names_its_source(name: str) -> None:
    card = load_card(name)
    assert card.name == name
    assert len(card.source) > 20
    assert 1e3 < card.small_strain.mu < 1e9


def test_cards_of_the_papers() -> None:
    assert dict(load_card("dragon-skin-30").parameters) == pytest.approx(
        {"C10": 0.11e6, "C20": 0.02e6, "C30": 0.0}
    )
    assert dict(load_card("ar-g1l").parameters) == pytest.approx({"C10": 0.11e6, "C01": 0.01e6})
    linear = load_card("ar-g1l-linear")
    assert linear.small_strain.E == pytest.approx(3.1e6)
    assert math.isinf(linear.small_strain.K)


def test_card_by_path_and_back(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_text(GOOD)
    card = load_card(path)
    assert card.density == pytest.approx(1080.0)
    assert card.intervals == {"C10": pytest.approx((1.0e5, 1.2e5))}
    assert card.stretch_range == (1.0, 2.5)
    assert card.stable is False
    assert card.stable_ranges == {"uniaxial": (0.5, 3.0)}
    path.write_text(card_toml(card, tmp_path), encoding="utf-8")
    again = load_card(path)
    assert card_toml(again) == card_toml(card)
    assert dict(again.parameters) == pytest.approx(dict(card.parameters), rel=1e-11)


def test_a_stated_range_comes_back(tmp_path: Path) -> None:
    card = load_card("tpu-95a")
    assert card.trusted_stretch == (0.8, 1.2) and card.stretch_range is None
    path = tmp_path / "x.toml"
    path.write_text(card_toml(card, tmp_path), encoding="utf-8")
    assert load_card(path).trusted_stretch == (0.8, 1.2)
    assert load_card("ar-g1l").trusted_stretch is None


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('law = "yeoh"', 'law = "yeo"', 'did you mean "yeoh"'),
        ('law = "yeoh"', "", "`law` is missing"),
        ("C10 =", "C11 =", 'no parameter "C11"'),
        ('unit = "MPa"', 'unit = "mm"', "is a length"),
        ('unit = "MPa"', 'unit = "Mpa"', 'did you mean "MPa"'),
        ('unit = "MPa"', 'unit = "Pa"', "softer than any gel"),
        ("value = 0.11", 'value = "a"', "a number is needed"),
        ("20 kPa", "20", "without a unit"),
        ("1.08 g/cm^3", "1.08 kg/m^3", "density"),
        ("[fit]", "[fitt]", 'did you mean "fit"'),
        ("[1.0, 2.5]", "[2.5, 1.0]", "low <= high"),
        ("[parameters]", "[parameters", "not valid TOML"),
        ("[parameters]", "trusted_stretch = [1.1, 1.2]\n[parameters]", "low <= 1 <= high"),
        ("[parameters]", "trusted_stretch = 0.2\n[parameters]", "trusted_stretch is 0.2"),
        ("[parameters]", "trusted_stretch = [0.8, 1.2]\n[parameters]", "leave one of them out"),
    ],
)
def test_wrong_cards_are_refused_in_one_line(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in GOOD
    path = tmp_path / "x.toml"
    path.write_text(GOOD.replace(old, new))
    with pytest.raises(MaterialError) as caught:
        load_card(path)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_unknown_card_names_the_nearest() -> None:
    with pytest.raises(MaterialError, match='did you mean "dragon-skin-30"'):
        load_card("dragonskin30")
    with pytest.raises(MaterialError, match="is not there"):
        load_card("nowhere/card.toml")


@pytest.mark.parametrize(
    "text, kind, value",
    [
        ("0.11 MPa", "pressure", 0.11e6),
        ("20kPa", "pressure", 2e4),
        ("2.4 N/mm²", "pressure", 2.4e6),
        ("1.08 g/cm^3", "density", 1080.0),
        ("24 mm2", "area", 24e-6),
        ("inf", "pressure", math.inf),
        ("-1e-3 MPa", "pressure", -1000.0),
        (0.5, "number", 0.5),
        ("40 %", "number", 0.4),
    ],
)
def test_quantities(text: object, kind: str, value: float) -> None:
    assert quantity(text, kind, "it") == pytest.approx(value)


FITTED = (
    "dragon-skin-10",
    "dragon-skin-20",
    "dragon-skin-30-fitted",
    "ecoflex-00-10",
    "ecoflex-00-30",
    "ecoflex-00-50",
    "rtv615",
    "ninjaflex",
    "cheetah",
)


@pytest.mark.parametrize("name", FITTED)
def test_fitted_cards_state_what_they_rest_on(name: str) -> None:
    card = load_card(name)
    assert card.stable is True
    assert set(card.stable_ranges) == {"uniaxial", "equibiaxial", "planar"}
    assert card.stretch_range is not None and card.stretch_range[1] > 2.5
    assert "sha256" in card.source
    assert card.density is not None
    assert set(card.intervals) and all(
        low < card.parameters[k] < high for k, (low, high) in card.intervals.items()
    )


@NEEDS_DATA
def test_a_fitted_card_is_what_the_fit_gives_today() -> None:
    folder = data_folder()
    assert folder is not None
    options = Options(laws=("yeoh", "gent", "arruda-boyce", "neo-hooke"), stretch=(1.0, 3.0))
    for name, file in (("dragon-skin-30-fitted", "Dragon_Skin_30"), ("ecoflex-00-30", "Ecoflex_00-30")):
        card = load_card(name)
        outcome = fit_tests([folder / "silicone_tensile_marechal" / f"{file}.csv"], options)
        assert outcome.card.law.name == card.law.name
        assert dict(outcome.card.parameters) == pytest.approx(dict(card.parameters), rel=1e-6)
        assert outcome.card.source in card.source
