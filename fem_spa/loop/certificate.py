"""Certificate: from the drive alone, which effects would show after the base is refitted, and which
pairs look alike.

For atoms a_i of typical size: visible share = |P a_i| / |a_i| with P projecting the base's refit out,
and distance
u_ij = |P a_i less its best multiple >= 0 of the group j| / |P a_i|, smallest over the groups of j,
median over i's. Beside it, from the noise that was found: how large an effect may be and not show.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_spa.loop.data import Data
from fem_spa.loop.form import Freedom
from fem_spa.loop.noise import Noise, Whitener
from fem_spa.loop.screen import Atoms, reduced, solve, sums


@dataclass(frozen=True)
class Certificate:
    """What these records can show, from what was commanded.

    Attributes
    ----------
    names : testable effects
    visible : (k,) share of an effect's typical response that the refit of the base leaves
    distance : (k, k) row i: what of effect i no amount of effect j reproduces, 0 to 1
    squares : (atoms,) sum of squares of each atom that the refit of the base leaves, SI
    """

    names: tuple[str, ...]
    visible: np.ndarray
    distance: np.ndarray
    squares: np.ndarray


def certificate(atoms: Atoms, data: Data, runs: tuple[int, ...], names: Sequence[str]) -> Certificate:
    """Certificate of the screen's atoms, in plain squares; no reading has a part in it."""
    flat = Whitener(data, Noise(1.0, 1e-6, 1.0, 0.0, 0.0), np.zeros_like(data.output), runs)
    plain = sums(atoms, flat).total
    small = reduced(plain, atoms.count)
    groups = _groups(atoms, names)
    k = len(groups)
    visible, distance = np.zeros(k), np.ones((k, k))
    for i, name in enumerate(groups):
        columns = np.concatenate(groups[name])
        size = np.sqrt(np.maximum(np.diag(small)[columns] / np.maximum(np.diag(plain)[columns], 1e-300), 0.0))
        visible[i] = float(np.median(size))
        for j, other in enumerate(groups):
            distance[i, j] = 0.0 if i == j else _distance(small, columns, groups[other])
    return Certificate(tuple(groups), visible, distance, np.maximum(np.diag(small)[:-1], 0.0))


def limits(
    given: Certificate, atoms: Atoms, whiten: Whitener, threshold: float, named: Sequence[Freedom]
) -> dict[str, float]:
    """Smallest visible RMS of each effect that would have been detected, SI unit of the output.

    Parameters
    ----------
    given : of the same atoms
    threshold : score from which something is detected
    named : what of the effects that are named may give way, and so take over for others
    """
    taken = [way.columns for way in named]
    wider = replace(atoms, rows=np.dstack([atoms.rows[:, :, :-1], *taken, atoms.rows[:, :, -1:]]))
    free = [np.zeros(atoms.rows.shape[2] - 1)]
    for way in named:
        free += [np.zeros(way.columns.shape[2] - len(way.sizes)), np.maximum(way.sizes, 1e-9) ** -2.0]
    turned = reduced(sums(wider, whiten).total + np.diag(np.concatenate([*free, [0.0]])), atoms.count)
    samples = float(np.sum(whiten.data.train)) * whiten.data.output.shape[1]
    found = {}
    for name, groups in _groups(atoms, given.names).items():
        columns = np.concatenate(groups)
        strength = np.maximum(np.diag(turned)[columns], 1e-300)
        rms = np.sqrt(given.squares[columns] / samples)
        found[name] = float(np.median(np.sqrt(threshold / strength) * rms))
    return found


def _groups(atoms: Atoms, names: Sequence[str]) -> dict[str, list[np.ndarray]]:
    """Effect -> columns of its groups, for those that have any."""
    own = {n: [g.columns for g in atoms.groups if g.effect.name == n] for n in names}
    return {n: groups for n, groups in own.items() if groups}


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
