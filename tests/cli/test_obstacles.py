"""Obstacles of a deck become rigid bodies; those that would not be what they seem are refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fem_spa.deck import parse_deck, read_deck
from fem_spa.errors import InputError
from fem_spa.output.toml import to_toml
from fem_spa.prepare import prepare
from fem_spa.solid.obstacles import Cylinder, Plane, Sphere

Deck = Callable[..., str]

PLANE = "{ plane = { point = ['-1 mm', 0, 0], normal = [2, 0, 0] } }"
EGG = "{ sphere = { centre = ['12 cm', '5 mm', 0], radius = ['20 mm', '2 cm', '30 mm'] } }"
BAR = "{ cylinder = { point = [0, 0, '-20 mm'], axis = [0, 1, 0], radius = '15 mm' } }"


def problem(deck: Deck, *overrides: str) -> Any:
    return prepare(read_deck(deck(), overrides))


def test_each_kind_in_order_and_in_si(deck: Deck) -> None:
    found = problem(deck, f"loads.obstacles=[{PLANE}, {EGG}, {BAR}]").problem.obstacles
    assert found == (
        Plane((-1e-3, 0.0, 0.0), (2.0, 0.0, 0.0)),
        Sphere((0.12, 5e-3, 0.0), (0.02, 0.02, 0.03)),
        Cylinder((0.0, 0.0, -0.02), (0.0, 1.0, 0.0), 0.015),
    )


def test_contact_is_on_unless_the_deck_says_so(deck: Deck) -> None:
    assert problem(deck).problem.contact is True
    assert problem(deck, "loads.contact=false").problem.contact is False


def test_the_resolved_deck_gives_the_same_obstacles(deck: Deck) -> None:
    setup = problem(deck, f"loads.obstacles=[{EGG}, {BAR}]")
    Path("again.toml").write_text(to_toml(setup.resolved))
    assert prepare(read_deck("again.toml")).problem.obstacles == setup.problem.obstacles


HALF: dict[str, Any] = {
    "geometry": {"shape": "pneunet", "slow_chambers": 0, "fast_chambers": 1},
    "materials": {"body": {"card": "dragon-skin-30"}},
    "loads": {"pressure": "1 kPa"},
}


@pytest.mark.parametrize(
    ("obstacle", "allowed"),
    [
        ({"plane": {"point": [0, 0, "-5 mm"], "normal": [1, 0, 9]}}, True),
        ({"plane": {"point": [0, 0, "-5 mm"], "normal": [0, 0.1, 9]}}, False),
        ({"sphere": {"centre": [0, 0, "-50 mm"], "radius": "20 mm"}}, True),
        ({"sphere": {"centre": [0, "1 mm", "-50 mm"], "radius": "20 mm"}}, False),
        ({"cylinder": {"point": [0, "9 mm", "-50 mm"], "axis": [0, -2, 0], "radius": "20 mm"}}, True),
        ({"cylinder": {"point": [0, 0, "-50 mm"], "axis": [1, 0, 0], "radius": "20 mm"}}, True),
        ({"cylinder": {"point": [0, "9 mm", "-50 mm"], "axis": [1, 0, 0], "radius": "20 mm"}}, False),
        ({"cylinder": {"point": [0, 0, "-50 mm"], "axis": [1, 1, 0], "radius": "20 mm"}}, False),
    ],
)
def test_a_cut_body_needs_obstacles_that_are_their_own_image(obstacle: Any, allowed: bool) -> None:
    """Else the force on them would not be that of the whole actuator."""
    tables = {**HALF, "loads": {**HALF["loads"], "obstacles": [obstacle]}}
    if allowed:
        assert len(prepare(parse_deck(tables)).problem.obstacles) == 1
    else:
        with pytest.raises(InputError, match="mirror image"):
            prepare(parse_deck(tables))
