"""How large the best of all effects gets by chance: the largest score over all atoms, under the null's
own noise."""

from __future__ import annotations

import numpy as np

from fem_spa.loop.noise import Whitener
from fem_spa.loop.screen import Atoms, reduced

DRAWS = 400
PRIOR_FREEDOM = 4
"""Records that what is known of repeatability in general is worth."""


def scores(small: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """(atoms,) squared score of each atom alone, zero where its sign is wrong or the base's refit takes it.

    Parameters
    ----------
    small : `reduced` sums;  whole : (atoms,) squared size of each atom before that
    """
    diagonal = np.diag(small)[:-1]
    shows = diagonal > 1e-8 * whole
    found = np.maximum(small[:-1, -1], 0.0) ** 2 / np.where(shows, diagonal, 1.0)
    return np.asarray(np.where(shows, found, 0.0))


def null_quantile(atoms: Atoms, whiten: Whitener, seed: int, level: float = 0.98) -> float:
    """The `level` quantile of the largest score for records of noise alone.

    Whitened noise is white, but the sizes of a record's own offset and gain are known from few records
    only: along
    them the draws have Student's heavier tails.
    """
    rng = np.random.default_rng(seed)
    turned = whiten(atoms.rows[:, :, :-1])
    flat = turned.reshape(-1, turned.shape[2])
    gram = np.zeros((flat.shape[1] + 1,) * 2)
    gram[:-1, :-1] = flat.T @ flat
    small = reduced(gram, atoms.count)[:-1, :-1]
    shows = np.diag(small) > 1e-8 * np.diag(gram)[: atoms.count]
    size = np.where(shows, np.sqrt(np.maximum(np.diag(small), 1e-300)), np.inf)
    along = []
    nuisance = flat[:, atoms.count :]
    inverse = np.linalg.pinv(nuisance.T @ nuisance, rcond=1e-10, hermitian=True)
    for index, basis in zip(whiten.runs, whiten.record_bases(), strict=False):
        part = whiten.data.runs[index].part
        rows = turned[part].reshape(-1, turned.shape[2])
        direct = basis.T @ rows
        along.append(
            direct[:, : atoms.count]
            - direct[:, atoms.count :] @ inverse @ (nuisance.T @ flat[:, : atoms.count])
        )
    record = np.concatenate(along) if along else np.zeros((0, atoms.count))
    bulk = small - record.T @ record
    values, vectors = np.linalg.eigh(bulk)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    freedom = len(whiten.runs) - 1 + PRIOR_FREEDOM
    draws = rng.standard_normal((DRAWS, root.shape[1])) @ root.T
    heavy = np.sqrt(freedom / rng.chisquare(freedom, (DRAWS, 1)))
    draws += (heavy * rng.standard_normal((DRAWS, record.shape[0]))) @ record
    largest = np.max(np.maximum(draws / size, 0.0) ** 2, axis=1)
    return float(np.quantile(largest, level))
