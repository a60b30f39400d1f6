"""Elements that leave the tests or the stability of their card are named."""

from __future__ import annotations

import numpy as np
import pytest

from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, Material, Problem
from materials.card import load_card
from materials.response import nominal_stress


def pulled(verification, card, stretch):
    """The result of a cube of a card's rubber, pulled to a stretch."""
    side = 0.01
    mesh = verification.box([np.linspace(0, side, 2)] * 3, names={"x1": "tip"})
    stress = float(nominal_stress(card.law, card.parameters, "uniaxial", stretch)[0])
    problem = Problem(
        mesh,
        {"body": Material(card.law, card.parameters, card=card)},
        Loads([], tip_force=(stress * (2 * side) ** 2, 0.0, 0.0)),
        fixed=(),
        symmetry={"x0": "x", "y0": "y", "z0": "z"},
    )
    result = solve(problem)
    assert result.rows[-1].max_stretch == pytest.approx(stretch, rel=1e-6)
    return result


@pytest.mark.parametrize(("stretch", "named"), [(2.5, False), (3.3, True)])
def test_stretch_beyond_the_tests_of_a_card(verification, stretch, named):
    # catches a range that is not looked at, or looked at in the wrong region or measure
    card = load_card("dragon-skin-30-fitted")
    result = pulled(verification, card, stretch)
    assert card.stretch_range is not None and card.stretch_range[1] == pytest.approx(3.0)
    told = [text for text in result.warnings if "beyond the tests of card 'dragon-skin-30-fitted'" in text]
    assert len(told) == named
    if named:
        assert "element" in told[0] and "mm" in told[0]


@pytest.mark.parametrize(("stretch", "named"), [(1.15, False), (1.3, True)])
def test_stretch_beyond_what_a_stated_modulus_is_meant_for(verification, stretch, named):
    # catches a card without tests that bears any stretch in silence, or is said to have tests
    warnings = pulled(verification, load_card("tpu-95a"), stretch).warnings
    told = [text for text in warnings if "beyond what card 'tpu-95a' is meant for" in text]
    assert len(told) == len(warnings) == named
    if named:
        assert "0.80 to 1.20" in told[0] and "stated" in told[0] and "tests" not in told[0]
