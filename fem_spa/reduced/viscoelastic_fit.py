"""Fit of Kelvin-Voigt elements to measured responses, as (6) of the bellow paper, with intervals.

Hashem et al. minimise the sum over responses n and samples i of ((D_model - D_measured) / D_measured)^2 (6).
Samples at rest divide by nothing, so a displacement below `floor` of the largest counts as that. Weights from
the measured values themselves pull the model below the data, by twice the squared relative noise (5 % noise:
0.5 %); `weights = "relative to model"` divides by the model's displacement and has no such bias.

Given the rates, the compliances 1/k enter linearly: they are found by non-negative least squares, and only
the rates are searched, from several starts over the decades that the records cover. No start values are
needed; with `start` the search begins there too. The 95 % intervals are those of the sandwich estimate for
errors of one size a response, correlated from sample to sample as AR(1), both estimated from what is left.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares, nnls
from scipy.signal import lfilter
from scipy.stats import t as student

from fem_spa.errors import InputError
from fem_spa.reduced.checks import check_drive
from fem_spa.reduced.model import Drive, Range
from fem_spa.reduced.viscoelastic import KelvinVoigt, elements, kelvin_voigt

WEIGHTS = ("relative", "relative to model", "absolute")
FLOOR = 0.02
"""Least displacement that a relative error divides by, as a share of the largest."""
MOST = 6
"""Elements; more are never told apart."""


@dataclass(frozen=True, eq=False)
class Fit:
    """What was found.

    Attributes
    ----------
    model : with intervals, and the range it was fitted in
    rmse : root of the mean squared error, output in SI;  worst : the largest error
    r2 : coefficient of determination over all samples
    objective : value of (6), or of the weights chosen
    """

    model: KelvinVoigt
    rmse: float
    worst: float
    r2: float
    objective: float


@dataclass(frozen=True, eq=False)
class _Data:
    """Responses as arrays: (time, pressure) of each, and all measured values in one (n,)."""

    drives: list[tuple[np.ndarray, np.ndarray]]
    measured: np.ndarray
    weight: np.ndarray


def fit_kelvin_voigt(
    responses: Sequence[tuple[Drive, np.ndarray]],
    count: int = 2,
    weights: str = "relative",
    floor: float = FLOOR,
    start: Mapping[str, float] | None = None,
    output: str = "displacement",
    source: str = "",
) -> Fit:
    """Elements through measured responses, each at rest and unpressurised before its first sample.

    Parameters
    ----------
    responses : drive with one chamber, and the measured output (n,) in SI, zero at rest
    count : number of elements, 1 to 6; numbered from the slowest, as in the paper
    weights : "relative" (6), "relative to model" or "absolute"
    floor : share of the largest output that relative errors divide by at least
    start : parameters k1, eta1, ... (SI) to begin from, besides starts of our own
    output : what was measured: displacement, angle or force

    Raises
    ------
    InputError : another number of values than times, no response, fewer samples than parameters, unknown
        weights, or an output that does not follow the pressure at all
    """
    if weights not in WEIGHTS:
        raise InputError(f"given weights '{weights}'; allowed: {', '.join(WEIGHTS)}")
    if not 1 <= count <= MOST:
        raise InputError(f"given {count} elements; 1 to {MOST} can be fitted")
    data = _gather(responses, count)
    size = np.maximum(np.abs(data.measured), floor * np.max(np.abs(data.measured)))
    first = replace(data, weight=np.ones_like(size) if weights == "absolute" else 1.0 / size)
    share, rate = _search(first, count, start)
    if weights == "relative to model":
        for _ in range(10):
            fitted = np.abs(_matrix(first.drives, rate) @ share)
            before = rate
            first = replace(data, weight=1.0 / np.maximum(fitted, floor * np.max(fitted)))
            share, rate = _polish(first, share, rate)
            if np.allclose(before, rate, rtol=1e-10):
                break
    return _fit(first, share, rate, output, source)


def _gather(responses: Sequence[tuple[Drive, np.ndarray]], count: int) -> _Data:
    drives, measured = [], []
    for drive, values in responses:
        time, pressure = check_drive(drive, 1, "kelvin-voigt")
        value = np.asarray(values, float).reshape(-1)
        if value.size != time.size or not np.all(np.isfinite(value)):
            raise InputError(
                f"given {value.size} values for {time.size} times; one finite value a time is needed"
            )
        drives.append((time, np.ascontiguousarray(pressure[:, 0])))
        measured.append(value)
    if sum(v.size for v in measured) <= 2 * count:
        total = sum(v.size for v in measured)
        raise InputError(f"given {total} samples for {2 * count} parameters; give longer records")
    flat = np.concatenate(measured)
    if not np.any(flat) or not any(np.any(p) for _, p in drives):
        raise InputError(
            "given records in which pressure or output is zero all along; give a response to pressure"
        )
    return _Data(drives, flat, np.ones_like(flat))


def _matrix(drives: list[tuple[np.ndarray, np.ndarray]], rate: np.ndarray) -> np.ndarray:
    """(samples, m): response of elements of compliance 1, one a rate."""
    return np.concatenate([elements(t, p, np.ones_like(rate), rate) for t, p in drives])


def _shares(data: _Data, rate: np.ndarray) -> tuple[np.ndarray, float]:
    """Compliances that fit best, and the norm of what is left."""
    matrix = _matrix(data.drives, rate) * data.weight[:, None]
    size = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    share, left = nnls(matrix / size, data.measured * data.weight)
    return share / size, float(left)


def _search(data: _Data, count: int, start: Mapping[str, float] | None) -> tuple[np.ndarray, np.ndarray]:
    """Compliances and rates of the best of several searches, slowest first."""
    longest = max(float(t[-1] - t[0]) for t, _ in data.drives)
    shortest = min(float(np.min(np.diff(t))) for t, _ in data.drives if t.size > 1)
    decades = np.geomspace(0.3 / longest, 2.0 / shortest, max(count + 1, 7))
    trials = [np.array(c) for c in itertools.combinations(decades, count)]
    trials = sorted(trials, key=lambda rate: _shares(data, rate)[1])[:4]
    if start is not None:
        trials.append(np.sort([start[f"k{i}"] / start[f"eta{i}"] for i in range(1, count + 1)]))
    low, high = math.log(1e-2 / longest), math.log(30.0 / shortest)
    best: tuple[float, np.ndarray] | None = None
    for trial in trials:

        def left(log_rate: np.ndarray) -> np.ndarray:
            rate = np.exp(log_rate)
            share, _ = _shares(data, rate)
            return np.asarray((_matrix(data.drives, rate) @ share - data.measured) * data.weight)

        done = least_squares(
            left, np.clip(np.log(trial), low, high), bounds=(low - 1e-9, high + 1e-9), xtol=1e-10
        )
        if best is None or done.cost < best[0] * (1 - 1e-9):
            best = float(done.cost), np.sort(np.exp(done.x))
    assert best is not None
    share, _ = _shares(data, best[1])
    if np.any(share <= 0):
        kept = int(np.sum(share > 0))
        raise InputError(f"given {count} elements: these records tell {kept} apart; ask for {max(kept, 1)}")
    return _polish(data, share, best[1])


def _residual(data: _Data, logs: np.ndarray) -> np.ndarray:
    """Weighted errors (samples,) at log compliances and log rates."""
    share, rate = np.exp(np.split(logs, 2))
    return np.asarray((_matrix(data.drives, rate) @ share - data.measured) * data.weight)


def _polish(data: _Data, share: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All parameters together, in logs."""
    done = least_squares(lambda x: _residual(data, x), np.log([*share, *rate]), xtol=1e-12, ftol=1e-12)
    share, rate = np.exp(np.split(done.x, 2))
    order = np.argsort(rate)
    return share[order], rate[order]


def _fit(data: _Data, share: np.ndarray, rate: np.ndarray, output: str, source: str) -> Fit:
    """Model with intervals, and the figures of the fit."""
    logs = np.log([*share, *rate])
    spread = _sandwich(data, logs)
    count = share.size
    # k = 1/share, eta = 1/(share rate): logs are sums
    to_k = np.hstack([-np.eye(count), np.zeros((count, count))])
    to_eta = np.hstack([-np.eye(count), -np.eye(count)])
    model = kelvin_voigt(list(1.0 / share), list(1.0 / (share * rate)), output=output, source=source)
    reach = float(student.ppf(0.975, max(data.measured.size - 2 * count, 1)))
    parameters = dict(model.parameters)
    for letter, change in (("k", to_k), ("eta", to_eta)):
        widths = reach * np.sqrt(np.maximum(np.diag(change @ spread @ change.T), 0.0))
        for i, width in enumerate(widths, 1):
            p = parameters[f"{letter}{i}"]
            ends = (p.value * math.exp(-min(width, 50.0)), p.value * math.exp(min(width, 50.0)))
            parameters[f"{letter}{i}"] = replace(p, interval=ends)
    error = _matrix(data.drives, rate) @ share - data.measured
    rmse = float(np.sqrt(np.mean(error**2)))
    low = min(float(p.min()) for _, p in data.drives)
    high = max(float(p.max()) for _, p in data.drives)
    valid = Range((min(low, 0.0),), (max(high, 0.0),), None, source)
    total = float(np.sum((data.measured - data.measured.mean()) ** 2))
    return Fit(
        replace(model, parameters=parameters, valid=valid),
        rmse,
        float(np.max(np.abs(error))),
        1.0 - float(np.sum(error**2)) / total if total > 0 else math.nan,
        float(np.sum((error * data.weight) ** 2)),
    )


def _sandwich(data: _Data, logs: np.ndarray) -> np.ndarray:
    """Covariance (2m, 2m) of the logs."""
    step = 1e-5
    jacobian = np.empty((data.measured.size, logs.size))
    for j in range(logs.size):
        shift = step * np.eye(logs.size)[j]
        jacobian[:, j] = (_residual(data, logs + shift) - _residual(data, logs - shift)) / (2 * step)
    error = _residual(data, logs) / data.weight
    n, m = jacobian.shape
    ends = np.cumsum([time.size for time, _ in data.drives])[:-1]
    errors, scores = np.split(error, ends), np.split(jacobian * data.weight[:, None], ends)
    before = sum(float(e[:-1] @ e[:-1]) for e in errors)
    rho = sum(float(e[1:] @ e[:-1]) for e in errors) / before if before > 0 else 0.0
    rho = min(max(rho + (1 + 3 * rho) / n, 0.0), 0.999)  # the estimate from n samples is that much too low
    meat = np.zeros((m, m))
    for e, score in zip(errors, scores, strict=True):
        both = lfilter([1.0], [1.0, -rho], score, axis=0)
        both = both + lfilter([1.0], [1.0, -rho], score[::-1], axis=0)[::-1] - score
        meat += score.T @ both * float(np.mean(e**2))
    bread = np.linalg.pinv(jacobian.T @ jacobian)
    return np.asarray(bread @ meat @ bread) * n / max(n - m, 1)


def linearity(pressure: np.ndarray, output: np.ndarray) -> tuple[float, float]:
    """(5) looked at: outputs (n,) of n pressures (n,) Pa at one time after the step.

    Returns
    -------
    slope of the line through the origin (least squares), and the largest distance from it, output in SI
    """
    p, y = np.asarray(pressure, float), np.asarray(output, float)
    if p.shape != y.shape or not np.any(p):
        raise InputError(
            "given no pressures other than zero, or not as many outputs; give one output a pressure"
        )
    slope = float(p @ y / (p @ p))
    return slope, float(np.max(np.abs(y - slope * p)))
