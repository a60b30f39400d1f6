"""Screen: each effect's typical responses, linear in their size, against the whitened residual.

An atom is the response of the chain with one typical theta of one effect, less the response without it.
A group
is the atoms of one start of an effect; their factors are not negative. All sums that least squares need
are kept
fold by fold, so that leaving a record out costs nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.effects.effect import Effect
from fem_spa.loop.fit import linear_columns
from fem_spa.loop.folds import folds
from fem_spa.loop.noise import Whitener

LEAST_VISIBLE = 1e-7
"""Share of an atom's square that the base's refit must leave."""


@dataclass(frozen=True)
class Group:
    """Atoms of one start of an effect.

    Attributes
    ----------
    columns : places of its atoms among all
    """

    effect: Effect
    thetas: tuple[np.ndarray, ...]
    columns: np.ndarray


@dataclass(frozen=True)
class Atoms:
    """All atoms, not whitened.

    Attributes
    ----------
    rows : (n, d, atoms + nuisance + 1): atoms, what the refit of the base takes, residual of the base
    count : number of atoms
    """

    groups: tuple[Group, ...]
    rows: np.ndarray
    count: int


def make_atoms(chain: Chain, data: Data, effects: Sequence[Effect]) -> Atoms:
    """Responses of all starts of `effects` on top of the chain (which may have effects already)."""
    plain = chain.response(data, chain.thetas, chain.base.values)
    context = chain.context(data)
    groups: list[Group] = []
    columns: list[np.ndarray] = []
    for effect in effects:
        for thetas in effect.starts(context):
            kept, places = [], []
            for theta in thetas:
                trial = chain.with_effects((*chain.effects, effect), (*chain.thetas, theta))
                delta = chain.gain * (trial.response(data, trial.thetas, chain.base.values) - plain)
                if np.isfinite(delta).all() and np.abs(delta[data.train]).max() > 1e-9 * chain.scale.max():
                    kept.append(theta)
                    places.append(len(columns))
                    columns.append(delta)
            if kept:
                groups.append(Group(effect, tuple(kept), np.array(places)))
    nuisance = base_columns(chain, data, plain)
    residual = data.output - (chain.gain * plain + chain.offset)
    rows = np.concatenate([np.stack(columns, axis=2), nuisance, residual[:, :, None]], axis=2)
    return _showing(Atoms(tuple(groups), rows, len(columns)), data)


def _showing(atoms: Atoms, data: Data) -> Atoms:
    """Without the atoms that the refit of the base takes altogether: their factors would be noise over
    nothing."""
    flat = atoms.rows[data.train & data.known].reshape(-1, atoms.rows.shape[2])
    gram = flat.T @ flat
    left = np.diag(reduced(gram, atoms.count))[:-1] > LEAST_VISIBLE * np.diag(gram)[: atoms.count]
    place = np.cumsum(left) - 1
    groups = []
    for group in atoms.groups:
        keep = [i for i, c in enumerate(group.columns) if left[c]]
        if keep:
            columns = place[group.columns[keep]]
            groups.append(Group(group.effect, tuple(group.thetas[i] for i in keep), columns))
    kept = np.concatenate([np.nonzero(left)[0], np.arange(atoms.count, atoms.rows.shape[2])])
    return Atoms(tuple(groups), atoms.rows[:, :, kept], int(left.sum()))


def base_columns(chain: Chain, data: Data, plain: np.ndarray) -> np.ndarray:
    """(n, d, c): derivatives of the prediction to what is refitted: linear parameters, base values,
    thetas."""
    columns = [linear_columns(chain, plain)]
    for k in range(len(chain.base.values)):
        moved = chain.base.values.copy()
        moved[k] += 1e-3
        delta = chain.gain * (chain.response(data, chain.thetas, moved) - plain) / 1e-3
        columns.append(delta[:, :, None])
    return np.concatenate(columns, axis=2)


@dataclass(frozen=True)
class Sums:
    """Sums over folds of whitened rows.

    Attributes
    ----------
    grams : (folds, c, c) over atoms, nuisance, residual
    count : atoms;  total : their sum over folds
    """

    grams: np.ndarray
    count: int

    @property
    def total(self) -> np.ndarray:
        return np.asarray(self.grams.sum(axis=0))


def sums(atoms: Atoms, whiten: Whitener) -> Sums:
    """Whiten and sum."""
    turned = whiten(atoms.rows)
    grams = []
    for rows in folds(whiten.data):
        flat = turned[rows].reshape(-1, turned.shape[2])
        grams.append(flat.T @ flat)
    return Sums(np.stack(grams), atoms.count)


def reduced(gram: np.ndarray, count: int) -> np.ndarray:
    """(count + 1, count + 1): atoms and residual with the nuisance projected out."""
    keep = np.concatenate([np.arange(count), [gram.shape[0] - 1]])
    nuisance = np.arange(count, gram.shape[0] - 1)
    if len(nuisance) == 0:
        return gram[np.ix_(keep, keep)]
    inner = gram[np.ix_(nuisance, nuisance)]
    size = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    cross = gram[np.ix_(nuisance, keep)] / size[:, None]
    inverse = np.linalg.pinv(inner / np.outer(size, size), rcond=1e-10, hermitian=True)
    return np.asarray(gram[np.ix_(keep, keep)] - cross.T @ inverse @ cross)


def solve(small: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, float]:
    """Factors >= 0 of the chosen atoms, and the sum of squares that they take off; `small` is `reduced`."""
    a = small[np.ix_(columns, columns)]
    b = small[columns, -1]
    shows = np.diag(a) > 1e-14 * max(float(np.max(np.diag(small)[:-1])), 1e-300)
    size = np.where(shows, np.sqrt(np.maximum(np.diag(a), 1e-300)), 1.0)
    scaled = a / np.outer(size, size) * np.outer(shows, shows)
    b = b * shows
    values, vectors = np.linalg.eigh(scaled)
    good = values > 1e-9
    root = np.sqrt(values[good])
    matrix = root[:, None] * vectors[:, good].T
    right = (vectors[:, good].T @ (b / size)) / root
    factors, _ = nnls(matrix, right)
    gain = 2.0 * factors @ (b / size) - factors @ scaled @ factors
    return factors / size, float(gain)


def left_out(found: Sums, columns: np.ndarray) -> np.ndarray:
    """(folds,) squared errors of each fold with everything fitted on the others; `columns` may be empty."""
    count, total = found.count, found.total
    errors = []
    nuisance = np.arange(count, total.shape[0] - 1)
    for gram in found.grams:
        rest = total - gram
        small = reduced(rest, count)
        factors = solve(small, columns)[0] if len(columns) else np.zeros(0)
        inner = rest[np.ix_(nuisance, nuisance)]
        right = rest[nuisance, -1] - rest[np.ix_(nuisance, columns)] @ factors
        size = np.sqrt(np.maximum(np.diag(inner), 1e-300))
        inverse = np.linalg.pinv(inner / np.outer(size, size), rcond=1e-10, hermitian=True)
        beta = inverse @ (right / size) / size
        v = np.zeros(total.shape[0])
        v[columns], v[nuisance], v[-1] = -factors, -beta, 1.0
        errors.append(float(v @ gram @ v))
    return np.array(errors)


def start_of(group: Group, factors: np.ndarray) -> np.ndarray:
    """The theta that a group's factors stand for: amplitudes add up, the others are the group's."""
    theta = group.thetas[0].copy()
    which = group.effect.amplitudes
    theta[which] = sum(f * t[which] for f, t in zip(factors, group.thetas, strict=True))
    return np.clip(theta, group.effect.low, group.effect.high)
