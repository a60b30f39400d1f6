"""How much better a larger set does once the smaller one's laws may have another form.

The true law is never the library's: what a right effect leaves is predictable too, and a second effect can
take a part of it. So before a second one is believed, the first may change its form: its contribution is
multiplied by hat functions of the drive, it may come late where it has a memory of the motion, and the
responses of the same effect with other parameters join in where they look alike. All of these have random
factors (a discrepancy prior, Kennedy and O'Hagan 2001), small shares of what the effect explains.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve

from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.noise import Whitener
from fem_spa.loop.operators import lowpass
from fem_spa.loop.screen import base_columns

TOLERANCE = 0.05
"""Share of an effect's explained square that another form of its law may take each way."""
LAGS = (0.1, 0.4, 1.6)
"""s by which a contribution may come late."""
OF_MOTION = ("fading", "rate-independent")
"""Memories of effects whose contribution may come late; a static law of another form is static."""
ALIKE = 0.6
"""Correlation from which another parameter's response counts as a neighbour."""
HATS = 5


def theta_columns(chain: Chain, data: Data, inside: bool = False) -> np.ndarray:
    """(n, d, k) derivatives of the prediction to the effects' parameters; `inside`: but those at a bound."""
    here = chain.response(data, chain.thetas, chain.base.values)
    columns = []
    for i, (effect, theta) in enumerate(zip(chain.effects, chain.thetas, strict=True)):
        for k, parameter in enumerate(effect.parameters):
            if inside and not parameter.low + 1e-6 < theta[k] < parameter.high - 1e-6:
                continue
            step = 1e-3 * max(abs(parameter.start), 0.02)
            if theta[k] + step > parameter.high:
                step = -step
            moved = [t.copy() for t in chain.thetas]
            moved[i][k] += step
            columns.append(chain.gain * (chain.response(data, moved, chain.base.values) - here) / step)
    if not columns:
        return np.zeros((*here.shape, 0))
    return np.stack(columns, axis=2)


def form_columns(chain: Chain, data: Data) -> tuple[np.ndarray, np.ndarray]:
    """(n, d, k) directions in which the effects' laws may differ, and (k,) deviations of their factors."""
    context = chain.context(data)
    u = context.drive
    here = chain.response(data, chain.thetas, chain.base.values)
    rows = data.train & data.known
    low, high = float(u[rows].min()), float(u[rows].max())
    place = np.clip((u - low) / max(high - low, 1e-12), 0.0, 1.0) * (HATS - 1)
    hats = np.maximum(1.0 - np.abs(place[:, None] - np.arange(HATS)), 0.0)
    columns: list[np.ndarray] = []
    sizes: list[float] = []
    for i, effect in enumerate(chain.effects):
        others = [k for k in range(len(chain.effects)) if k != i]
        rest = chain.with_effects([chain.effects[k] for k in others], [chain.thetas[k] for k in others])
        without = rest.response(data, rest.thetas, chain.base.values)
        own = chain.gain * (here - without)
        whole = float(np.sum((own - own[rows].mean(axis=0))[rows] ** 2)) or 1e-300
        shapes = [own * hats[:, k, None] for k in range(HATS)]
        late = [lowpass(data, own, tau, own[0]) - own for tau in LAGS if effect.memory in OF_MOTION]
        near = []
        for theta in [t for group in effect.starts(context) for t in group]:
            trial = rest.with_effects((*rest.effects, effect), (*rest.thetas, theta))
            other = chain.gain * (trial.response(data, trial.thetas, chain.base.values) - without)
            size = float(np.sum((other - other[rows].mean(axis=0))[rows] ** 2))
            if not np.isfinite(size) or size <= 0.0:
                continue
            like = float(np.sum(((other - other[rows].mean(axis=0)) * own)[rows])) / np.sqrt(size * whole)
            if like > ALIKE:
                near.append(other * np.sqrt(whole / size) - own)
        for group in (shapes, late, near):
            squares = [float(np.sum((c - c[rows].mean(axis=0))[rows] ** 2)) for c in group]
            shown = [(c, q) for c, q in zip(group, squares, strict=True) if q > 1e-6 * whole]
            total = sum(q for _, q in shown) or 1.0
            columns += [c for c, _ in shown]
            sizes += [float(np.sqrt(TOLERANCE * whole / total))] * len(shown)
    if not columns:
        return np.zeros((*here.shape, 0)), np.zeros(0)
    return np.stack(columns, axis=2), np.array(sizes)


def contributions(chain: Chain, data: Data) -> np.ndarray:
    """(k,) RMS on the training rows of what each effect adds, what the base's refit takes put aside."""
    rows = data.train & data.known
    here = chain.response(data, chain.thetas, chain.base.values)
    columns = base_columns(chain, data, here)
    free = columns[rows].reshape(-1, columns.shape[2])
    found = []
    for i in range(len(chain.effects)):
        others = [k for k in range(len(chain.effects)) if k != i]
        rest = chain.with_effects([chain.effects[k] for k in others], [chain.thetas[k] for k in others])
        own = chain.gain * (here - rest.response(data, rest.thetas, chain.base.values))[rows]
        flat = own.ravel()
        flat = flat - free @ np.linalg.lstsq(free, flat, rcond=1e-10)[0]
        found.append(np.sqrt(flat @ flat / len(own)))
    return np.array(found)


@dataclass(frozen=True)
class Formed:
    """A fitted set whose laws may change their form.

    Attributes
    ----------
    left : sum of whitened squares that is left, what the random factors cost included
    residual : (n, d) that is left
    """

    left: float
    residual: np.ndarray


@dataclass(frozen=True)
class Freedom:
    """What of a fitted set may give way.

    Attributes
    ----------
    columns : (n, d, k) derivatives to the free numbers, then the directions of form
    sizes : (m,) standard deviations of the last m of them
    residual : (n, d) as fitted
    """

    columns: np.ndarray
    sizes: np.ndarray
    residual: np.ndarray


def freedom(chain: Chain, data: Data) -> Freedom:
    """Parameters of base and effects, and the form of their laws."""
    plain = chain.response(data, chain.thetas, chain.base.values)
    form, sizes = form_columns(chain, data)
    free = [base_columns(chain, data, plain), theta_columns(chain, data, True)]
    residual = data.output - (chain.gain * plain + chain.offset)
    return Freedom(np.concatenate([*free, form], axis=2), sizes, residual)


def formed(given: Freedom, whiten: Whitener) -> Formed:
    """The set at its most likely form: parameters free, factors of the form random."""
    turned = whiten(np.concatenate([given.columns, given.residual[:, :, None]], axis=2))
    flat = turned.reshape(-1, turned.shape[2])
    gram = flat.T @ flat
    scale = np.sqrt(np.maximum(np.diag(gram)[:-1], 1e-300))
    count = given.columns.shape[2] - len(given.sizes)
    cost = np.full(len(scale), 1e-6)
    cost[count:] = 1.0 / np.maximum(given.sizes * scale[count:], 1e-6) ** 2
    inner = gram[:-1, :-1] / np.outer(scale, scale) + np.diag(cost)
    # columns that show nothing, or whose factors may not move, make rows of any size
    size = np.sqrt(np.diag(inner))
    right = gram[:-1, -1] / scale
    move = (
        solve(inner / np.outer(size, size) + 1e-10 * np.eye(len(size)), right / size, assume_a="pos") / size
    )
    return Formed(float(gram[-1, -1] - right @ move), given.residual - given.columns @ (move / scale))


def form_share(chain: Chain, data: Data, whiten: Whitener, floor: float) -> float:
    """Share of the predictable squares that other forms of the chain's own effects take, its base refitted.

    Parameters
    ----------
    floor : squares that nothing predicts
    """
    given = freedom(chain, data)
    own = base_columns(chain, data, chain.response(data, chain.thetas, chain.base.values))
    whole = formed(Freedom(own, np.zeros(0), given.residual), whiten).left
    return (whole - formed(given, whiten).left) / max(whole - floor, 1e-300)
