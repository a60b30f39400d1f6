"""Certificate: from the drive alone, which effects would show after the base is refitted, and which
pairs look alike.

For atoms a_i of typical size: visible share = |P a_i| / |a_i| with P projecting the base's refit out,
and distance
u_ij = |P a_i less its best multiple >= 0 of the group j| / |P a_i|, smallest over the groups of j,
median over i's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_spa.loop.noise import Noise, Whitener
from fem_spa.loop.screen import Atoms, reduced, solve, sums


@dataclass(frozen=True)
class Certificate:
    """What these records can show, before their outputs are looked at.

    Attributes
    ----------
    names : testable effects
    visible : (k,) share of an effect's typical response that the refit of the base leaves
    distance : (k, k) row i: what of effect i no amount of effect j reproduces, 0 to 1
    limit : (k,) smallest visible RMS that would be detected, SI unit of the output
    """

    names: tuple[str, ...]
    visible: np.ndarray
    distance: np.ndarray
    limit: np.ndarray


def certificate(atoms: Atoms, whiten: Whitener, threshold: float, names: Sequence[str]) -> Certificate:
    """Certificate of the screen's atoms; limits under the noise of `whiten`, the rest in plain squares."""
    flat = Whitener(whiten.data, Noise(1.0, 1e-6, 1.0, 0.0, 0.0), whiten.response, whiten.runs)
    plain = sums(atoms, flat).total
    small = reduced(plain, atoms.count)
    turned = reduced(sums(atoms, whiten).total, atoms.count)
    present = [n for n in names if any(g.effect.name == n for g in atoms.groups)]
    groups = {n: [g for g in atoms.groups if g.effect.name == n] for n in present}
    k = len(present)
    visible, distance, limit = np.zeros(k), np.ones((k, k)), np.full(k, np.nan)
    samples = float(np.sum(whiten.data.train)) * whiten.data.output.shape[1]
    for i, name in enumerate(present):
        columns = np.concatenate([g.columns for g in groups[name]])
        size = np.sqrt(np.maximum(np.diag(small)[columns] / np.maximum(np.diag(plain)[columns], 1e-300), 0.0))
        visible[i] = float(np.median(size))
        strength = np.maximum(np.diag(turned)[columns], 1e-300)
        rms = np.sqrt(np.maximum(np.diag(small)[columns], 0.0) / samples)
        limit[i] = float(np.median(np.sqrt(threshold / strength) * rms))
        for j, other in enumerate(present):
            distance[i, j] = 0.0 if i == j else _distance(small, columns, [g.columns for g in groups[other]])
    return Certificate(tuple(present), visible, distance, limit)


def _distance(small: np.ndarray, columns: np.ndarray, others: Sequence[np.ndarray]) -> float:
    values = []
    alone = np.array([g[0] for g in others if len(g) == 1], int)
    several = [g for g in others if len(g) > 1]
    for c in columns[:: max(len(columns) // 6, 1)]:
        whole = max(float(small[c, c]), 1e-300)
        size = np.maximum(small[alone, alone], 1e-300)
        best = float(np.max(np.maximum(small[alone, c], 0.0) ** 2 / size, initial=0.0))
        for other in several:
            places = np.append(other, c)
            best = max(best, solve(small[np.ix_(places, places)], np.arange(len(other)))[1])
        values.append(np.sqrt(max(1.0 - best / whole, 0.0)))
    return float(np.median(values))
