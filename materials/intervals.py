"""How well the tests know the parameters: 95 % intervals, correlations, and what they cannot tell apart.

Two ways, and the outcome says which: with five or more specimens in every mode, a bootstrap over
specimens (they are drawn with replacement, the scatter between them speaks for itself); else the
profile of the sum of squares, S(theta) <= S_min (1 + t^2 c^2/(n - p)) (D. M. Bates, D. G. Watts,
Nonlinear Regression Analysis, 1988, section 6.1), which for a law linear in its parameters is the
t-interval exactly. Residuals that follow each other (a law that is not quite right) are not n
independent ones: c^2 = (1 + rho)/(1 - rho) of the lag-one correlation rho, where rho is significant.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from materials.fitting import Data, Fit, fit, predict, predict_by_parameter
from materials.laws import Array

LEVEL = 0.95
FEWEST_SPECIMENS = 5
DRAWS = 300


@dataclass(frozen=True)
class Uncertainty:
    """What a fit's tests say of its parameters.

    Parameters
    ----------
    intervals : free parameter -> (low, high), 95 %
    method : "profile" or "bootstrap over N specimens"
    covariance : of the free parameters, SI, (n_free, n_free)
    correlation : (n_free, n_free)
    widening : the factor c for residuals that follow each other, 1 where they do not
    quantile : of Student's t that goes with the covariance
    """

    intervals: dict[str, tuple[float, float]]
    method: str
    covariance: Array
    correlation: Array
    widening: float
    quantile: float

    def band(self, fitted: Fit, stretches: Array) -> Array:
        """Half width of the 95 % band of the mean nominal stress, Pa, (n,), at stretches (3, n)."""
        J = predict_by_parameter(fitted.variant, fitted.parameters, stretches)
        return self.quantile * np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", J, self.covariance, J), 0.0))


def uncertainty(fitted: Fit, data: Data, profile: bool = True) -> Uncertainty:
    """Intervals and correlations of `fitted`.

    profile : False takes the symmetric interval of the linearized law (fast)
    """
    n, p = data.stress.size, len(fitted.values)
    freedom = max(n - p, 1)
    widening = _widening(fitted, data)
    normal = _inverse(fitted.jacobian)
    covariance = normal * (fitted.cost / freedom) * widening**2
    quantile = float(student.ppf(0.5 + LEVEL / 2, freedom))
    per_mode = [len(set(data.specimen[data.mode == m].tolist())) for m in set(data.mode.tolist())]
    if min(per_mode) >= FEWEST_SPECIMENS:
        count = len(set(data.specimen.tolist()))
        covariance = _bootstrap(fitted, data)
        quantile = float(student.ppf(0.5 + LEVEL / 2, min(per_mode) - 1))
        half = quantile * np.sqrt(np.diag(covariance))
        method = f"bootstrap over {count} specimens"
        bounds = [(v - h, v + h) for v, h in zip(fitted.values, half, strict=True)]
        widening = 1.0
    else:
        method = "profile"
        half = quantile * np.sqrt(np.diag(covariance))
        if profile and not fitted.variant.law.linear and fitted.cost > 1e-18 * n:
            allowed = fitted.cost / freedom * (quantile * widening) ** 2
            bounds = [_profile(fitted, data, j, float(half[j]), allowed) for j in range(p)]
        else:
            bounds = [(v - h, v + h) for v, h in zip(fitted.values, half, strict=True)]
    sd = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = np.where(sd[:, None] * sd > 0, covariance / np.outer(sd, sd), np.eye(p))
    names = fitted.variant.free
    return Uncertainty(
        {k: (float(a), float(b)) for k, (a, b) in zip(names, bounds, strict=True)},
        method,
        covariance,
        correlation,
        widening,
        quantile,
    )


def _inverse(J: Array) -> Array:
    """(J^T J)^-1 after scaling of the columns; directions that the tests do not see get a huge variance."""
    scale = np.linalg.norm(J, axis=0)
    scale = np.where(scale > 0, scale, 1e-300)
    _, s, Vt = np.linalg.svd(J / scale, full_matrices=False)
    s = np.maximum(s, 1e-10 * s.max())
    inverse = (Vt.T / s**2) @ Vt
    return inverse / np.outer(scale, scale)


def _widening(fitted: Fit, data: Data) -> float:
    top, bottom, pairs = 0.0, 0.0, 0
    for k in set(data.specimen.tolist()):
        index = np.flatnonzero(data.specimen == k)
        r = fitted.residual[index[np.argsort(data.stretches[0, index], kind="stable")]]
        top += float(np.sum(r[1:] * r[:-1]))
        bottom += float(np.sum(r * r))
        pairs += r.size - 1
    if pairs < 8 or bottom == 0.0 or top / bottom < 2.0 / math.sqrt(pairs):
        return 1.0
    rho = min(top / bottom, 0.999)
    most = math.sqrt(data.stress.size / (len(fitted.values) + 1.0))
    return max(1.0, min(math.sqrt((1.0 + rho) / (1.0 - rho)), most))


def _bootstrap(fitted: Fit, data: Data) -> Array:
    """Covariance of the free parameters over draws of specimens, within each mode, with replacement."""
    rng = np.random.default_rng(0)
    groups = [sorted(set(data.specimen[data.mode == m].tolist())) for m in sorted(set(data.mode.tolist()))]
    rows = {k: np.flatnonzero(data.specimen == k) for group in groups for k in group}
    draws = DRAWS if fitted.variant.law.linear else DRAWS // 3
    values = []
    for _ in range(draws):
        drawn = [rng.choice(group, len(group)) for group in groups]
        index = np.concatenate([rows[k] for group in drawn for k in group.tolist()])
        sample = data.pick(index)
        values.append(
            fit(fitted.variant, sample, start=[fitted.values], reach=data.reach, thorough=False).values
        )
    m = min(len(group) for group in groups)
    return np.atleast_2d(np.cov(np.array(values).T)) * m / (m - 1)


def _profile(fitted: Fit, data: Data, j: int, half: float, allowed: float) -> tuple[float, float]:
    """Where the sum of squares, minimized over the other parameters, has grown by `allowed`."""
    law, variant = fitted.variant.law, fitted.variant
    name = variant.free[j]
    low, high = law.limits.get(name, (-math.inf, math.inf))
    others = [k for k in range(len(variant.free)) if k != j]
    size = np.where(fitted.values != 0, np.abs(fitted.values), 1.0)
    limits = [law.limits.get(variant.free[k], (-math.inf, math.inf)) for k in others]
    lows, highs = np.array([a for a, _ in limits]), np.array([b for _, b in limits])
    state = {"x": fitted.values[others] / size[others]}

    def root(cost: float) -> float:
        return math.sqrt(max(cost - fitted.cost, 0.0) / allowed) - 1.0

    def grown(value: float) -> float:
        """sqrt of the growth over `allowed`, less one: nearly straight in `value`."""

        def full(x: Array) -> Array:
            v = fitted.values.copy()
            v[j] = value
            v[others] = np.clip(x * size[others], lows, highs)
            return v

        def residual(x: Array) -> Array:
            r = data.weight * (predict(law, variant.full(full(x)), data.stretches) - data.stress)
            return np.clip(np.where(np.isfinite(r), r, 1e3), -1e3, 1e3)

        def jacobian(x: Array) -> Array:
            J = predict_by_parameter(variant, variant.full(full(x)), data.stretches)[:, others]
            J = J * data.weight[:, None] * size[others]
            return np.where(np.isfinite(J), J, 0.0)

        if not others:
            return root(float(np.sum(residual(state["x"]) ** 2)))
        out = least_squares(
            residual, state["x"], jac=jacobian, x_scale="jac", max_nfev=60, ftol=1e-10, xtol=1e-10
        )
        if 2.0 * out.cost < allowed + fitted.cost:
            state["x"] = out.x
        return root(float(2.0 * out.cost))

    ends = []
    for sign, limit in ((-1.0, low), (1.0, high)):
        state["x"] = fitted.values[others] / size[others]
        ends.append(_crossing(grown, float(fitted.values[j]), sign * max(half, 1e-9 * float(size[j])), limit))
    return ends[0], ends[1]


def _crossing(grown: Callable[[float], float], centre: float, step: float, limit: float) -> float:
    """The first value from `centre` in the direction of `step` at which `grown` is zero, or `limit`.

    No further than some 100 of the linearized half widths: there the interval is as good as open.
    """
    inside, f_inside = centre, -1.0
    outside, f_outside = math.nan, math.nan
    sign = math.copysign(1.0, step)
    step *= 0.25
    for _ in range(12):
        value = centre + step
        if sign * value >= sign * limit:
            value = limit
        f = grown(value)
        if f >= 0:
            outside, f_outside = value, f
            break
        if value == limit:
            return limit
        inside, f_inside = value, f
        step *= 1.6
    if math.isnan(outside):
        return inside
    for _ in range(12):
        if abs(outside - inside) <= 1e-3 * abs(outside - centre):
            break
        share = min(max(f_inside / (f_inside - f_outside), 0.1), 0.9)
        value = inside + share * (outside - inside)
        f = grown(value)
        if f >= 0:
            outside, f_outside = value, f
        else:
            inside, f_inside = value, f
    return inside + (outside - inside) * f_inside / (f_inside - f_outside)
