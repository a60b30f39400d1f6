"""Watches whether elements stay within what a card's tests have shown, or stated numbers are meant for."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fem_spa.solid.problem import Problem
from fem_spa.solid.system import System
from materials.trust import beyond, principal_range, unstable


class CardWatch:
    """Warns once a region, at the first state whose elements leave the card's stretches or its stability."""

    def __init__(self, problem: Problem) -> None:
        cards = {name: m.card for name, m in problem.materials.items() if m.card is not None}
        self.ranged = {name: card for name, card in cards.items() if principal_range(card) is not None}
        self.stable = dict(cards)

    def look(self, system: System, pressure: Mapping[str, float]) -> list[str]:
        """Warnings of the state last evaluated. pressure : cavity -> Pa"""
        out = []
        at = ", ".join(f"{name} {1e-3 * p:.4g} kPa" for name, p in pressure.items()) or "the dead loads"
        for name, card in list(self.ranged.items()):
            I1, I2, first = system.region_invariants(name)
            outside = beyond(card, I1, I2)
            if np.any(outside):
                del self.ranged[name]
                low, high = principal_range(card) or (1.0, 1.0)
                worst = int(np.argmax(np.where(outside, I1, 0.0))) // I1.shape[1]
                place, stretches = system.place(first + worst), f"(stretches {low:.2f} to {high:.2f})"
                what = f"the tests of card '{card.name}' {stretches}: there the law is a guess."
                if card.trusted_stretch is not None:
                    what = (
                        f"what card '{card.name}' is meant for {stretches}: its numbers are stated, "
                        "not fitted, and a guess there."
                    )
                out.append(f"From {at} on, {place} is stretched beyond {what}")
        for name, card in list(self.stable.items()):
            I1, I2, first = system.region_invariants(name)
            weak = unstable(card, I1, I2)
            if np.any(weak):
                del self.stable[name]
                worst = int(np.argmax(np.where(weak, I1, 0.0))) // I1.shape[1]
                out.append(
                    f"From {at} on, the law of card '{card.name}' is unstable (Drucker) in "
                    f"{system.place(first + worst)}: trust neither stress nor angle beyond."
                )
        return out
