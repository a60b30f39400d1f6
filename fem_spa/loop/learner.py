"""The reference learner: a flexible black box that says how much of a residual is predictable at all.

Ridge regression on hat functions of what a causal effect can depend on (drive, lagged drives, plays,
rate, largest
drive so far, cycles, time, temperature, orientation, payload), each alone and times the drive and its square;
its ridge is chosen by leaving folds out. It is the yardstick of what is left, never the answer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem_spa.loop.effects.effect import Context
from fem_spa.loop.folds import folds
from fem_spa.loop.noise import Whitener
from fem_spa.loop.operators import lowpass, play, running_max, travelled

RIDGES = (1.0, 10.0, 100.0, 1e3, 1e4, 1e5)
LAGS = (0.15, 0.6, 2.5, 10.0, 40.0)


@dataclass(frozen=True)
class Learned:
    """What the learner found.

    Attributes
    ----------
    before, after : (folds,) squared whitened errors of left-out folds, without and with it
    prediction : (n, d) of the residual: left-out predictions on training rows, plain ones on the others
    shares : feature -> how much of the predicted variance goes when the feature is frozen
    """

    before: np.ndarray
    after: np.ndarray
    prediction: np.ndarray
    shares: dict[str, float]

    @property
    def gain(self) -> float:
        """Share of the squared error that it takes off, left out; negative where it does harm."""
        return float(1.0 - self.after.sum() / self.before.sum())


def features(context: Context) -> dict[str, np.ndarray]:
    """Name -> (n,) what an effect can depend on, in plain words."""
    data, u = context.data, context.drive
    found: dict[str, np.ndarray] = {}
    for tau in LAGS:
        if 0.7 * min(r.step for r in data.runs) < tau < 1.5 * data.longest:
            found[f"the last {tau:g} s"] = u - lowpass(data, u, tau)
    found["direction of motion"] = u - play(data, u, 0.04)
    found["where it last turned"] = u - play(data, u, 0.2)
    fast = lowpass(data, u, 0.1)
    rate = np.concatenate([np.gradient(fast[r.part]) / r.step for r in data.runs])
    found["rate"] = np.tanh(rate / (2.0 * (np.std(rate) + 1e-12)))
    found["largest pressure so far"] = running_max(data, np.abs(u))
    found["cycles"] = travelled(data, u)
    found["time"] = data.clock
    start = np.concatenate([data.clock[r.part] - data.clock[r.part.start] for r in data.runs])
    found["time within a record"] = start
    if data.temperature is not None and np.ptp(data.temperature) > 0.2:
        found["temperature"] = data.temperature
    for name, values in (("orientation", data.orientation), ("payload", data.payload)):
        if np.ptp(values) > 1e-9:
            found[name] = np.cos(values) if name == "orientation" else values
    if data.pressure.shape[1] > 1:
        for j, column in enumerate(context.q.T):
            found[f"chamber {j + 1}"] = column
    return found


def _hats(x: np.ndarray, train: np.ndarray, count: int) -> np.ndarray:
    """(n, count) hat functions on knots at quantiles of the training rows."""
    low, high = np.percentile(x[train], [0.5, 99.5])
    if high - low < 1e-12:
        return np.zeros((len(x), 0))
    z = np.clip((x - low) / (high - low), -0.05, 1.05) * (count - 1)
    hats = np.maximum(1.0 - np.abs(z[:, None] - np.arange(count)), 0.0)
    return np.asarray(hats - hats[train].mean(axis=0))


def basis(context: Context) -> tuple[np.ndarray, list[str]]:
    """(n, c) columns and the feature each belongs to."""
    train, u = context.data.train, context.drive
    columns, owners = [_hats(u, train, 9)], ["pressure"] * 9
    for name, values in features(context).items():
        hats = _hats(values, train, 5)
        for power in (0, 1, 2):
            columns.append(hats * (u**power)[:, None])
            owners += [name] * hats.shape[1]
    found = np.concatenate(columns, axis=1)
    size = found[train].std(axis=0)
    keep = size > 1e-9
    return found[:, keep] / size[keep], [o for o, k in zip(owners, keep, strict=True) if k]


def learn(
    context: Context, residual: np.ndarray, whiten: Whitener, nuisance: np.ndarray | None = None
) -> Learned:
    """Learn an (n, d) residual from the drive, folds left out.

    Parameters
    ----------
    nuisance : (n, d, c) columns that are refitted freely beside it (the base's own)
    """
    data = context.data
    d = residual.shape[1]
    columns, owners = basis(context)
    prediction = np.zeros_like(residual)
    spread = dict.fromkeys(owners, 0.0)
    groups = folds(data)
    parts = []
    for j in range(d):
        alone = columns[:, None, :] * (np.arange(d) == j)[None, :, None]
        free = (
            np.zeros((len(residual), d, 0))
            if nuisance is None
            else nuisance * (np.arange(d) == j)[None, :, None]
        )
        target = residual * (np.arange(d) == j)[None, :]
        stack = np.concatenate([alone, free, target[:, :, None]], axis=2)
        turned = whiten(stack)[:, j]
        grams = np.stack([turned[rows].T @ turned[rows] for rows in groups])
        parts.append((alone.shape[2], free.shape[2], grams))
    best = None
    for ridge in RIDGES:
        errors = np.zeros(len(groups))
        plain = np.zeros(len(groups))
        solutions = []
        for count, extra, grams in parts:
            total = grams.sum(axis=0)
            per_fold = []
            for f, gram in enumerate(grams):
                v = _solution(total - gram, count, extra, ridge)
                w = _solution(total - gram, 0, extra, ridge, skip=count)
                errors[f] += float(v @ gram @ v)
                plain[f] += float(w @ gram @ w)
                per_fold.append(v)
            solutions.append((per_fold, _solution(total, count, extra, ridge)))
        if best is None or errors.sum() < best[0].sum():
            best = (errors, plain, solutions)
    assert best is not None
    after_all, before_all, solutions = best
    for j, (count, _, _) in enumerate(parts):
        per_fold, whole = solutions[j]
        prediction[:, j] = columns @ -whole[:count]
        for rows, v in zip(groups, per_fold, strict=True):
            prediction[rows, j] = columns[rows] @ -v[:count]
        train = data.train
        for name in spread:
            mask = np.array([o == name for o in owners])
            spread[name] += float(np.var(columns[train][:, mask] @ whole[:count][mask]))
    total_spread = sum(spread.values()) or 1.0
    shares = {name: value / total_spread for name, value in sorted(spread.items(), key=lambda i: -i[1])}
    return Learned(before_all, after_all, prediction, shares)


def _solution(gram: np.ndarray, count: int, extra: int, ridge: float, skip: int = 0) -> np.ndarray:
    """Vector (-coefficients, 1) of a ridge on the first `count` columns, the next `extra` free."""
    used = np.concatenate([np.arange(count), np.arange(skip or count, (skip or count) + extra)]).astype(int)
    v = np.zeros(len(gram))
    v[-1] = 1.0
    if len(used):
        weight = np.concatenate([np.full(count, ridge), np.full(extra, 1e-9)])
        matrix = gram[np.ix_(used, used)] + np.diag(weight * (1.0 + 1e-9 * np.diag(gram)[used]))
        v[used] = -np.linalg.lstsq(matrix, gram[used, -1], rcond=1e-12)[0]
    return v
