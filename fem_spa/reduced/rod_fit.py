"""The arm's gains and damping from measured tips: the constrained least squares of (35).

    min over gamma, lambda_t, lambda_r of  sum over records of  1/|D_i| sum over time of |e|^2,
    e = measured - model,
    gamma_1 <= gamma_3,  gamma_2 <= gamma_3,  2 gamma_1 <= gamma_2 + gamma_3,
    0.9 <= gamma_i <= 1.2,  0 <= lambda_t <= 2000 1/s,  0 <= lambda_r <= 0.01 m^2/s.

The paper follows the cost alone (trust region, difference gradient, BFGS). Here the errors themselves are
differenced: Gauss-Newton with Levenberg's damping, each step a small quadratic problem under the same
bounds and constraints. Rates go by their logarithm, for a rate that is ten times off is as wrong as one
that is ten times too small.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_spa.errors import InputError
from fem_spa.reduced.model import Drive, Parameter
from fem_spa.reduced.rod import Rod

GAINS = ("strain_gain_1", "strain_gain_2", "strain_gain_3")
RATES = ("translational_damping", "rotational_damping")
PAPER_BOUNDS: dict[str, tuple[float, float]] = {
    **dict.fromkeys(GAINS, (0.9, 1.2)),
    "translational_damping": (1.0, 2e3),
    "rotational_damping": (1e-8, 1e-2),
}
"""(35); the zero of a rate is 1 1/s and 1e-8 m^2/s here, below which the loop has nothing to see."""
PAPER_START = {**dict.fromkeys(GAINS, 1.0), "translational_damping": 1e3, "rotational_damping": 1e-3}
PAPER_CONSTRAINTS = (
    {"strain_gain_1": 1.0, "strain_gain_3": -1.0},
    {"strain_gain_2": 1.0, "strain_gain_3": -1.0},
    {"strain_gain_1": 2.0, "strain_gain_2": -1.0, "strain_gain_3": -1.0},
)
"""Each a row of coefficients; their sum with the values is at most zero."""
MOST = 30
UNSEEN = 1e-7
"""A parameter that moves the errors less than this share (squared) stays where it is."""
NORMAL = 1.96


@dataclass(frozen=True)
class RodFit:
    """A fitted rod.

    Attributes
    ----------
    model : with the fitted values and their 95 % intervals (None where the records do not see the parameter)
    cost : of (35) before and after, m^2
    rmse : of the tip, m, over all records alike
    iterations : accepted steps;  runs : simulations of all records
    """

    model: Rod
    cost: tuple[float, float]
    rmse: float
    iterations: int
    runs: int


def fit_rod(
    model: Rod,
    records: Sequence[tuple[Drive, np.ndarray]],
    start: Mapping[str, float] | None = None,
    bounds: Mapping[str, tuple[float, float]] = PAPER_BOUNDS,
    constraints: Sequence[Mapping[str, float]] = PAPER_CONSTRAINTS,
    most: int = MOST,
) -> RodFit:
    """Fit the parameters that `bounds` names.

    Parameters
    ----------
    records : (drive, measured tip (n, 3) in m) each
    start : name -> value to begin with, SI; default: the model's, moved inside the bounds
    bounds : name -> (low, high), SI
    constraints : rows of coefficients whose sum with the values is at most zero; of fitted parameters only
    most : iterations at most

    Raises
    ------
    InputError : no records, shapes that differ, or an unknown name
    """
    if not records:
        raise InputError("given no records; at least one is needed to fit a rod")
    for drive, tip in records:
        if np.shape(tip) != (len(drive.time), 3) or not np.all(np.isfinite(tip)):
            raise InputError(
                f"given tips of shape {np.shape(tip)}: x, y, z at {len(drive.time)} times are needed"
            )
    names = list(bounds)
    missing = [n for n in names if n not in model.parameters]
    if missing:
        raise InputError(f"given {missing[0]}: the rod has no such parameter")
    run = _Residual(model, records, bounds)
    low, high = (run.inner(np.array([bounds[n][end] for n in names])) for end in (0, 1))
    begin = {n: p.value for n, p in model.parameters.items()} | dict(start or {})
    x = np.clip(run.inner(np.maximum([begin[n] for n in names], 1e-300)), low, high)
    rows = np.array([[c.get(n, 0.0) for n in names] for c in constraints]).reshape(-1, len(names))
    if np.any(rows[:, run.log]):
        raise InputError("given a constraint on a rate; constraints are of gains")
    x = nearest_allowed(x, np.eye(len(x)), rows, low, high)
    r = run(x)
    first = cost = float(r @ r)
    damping, accepted = 1e-3, 0
    J = run.jacobian(x, r, low, high)
    for _ in range(most):
        H = J.T @ J
        H += damping * np.diag(np.diag(H)) + UNSEEN * np.trace(H) * np.eye(len(x))
        y = nearest_allowed(x - np.linalg.solve(H, J.T @ r), H, rows, low, high)
        trial = run(y)
        if trial @ trial < cost:
            gain = 1 - float(trial @ trial) / cost
            moved = float(np.abs(y - x).max())
            x, r, cost = y, trial, float(trial @ trial)
            damping, accepted = max(damping / 5, 1e-9), accepted + 1
            if gain < 1e-5 or moved < 1e-6:
                break
            J = run.jacobian(x, r, low, high)
        else:
            damping *= 8
            if damping > 1e6 or np.abs(y - x).max() < 1e-9:
                break
    values = dict(zip(names, run.outer(x), strict=True))
    fitted = model.with_values(**values)
    return RodFit(
        replace(fitted, parameters=_with_intervals(fitted, names, run, x, r, low, high)),
        (first, cost),
        float(np.sqrt(np.mean(np.concatenate([e.ravel() ** 2 for e in run.errors(x)])) * 3)),
        accepted,
        run.runs,
    )


class _Residual:
    """Errors of all records, weighted as in (35), over the inner variables (logarithms of rates)."""

    def __init__(
        self,
        model: Rod,
        records: Sequence[tuple[Drive, np.ndarray]],
        bounds: Mapping[str, tuple[float, float]],
    ) -> None:
        names = list(bounds)
        self.model, self.records, self.names = model, records, names
        self.ends = np.array([bounds[n] for n in names]).T
        self.log = np.array([n in RATES for n in names])
        self.runs = 0

    def inner(self, values: np.ndarray) -> np.ndarray:
        return np.where(self.log, np.log(np.maximum(values, 1e-300)), values)

    def outer(self, x: np.ndarray) -> np.ndarray:
        return np.clip(np.where(self.log, np.exp(np.where(self.log, x, 0.0)), x), *self.ends)

    def errors(self, x: np.ndarray) -> list[np.ndarray]:
        self.runs += 1
        model = self.model.with_values(**dict(zip(self.names, map(float, self.outer(x)), strict=True)))
        return [tip - model.simulate(drive) for drive, tip in self.records]

    def __call__(self, x: np.ndarray) -> np.ndarray:
        return np.concatenate([e.ravel() / np.sqrt(len(e)) for e in self.errors(x)])

    def jacobian(self, x: np.ndarray, r: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """(rows, variables) by differences that stay within the bounds."""
        J = np.empty((len(r), len(x)))
        for j in range(len(x)):
            h = 0.02 if self.log[j] else 1e-3
            h = h if x[j] + h <= high[j] else -h
            y = x.copy()
            y[j] += h
            J[:, j] = (self(y) - r) / h
        return J


def nearest_allowed(
    aim: np.ndarray, H: np.ndarray, rows: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """The point y of least (y - aim) H (y - aim) with low <= y <= high and rows y <= 0.

    Least distance programming by non-negative least squares (Lawson and Hanson, 1974, chapter 23).
    InputError where no point is allowed.
    """
    from scipy.optimize import nnls

    eye = np.eye(len(aim))
    A = np.vstack([rows, eye, -eye])
    h = A @ aim - np.concatenate([np.zeros(len(rows)), high, -low])
    if np.all(h <= 0):
        return aim
    L = np.linalg.cholesky(H)
    E = np.vstack([-np.linalg.solve(L, A.T), h])
    f = np.append(np.zeros(len(aim)), 1.0)
    u, left = nnls(E, f)
    if left < 1e-10:
        raise InputError("no point meets all bounds and constraints; widen the bounds")
    rest = E @ u - f
    return np.clip(aim - np.linalg.solve(L.T, rest[:-1]) / rest[-1], low, high)


def _with_intervals(
    fitted: Rod,
    names: list[str],
    run: _Residual,
    x: np.ndarray,
    r: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
) -> dict[str, Parameter]:
    """Parameters with 95 % intervals of the linearised fit; errors in succession count as kin, AR(1)."""
    J = run.jacobian(x, r, low, high)
    lag = float(np.clip(r[3:] @ r[:-3] / max(r @ r, 1e-300), 0.0, 0.999))
    number = max(len(r) * (1 - lag) / (1 + lag), len(x) + 1.0)
    H = J.T @ J
    seen = np.diag(H) > UNSEEN * np.trace(H)
    spread = np.full(len(x), np.inf)
    covariance = np.linalg.pinv(H[np.ix_(seen, seen)]) * (r @ r) / max(number - seen.sum(), 1.0)
    spread[seen] = NORMAL * np.sqrt(np.diag(covariance))
    result = dict(fitted.parameters)
    ends = [run.outer(np.clip(x + side * spread, low, high)) for side in (-1, 1)]
    for j, name in enumerate(names):
        wide = not np.isfinite(spread[j])
        interval = None if wide else (float(ends[0][j]), float(ends[1][j]))
        result[name] = replace(result[name], interval=interval, source="fitted to records by (35)")
    return result
