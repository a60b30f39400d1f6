"""Value and standard deviations of a statistic under the fitted noise.

A contrast's weights are its pattern with the freedom of the base, and all that must not count, projected out
(least squares on the training rows), scaled such that the pattern itself gives one. The value is linear in
the residual, so its variance under white noise, AR(1) noise and random offsets and gains of the records is
exact. Of several contrasts the clearest counts; it is held against what the clearest of them is by chance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.noise import Noise
from fem_spa.loop.screen import base_columns
from fem_spa.loop.signatures.statistic import Contrast, Seen, Statistic

LEAST_LEFT = 1e-3
"""Share of a pattern's squares that must be left when all else is put aside."""
LITTLE = 0.1
"""The same, below which a factor would be a guess at what does not show: the most that shows is told."""
DRAWS = 4000
"""Of the clearest of several contrasts by chance."""


@dataclass(frozen=True)
class Measured:
    """A statistic of several residuals at the place where it is clearest in the first.

    Attributes
    ----------
    values : in SI of the output, or the statistic's own unit
    deviations : the same in standard deviations of noise
    at : the place in words, or nothing
    partly : whether it is what the base's refit and all else leave of it, at most, in SI of the output
    """

    values: tuple[float, ...]
    deviations: tuple[float, ...]
    at: str
    partly: bool = False


def seen(chain: Chain, data: Data, theta: np.ndarray | None = None, sensed: np.ndarray | None = None) -> Seen:
    """What statistics look at, of a refitted base."""
    values = chain.base.values
    plain = chain.response(data, chain.thetas, values)

    def respond(pressure: np.ndarray) -> np.ndarray:
        return np.asarray(chain.gain * chain.response(data, chain.thetas, values, pressure))

    def loaded(name: str, size: np.ndarray) -> np.ndarray:
        return np.asarray(chain.gain * chain.response(data, chain.thetas, values, None, {name: size}))

    free = base_columns(chain, data, plain)
    return Seen(chain.context(data), chain.gain * plain, free, respond, loaded, chain.gain, theta, sensed)


@dataclass(frozen=True)
class Gauge:
    """A statistic made ready for one set of records.

    Attributes
    ----------
    weights : (n, d, k) of its contrasts
    size : (k,) standard deviations of their values under noise
    chance : root mean square of the clearest of them, by noise alone, in standard deviations
    places : of each, in words
    partly : (k,) whether its value is what shows of it
    """

    weights: np.ndarray
    size: np.ndarray
    chance: float
    places: tuple[str, ...]
    partly: np.ndarray

    def read(self, *residuals: np.ndarray) -> Measured:
        """The statistic of (n, d) residuals."""
        values = [np.einsum("ndk,nd->k", self.weights, residual) for residual in residuals]
        best = int(np.argmax(np.abs(values[0] / self.size)))
        deviations = tuple(float(v[best] / self.size[best] / self.chance) for v in values)
        told = tuple(float(v[best]) for v in values)
        return Measured(told, deviations, self.places[best], bool(self.partly[best]))


def gauge(statistic: Statistic, what: Seen, noise: Noise) -> Gauge | str:
    """Make a statistic ready, or say why these records cannot show it."""
    found = statistic.contrasts(what)
    if isinstance(found, str):
        return found
    weights, places, partly = [], [], []
    kept: dict = {}
    for contrast in found:
        w = weights_of(contrast, what, kept)
        if w is None:
            continue
        little = shown(contrast, what, w) < LITTLE
        # weights are what is left over its squares, so this makes the largest of what is left one
        weights.append(w * np.abs(w).max() / np.sum(w**2) if little else w)
        places.append(contrast.at)
        partly.append(little)
    if not weights:
        return "the refit of the base model, and what else is named, take all of it"
    stack = np.stack(weights, axis=2)
    spread = covariance(stack, what, noise)
    size = np.sqrt(np.maximum(np.diag(spread), 1e-300))
    chance = by_chance(spread / np.outer(size, size))
    return Gauge(stack, size, chance, tuple(places), np.array(partly))


def weights_of(contrast: Contrast, what: Seen, kept: dict | None = None) -> np.ndarray | None:
    """(n, d) weights of a contrast, zero on rows that do not count; None where nothing is left of it.

    kept : bases of what is put aside, of contrasts that share it
    """
    kept = {} if kept is None else kept
    key = id(contrast.beside), id(contrast.groups)
    if key not in kept:
        kept[key] = _put_aside(contrast, what), contrast
    rows, u = kept[key][0]
    pattern = _varying(contrast, rows)
    whole = float(np.sum(pattern**2))
    if contrast.groups is None:
        pattern = contrast.pattern[rows]
    left = pattern.ravel() - u @ (u.T @ pattern.ravel())
    squares = float(left @ left)
    if not squares > LEAST_LEFT * whole or whole <= 0.0:
        return None
    out = np.zeros(contrast.pattern.shape)
    out[rows] = (left / squares).reshape(pattern.shape)
    return out


def _put_aside(contrast: Contrast, what: Seen) -> tuple[np.ndarray, np.ndarray]:
    """(n,) rows that count, and an orthonormal basis of what must not."""
    rows = what.rows if contrast.groups is None else what.rows & (contrast.groups >= 0)
    beside = np.concatenate([what.free, contrast.beside], axis=2)[rows]
    if contrast.groups is not None:
        size = np.sqrt((beside**2).sum(axis=(0, 1)))
        beside = _centred(beside, contrast.groups[rows])
        beside = beside * (np.sqrt((beside**2).sum(axis=(0, 1))) > 1e-7 * size)
    a = beside.reshape(-1, beside.shape[2])
    a = a / np.maximum(np.sqrt((a * a).sum(axis=0)), 1e-300)
    values, vectors = np.linalg.eigh(a.T @ a)
    good = values > 1e-11 * max(float(values.max(initial=0.0)), 1e-300)
    return rows, a @ (vectors[:, good] / np.sqrt(values[good]))


def left_over(contrast: Contrast, what: Seen) -> float:
    """Share of a pattern's squares that is left when all else is put aside."""
    weights = weights_of(contrast, what)
    return 0.0 if weights is None else shown(contrast, what, weights)


def shown(contrast: Contrast, what: Seen, weights: np.ndarray) -> float:
    """The same, by its weights."""
    rows = what.rows if contrast.groups is None else what.rows & (contrast.groups >= 0)
    return float(1.0 / np.sum(weights**2) / np.sum(_varying(contrast, rows) ** 2))


def _varying(contrast: Contrast, rows: np.ndarray) -> np.ndarray:
    """Rows of the pattern less their mean, or that of their group."""
    pattern = contrast.pattern[rows]
    groups = np.zeros(len(pattern)) if contrast.groups is None else contrast.groups[rows]
    return _centred(pattern, groups)


def _centred(x: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Rows less the mean of their group."""
    _, place = np.unique(groups, return_inverse=True)
    count = np.bincount(place)
    flat = x.reshape(len(x), -1)
    means = np.stack([np.bincount(place, column) for column in flat.T], axis=1) / count[:, None]
    return np.asarray((flat - means[place]).reshape(x.shape))


def covariance(weights: np.ndarray, what: Seen, noise: Noise) -> np.ndarray:
    """(k, k) of what (n, d, k) weights make of noise, exact."""
    data, d = what.context.data, weights.shape[1]
    response = what.response - what.gain * what.context.rest
    k = weights.shape[2]
    found = np.zeros((k, k))
    for run in data.runs:
        if not run.train:
            continue
        part = weights[run.part]
        flat = part.reshape(-1, k)
        square = flat.T @ flat
        found += noise.white**2 * square
        if noise.coloured > 0.0:
            late = lfilter([1.0], [1.0, -math.exp(-run.step / noise.tau)], part, axis=0)
            cross = flat.T @ late.reshape(-1, k)
            found += noise.coloured**2 * (cross + cross.T - square)
        for j in range(d):
            total = part[:, j].sum(axis=0)
            found += noise.offset**2 * np.outer(total, total)
        total = np.einsum("ndk,nd->k", part, response[run.part])
        found += noise.gain**2 * np.outer(total, total)
    return found


def by_chance(correlation: np.ndarray) -> float:
    """Root mean square of the largest of correlated standard deviates."""
    if len(correlation) == 1:
        return 1.0
    values, vectors = np.linalg.eigh(correlation)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    draws = np.random.default_rng(0).standard_normal((DRAWS, len(values))) @ root.T
    return float(np.sqrt(np.mean(np.max(draws**2, axis=1))))
