"""Model confidence set: coverage and power on losses whose order is known."""

from __future__ import annotations

import numpy as np

from fem_spa.loop.mcs import confidence_set


def test_the_best_stays_and_the_worst_goes() -> None:
    rng = np.random.default_rng(3)
    kept_best, kept_twin, kept_worse, rounds = 0, 0, 0, 80
    for k in range(rounds):
        block = rng.exponential(1.0, 40)  # what all models share
        losses = block + np.array([0.0, 0.0, 1.0])[:, None] + rng.normal(0.0, 0.6, (3, 40))
        kept, p = confidence_set(losses, 0.1, k)
        assert set(kept) == set(np.nonzero(p >= 0.1)[0]) and p.max() == 1.0
        kept_best += 0 in kept
        kept_twin += 1 in kept
        kept_worse += 2 in kept
    assert kept_best >= 0.85 * rounds and kept_twin >= 0.85 * rounds
    assert kept_worse == 0


def test_one_model_or_one_block_keeps_all() -> None:
    assert list(confidence_set(np.ones((1, 9)))[0]) == [0]
    assert list(confidence_set(np.array([[1.0], [5.0]]))[0]) == [0, 1]


def test_equal_losses_are_not_told_apart() -> None:
    same = np.tile(np.arange(1.0, 9.0), (3, 1))
    assert list(confidence_set(same)[0]) == [0, 1, 2]
