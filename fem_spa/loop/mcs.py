"""Model confidence set: which of several predictors are not told apart from the best (Hansen, Lunde, Nason
2011).

Losses of the models on the same blocks; the equivalence test is T_max, its null by the bootstrap of whole
blocks (so what is correlated within a block stays together); the worst is dropped until the test no longer
rejects.
"""

from __future__ import annotations

import numpy as np

DRAWS = 400


def confidence_set(losses: np.ndarray, alpha: float = 0.1, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """The set and each model's p-value.

    Parameters
    ----------
    losses : (models, blocks) loss of each model on each block, finite
    alpha : the best model is in the set with probability 1 - alpha at least, for many blocks

    Returns
    -------
    (kept) indices in ascending order, and (models,) p-values: a model is kept where its own is alpha or more
    """
    models, blocks = losses.shape
    p = np.ones(models)
    kept = np.arange(models)
    if models < 2 or blocks < 2:
        return kept, p
    rng = np.random.default_rng(seed)
    weights = rng.multinomial(blocks, np.full(blocks, 1.0 / blocks), DRAWS) / blocks
    means, draws = losses.mean(axis=1), weights @ losses.T
    largest = 0.0
    while len(kept) > 1:
        apart = means[kept] - means[kept].mean()
        drawn = draws[:, kept] - draws[:, kept].mean(axis=1, keepdims=True) - apart
        size = np.sqrt(np.mean(drawn**2, axis=0))
        size = np.maximum(size, 1e-12 * (np.abs(means[kept]).max() + 1e-300))
        worst = int(np.argmax(apart / size))
        chance = float(np.mean(np.max(drawn / size, axis=1) >= apart[worst] / size[worst]))
        largest = max(largest, chance)
        p[kept[worst]] = largest
        kept = np.delete(kept, worst)
    return np.nonzero(p >= alpha)[0], p
