"""Fits: bounded least squares on whitened rows, the linear parameters (gain, offsets) projected out inside.

Variable projection after Golub and Pereyra (1973); the delay-like parameters are started from several
values by the screen, as their cost has more than one valley.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.effects.effect import Effect
from fem_spa.loop.noise import Noise, Whitener

LEAST_AMPLITUDE = 0.02
"""Deviations that a typical amplitude costs. What records do not show, since an offset does the same, goes to
nothing; what they show is not moved."""


@dataclass(frozen=True)
class Fit:
    """A fitted chain.

    Attributes
    ----------
    chain : with the values found
    cost : sum of squares of the whitened residual over the records fitted
    residual : (n, d) output less prediction, all rows
    """

    chain: Chain
    cost: float
    residual: np.ndarray
    thetas: tuple[np.ndarray, ...]


def linear_columns(chain: Chain, response: np.ndarray) -> np.ndarray:
    """(n, d, c): the gain's column where there is one, and one offset an output."""
    n, d = response.shape
    columns = []
    if chain.base.gain:
        columns.append(response)
    for j in range(d):
        one = np.zeros((n, d))
        one[:, j] = 1.0
        columns.append(one)
    return np.stack(columns, axis=2)


def project(whiten: Whitener, chain: Chain, output: np.ndarray, response: np.ndarray) -> tuple:
    """Best linear parameters: (whitened residual (n d,), gain, offset (d,))."""
    columns = linear_columns(chain, response)
    fixed = np.zeros_like(output) if chain.base.gain else response
    stack = whiten(np.concatenate([columns, (output - fixed)[:, :, None]], axis=2))
    flat = stack.reshape(-1, stack.shape[2])
    a, b = flat[:, :-1], flat[:, -1]
    gram = a.T @ a
    solution = np.linalg.lstsq(gram, a.T @ b, rcond=1e-12)[0]
    if chain.base.gain and solution[0] <= 0.0:
        rest = a[:, 1:]
        gain = 1e-3
        other = np.linalg.lstsq(rest.T @ rest, rest.T @ (b - gain * a[:, 0]), rcond=1e-12)[0]
        solution = np.concatenate([[gain], other])
    residual = b - a @ solution
    if chain.base.gain:
        return residual, float(solution[0]), solution[1:]
    return residual, 1.0, solution


def polished(chain: Chain, data: Data) -> Chain:
    """The chain with gain and offsets by plain least squares on the training rows, its effects as they are.

    Whitened fits hang on changes within a record; what is reported is the plain error.
    """
    response = chain.response(data, chain.thetas, chain.base.values)
    spread = float(np.std(data.output[data.train])) or 1.0
    runs = tuple(i for i, run in enumerate(data.runs) if run.train)
    plain = Whitener(data, Noise(spread, 1e-6 * spread, 1.0, 0.0, 0.0), response, runs)
    _, gain, offset = project(plain, chain, data.output, response)
    return replace(chain, gain=gain, offset=offset)


def fit(
    chain: Chain,
    data: Data,
    whiten: Whitener,
    effects: Sequence[Effect],
    starts: Sequence[np.ndarray],
    steps: int = 12,
) -> Fit:
    """Fit the effects' parameters from `starts`, with the base's, to the rows that `whiten` turns."""
    trial = chain.with_effects(effects, starts)
    effects, starts = trial.effects, trial.thetas
    sizes = [len(t) for t in starts]
    base = chain.base
    low = np.concatenate([*[e.low for e in effects], base.low])
    high = np.concatenate([*[e.high for e in effects], base.high])
    typical = np.concatenate(
        [
            *[np.maximum([abs(p.start) for p in e.parameters], 0.02) for e in effects],
            np.full(len(base.low), 0.3),
        ]
    )
    shown = np.concatenate([*[e.amplitudes for e in effects], np.zeros(len(base.low), bool)])
    weights = LEAST_AMPLITUDE / typical[shown]
    margin = 1e-7 * (high - low)
    x0 = np.clip(np.concatenate([*starts, base.values]), low + margin, high - margin)
    splits = np.cumsum(sizes)

    def parts(x: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
        pieces = np.split(x, splits)
        return pieces[:-1], pieces[-1]

    def residual(x: np.ndarray) -> np.ndarray:
        thetas, values = parts(x)
        response = trial.response(data, thetas, values)
        return np.asarray(project(whiten, trial, data.output, response)[0])

    x = x0
    if len(x0):
        rows = whiten.data.train
        keep = np.repeat(rows, data.output.shape[1])

        last: list[np.ndarray] = []

        def short(x: np.ndarray) -> np.ndarray:
            if last and np.array_equal(last[0], x):
                return last[1]
            last[:] = [x.copy(), np.concatenate([residual(x)[keep], weights * x[shown]])]
            return last[1]

        def slope(x: np.ndarray) -> np.ndarray:
            return forward(short, x, low, high, typical)

        found = least_squares(
            short,
            x0,
            jac=slope,
            bounds=(low, high),
            x_scale=typical,
            max_nfev=steps,
            ftol=1e-4,
            xtol=1e-4,
            gtol=1e-10,
        )
        x = found.x
    thetas, values = parts(x)
    response = trial.response(data, thetas, values)
    turned, gain, offset = project(whiten, trial, data.output, response)
    final = replace(trial, base=base.with_values(values), gain=gain, offset=offset, thetas=tuple(thetas))
    return Fit(final, float(turned @ turned), data.output - (gain * response + offset), tuple(thetas))


def forward(
    function: Callable[[np.ndarray], np.ndarray],
    x: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    typical: np.ndarray,
) -> np.ndarray:
    """(rows, k) one-sided differences with steps of a thousandth of the typical size, kept within the
    bounds."""
    here = function(x).copy()
    columns = []
    for j in range(len(x)):
        step = 1e-3 * typical[j]
        if x[j] + step > high[j]:
            step = -step
        moved = x.copy()
        moved[j] = max(x[j] + step, low[j])
        columns.append((function(moved) - here) / (moved[j] - x[j]))
    return np.stack(columns, axis=1)
