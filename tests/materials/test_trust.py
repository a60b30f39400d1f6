"""Elements beyond the range or the stability of their card are found, others are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from materials.card import load_card
from materials.laws import LAWS
from materials.response import invariants, principal_stretches
from materials.trust import beyond, principal_range, unstable

CARD = replace(load_card("dragon-skin-30"), fit={"modes": ["uniaxial"], "stretch_range": [1.0, 3.0]})


def at(mode: str, *stretch: float) -> tuple[np.ndarray, np.ndarray]:
    return invariants(principal_stretches(mode, np.array(stretch)))


def test_range_counts_the_sideways_stretch() -> None:
    assert principal_range(CARD) == pytest.approx((3**-0.5, 3.0))
    assert beyond(CARD, *at("uniaxial", 1.0, 2.9, 3.0, 3.1)).tolist() == [False, False, False, True]
    # Equibiaxial to 1.4 squeezes to 0.51, further than any direction of the test.
    assert beyond(CARD, *at("equibiaxial", 1.2, 1.4)).tolist() == [False, True]


def test_a_card_without_range_says_nothing() -> None:
    assert not beyond(load_card("ar-g1l"), *at("uniaxial", 1.0, 9.0)).any()


def test_a_stated_modulus_is_trusted_as_far_as_its_card_says() -> None:
    # The range is of the principal stretches themselves: no test whose sideways stretches would count.
    card = load_card("tpu-95a")
    assert principal_range(card) == (0.8, 1.2)
    assert beyond(card, *at("uniaxial", 1.19, 1.21, 0.81, 0.79)).tolist() == [False, True, False, True]
    # Equibiaxial to 1.15 squeezes to 0.76.
    assert beyond(card, *at("equibiaxial", 1.1, 1.15)).tolist() == [False, True]


def test_unstable_elements() -> None:
    bad = replace(CARD, law=LAWS["mooney-rivlin"], parameters={"C10": 1.5e5, "C01": -4e4})
    I1, I2 = at("equibiaxial", 1.0, 1.4, 1.6)
    assert unstable(bad, I1, I2).tolist() == [False, False, True]
    assert unstable(bad, I1.reshape(3, 1), I2.reshape(3, 1)).shape == (3, 1)
    ended = replace(CARD, law=LAWS["gent"], parameters={"mu": 1e5, "Jm": 2.0})
    assert unstable(ended, *at("uniaxial", 1.2, 3.0)).tolist() == [False, True]
    assert not unstable(CARD, *at("planar", 1.0, 2.0)).any()
