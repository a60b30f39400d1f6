"""Placebo: what an effect adds, given to the wrong records or moments, must not do as well as where it
belongs.

For each effect of a set its contribution is replaced by that of another record, shifted by a part of its own
record, or run backwards. A placebo that looks like the real thing (records that repeat a command) says
nothing and is left out.
"""

from __future__ import annotations

import numpy as np

from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.noise import Whitener
from fem_spa.loop.screen import base_columns

ALIKE = 0.7
"""Correlation from which a placebo is the real thing again."""
OF_THE_SESSION = ("time", "cycle", "max-history")
"""Memories that run through the session: what they add changes little within a record."""


def as_good_elsewhere(chain: Chain, data: Data, whiten: Whitener) -> tuple[str, ...]:
    """Names of the effects whose place is taken as well by a placebo."""
    here = chain.response(data, chain.thetas, chain.base.values)
    rows = data.train & data.known
    residual = data.output - (chain.gain * here + chain.offset)
    failed = []
    for i, effect in enumerate(chain.effects):
        others = [k for k in range(len(chain.effects)) if k != i]
        rest = chain.with_effects([chain.effects[k] for k in others], [chain.thetas[k] for k in others])
        plain = rest.response(data, rest.thetas, chain.base.values)
        own = chain.gain * (here - plain)
        trials = [own, *(c for c in _placebos(own, data) if _alike(c, own, rows) < ALIKE)]
        free = base_columns(rest, data, plain)
        stack = np.concatenate([free, np.stack(trials, axis=2), (residual + own)[:, :, None]], axis=2)
        turned = whiten(stack)
        flat = turned.reshape(-1, turned.shape[2])
        gains = _gains(flat.T @ flat, free.shape[2])
        if len(gains) > 1 and gains[1:].max() >= gains[0]:
            failed.append(effect.name)
    return tuple(failed)


def _placebos(own: np.ndarray, data: Data) -> list[np.ndarray]:
    """The contribution of other training records (in their own order, moved on), shifted, and backwards."""
    runs = [run.part for run in data.runs if run.train]
    found = []
    for move in (1, 2) if len(runs) > 2 else (1,) if len(runs) == 2 else ():
        out = np.zeros_like(own)
        for k, part in enumerate(runs):
            source = own[runs[(k + move) % len(runs)]]
            n = part.stop - part.start
            at = np.minimum(np.arange(n), len(source) - 1)
            out[part] = source[at]
        found.append(out)
    for share in (0.25, 0.5):
        out = np.zeros_like(own)
        for part in runs:
            out[part] = np.roll(own[part], int(share * (part.stop - part.start)), axis=0)
        found.append(out)
    back = np.zeros_like(own)
    for part in runs:
        back[part] = own[part][::-1]
    return [*found, back]


def _alike(a: np.ndarray, b: np.ndarray, rows: np.ndarray) -> float:
    x, y = (v[rows] - v[rows].mean(axis=0) for v in (a, b))
    return float(np.sum(x * y) / np.sqrt(max(float(np.sum(x * x) * np.sum(y * y)), 1e-300)))


def _gains(gram: np.ndarray, free: int) -> np.ndarray:
    """What each single column after the first `free` takes off the last one's squares, with a factor >= 0."""
    inner = gram[:free, :free]
    size = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    inverse = np.linalg.pinv(inner / np.outer(size, size), rcond=1e-10, hermitian=True)
    cross = gram[:free, free:] / size[:, None]
    small = gram[free:, free:] - cross.T @ inverse @ cross
    diagonal = np.diag(small)[:-1]
    good = diagonal > 1e-10 * np.diag(gram)[free:-1]
    return np.where(good, np.maximum(small[:-1, -1], 0.0) ** 2 / np.where(good, diagonal, 1.0), 0.0)
