"""A user's law from a file: two formulas, checked; wrong ones are named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from materials.card import load_card
from materials.errors import MaterialError
from materials.registry import law
from materials.user_law import load_law

GOOD = """
import numpy as np
name = "exponential"
parameters = {"a": "Pa", "b": "1"}
example = {"a": 1e5, "b": 0.3}

def energy(I1, I2, *, a, b):
    return a / (2 * b) * (np.exp(b * (I1 - 3)) - 1)

def derivatives(I1, I2, *, a, b):
    W1 = a / 2 * np.exp(b * (I1 - 3))
    return W1, 0 * I1
"""


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "mine.py"
    path.write_text(text)
    return path


def test_a_good_law_is_taken_with_second_derivatives_by_complex_step(tmp_path: Path) -> None:
    mine = load_law(write(tmp_path, GOOD))
    I = np.array([3.5, 4.0])
    W1, W2, W11, W12, W22 = mine.derivatives(I, I, a=1e5, b=0.3)
    assert np.allclose(W11, 0.3 * W1, rtol=1e-12)
    assert not W2.any() and not W12.any() and not W22.any()
    assert mine.shear_modulus(a=1e5, b=0.3) == pytest.approx(1e5)


def test_it_is_found_by_path_in_a_card(tmp_path: Path) -> None:
    write(tmp_path, GOOD)
    card = tmp_path / "card.toml"
    card.write_text(
        'law = "mine.py"\nsource = "mine"\n[parameters]\na = "0.2 MPa"\nb = { value = 0.3, unit = "1" }\n'
    )
    loaded = load_card(card)
    assert loaded.law.name == "exponential"
    assert loaded.small_strain.mu == pytest.approx(2e5)
    assert law(str(tmp_path / "mine.py")).name == "exponential"


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("W1 = a / 2", "W1 = a", "W1 is"),
        ("return W1, 0 * I1", "return W1, 0 * I1, 0.5 * b * W1, 0 * I1, 0 * I1", "W11 is"),
        ("return W1, 0 * I1", "return W1, 0 * I1 + a", "W2 is"),
        ("- 1)", "- 2)", "the energy at rest"),
        ('"a": 1e5', '"a": -1e5', "must be positive"),
        ('example = {"a": 1e5, "b": 0.3}', "", "example is missing"),
        ('"b": 0.3}', '"c": 0.3}', "example must give a, b"),
        ('"Pa"', '"MPa"', "need the unit"),
        ('"exponential"', '"yeoh"', "none of"),
        ("import numpy as np", "import numpyy as np", "cannot be run"),
        ("np.exp(b * (I1 - 3)) - 1", "np.expo(b * (I1 - 3)) - 1", "fail on arrays"),
    ],
)
def test_wrong_laws_are_named_in_one_line(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in GOOD
    with pytest.raises(MaterialError) as caught:
        load_law(write(tmp_path, GOOD.replace(old, new)))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there() -> None:
    with pytest.raises(MaterialError, match="is not there"):
        law("nowhere.py")
