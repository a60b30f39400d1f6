"""How far a card may be trusted: what a solver asks of its elements, to warn where they leave it."""

from __future__ import annotations

import numpy as np

from materials.card import Card
from materials.laws import Array
from materials.laws.spectral import outer_roots
from materials.response import MODES, principal_stretches
from materials.stability import margin_at

HAIR = 1e-3
"""Slack of the range: an element right at its end is not yet beyond it."""


def principal_range(card: Card) -> tuple[float, float] | None:
    """Least and greatest principal stretch in the tests behind the card, sideways ones included: a
    uniaxial test to 3 also squeezes to 3^-1/2. Of a card without tests those it is meant for, as it states
    them. None where the card states no range."""
    if card.trusted_stretch is not None:
        return card.trusted_stretch
    if card.stretch_range is None:
        return None
    ends = np.array(card.stretch_range)
    modes = [m for m in card.fit.get("modes", ["uniaxial"]) if m in MODES] or ["uniaxial"]
    stretches = np.concatenate([principal_stretches(mode, ends).ravel() for mode in modes])
    return float(min(1.0, stretches.min())), float(max(1.0, stretches.max()))


def beyond(card: Card, I1: Array, I2: Array) -> Array:
    """Where the largest or smallest principal stretch leaves the card's `principal_range`.

    Parameters
    ----------
    I1, I2 : isochoric invariants of any one shape

    Returns
    -------
    bool, same shape; False everywhere for a card without a range
    """
    limits = principal_range(card)
    if limits is None:
        return np.zeros(np.shape(I1), bool)
    high, low = outer_roots(I1, I2)
    return (np.sqrt(high) > limits[1] * (1.0 + HAIR)) | (np.sqrt(low) < limits[0] * (1.0 - HAIR))


def unstable(card: Card, I1: Array, I2: Array) -> Array:
    """Where the law violates Drucker's postulate, or has ended (nan); bool, shape of I1."""
    with np.errstate(all="ignore"):
        return ~(margin_at(card.law, card.parameters, np.asarray(I1, float), np.asarray(I2, float)) > 0.0)
