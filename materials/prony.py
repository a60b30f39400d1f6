"""Prony series from relaxation, creep, or any test with times: stress = law, faded.

Quasi-linear viscoelasticity (Y. C. Fung, Biomechanics, 1981, section 7.6; the same series as Abaqus'
g_i, tau_i): with e(t) the stress of the law at the stretch of time t, at once and for ever young,

    sigma(t) = e(t) - sum g_i [e(t) - h_i(t)],   tau_i dh_i/dt + h_i = tau_i de/dt,  h_i(0) = e(0).

The stress is linear in what each branch carries, so with many times tau given it is a non-negative
least-squares problem; the few branches found there are then refined, times included, and as many
kept as the Bayesian information criterion pays for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares, nnls
from scipy.stats import t as student

from materials.errors import MaterialError
from materials.laws import Array

MOST_TERMS = 4
DRAWS = 100


@dataclass(frozen=True)
class Prony:
    """A relaxation series g(t) = 1 - sum g_i (1 - exp(-t/tau_i)).

    Parameters
    ----------
    g : share of the instantaneous modulus that each branch loses, (m,), each > 0, sum < 1
    tau : s, (m,), rising
    g_low, g_high, tau_low, tau_high : 95 % intervals
    instantaneous : modulus at t = 0 over that of the law that the stress was divided by
    rmse : of the stress over its largest
    """

    g: Array
    tau: Array
    g_low: Array
    g_high: Array
    tau_low: Array
    tau_high: Array
    instantaneous: float
    rmse: float

    def relaxation(self, time: Array) -> Array:
        """g(t), from 1 down to 1 - sum g."""
        return 1.0 - np.sum(self.g * (1.0 - np.exp(-np.asarray(time)[:, None] / self.tau)), axis=1)

    def table(self) -> list[dict[str, object]]:
        """As a card stores it."""
        rows = zip(self.g, self.g_low, self.g_high, self.tau, self.tau_low, self.tau_high, strict=True)
        return [
            {
                "g": float(g),
                "low": float(a),
                "high": float(b),
                "tau": f"{t:.6g} s",
                "tau_low": f"{c:.6g} s",
                "tau_high": f"{d:.6g} s",
            }
            for g, a, b, t, c, d in rows
        ]


def branch(elastic: Array, time: Array, tau: float) -> Array:
    """h(t) of one branch, (n,): the elastic stress (n,) at times (n,), straight in between."""
    h = np.empty_like(elastic)
    h[0] = elastic[0]
    x = np.diff(time) / tau
    decay = np.exp(-x)
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = np.where(x > 1e-8, -np.expm1(-x) / np.where(x > 0, x, 1.0), 1.0 - 0.5 * x)
    rise = np.diff(elastic) * gain
    for i in range(x.size):
        h[i + 1] = decay[i] * h[i] + rise[i]
    return h


def fit_prony(time: Array, stress: Array, elastic: Array | None = None) -> Prony:
    """Series through `stress`.

    Parameters
    ----------
    time : s, (n,), rising; stress : Pa, (n,)
    elastic : stress of the law at the stretches, Pa, (n,), of any scale; None: the stretch was put on at
        once at time[0] and held (then start the record after the ramp, or give the ramp's stretches)

    Raises
    ------
    MaterialError : fewer than 12 rows, times that do not rise, or a stress that does not relax
    """
    time, stress = np.asarray(time, float), np.asarray(stress, float)
    if time.size < 12:
        raise MaterialError(f"relaxation: {time.size} rows; at least 12 are needed for a Prony series")
    if np.any(np.diff(time) < 0) or time[-1] <= time[0]:
        raise MaterialError("relaxation: the times do not rise; sort the rows")
    keep = np.concatenate([[True], np.diff(time) > 0])
    time, stress = time[keep] - time[0], stress[keep]
    e = np.ones_like(stress) if elastic is None else np.asarray(elastic, float)[keep]
    top = float(np.max(np.abs(stress)))
    if top == 0.0 or float(np.max(np.abs(e))) == 0.0:
        raise MaterialError("relaxation: the stress is zero all along")
    e = e / float(np.max(np.abs(e)))
    y = stress / top
    shortest = max(float(np.median(np.diff(time))), time[-1] / 1e5)
    grid = np.geomspace(0.5 * shortest, time[-1], max(8, 4 * round(math.log10(time[-1] / shortest))))
    A = np.column_stack([e] + [branch(e, time, tau) for tau in grid])
    c, _ = nnls(A, y)
    groups = _groups(c[1:], grid)
    if not groups:
        raise MaterialError(
            "relaxation: the stress does not relax; no Prony series can be told from this test"
        )
    best: tuple[float, Array, Array, Array] | None = None
    for m in range(1, min(MOST_TERMS, len(groups)) + 1):
        x, J, r = _refine(time, y, e, float(c[0]), sorted(groups, reverse=True)[:m])
        bic = y.size * math.log(max(float(np.mean(r**2)), 1e-30)) + (2 * m + 1) * math.log(y.size)
        if best is None or bic < best[0] - 2.0:
            best = bic, x, J, r
    assert best is not None
    return _finish(*best[1:])


def _groups(c: Array, grid: Array) -> list[tuple[float, float]]:
    """(weight, time) of the runs of neighbouring non-zero coefficients."""
    out: list[tuple[float, float]] = []
    run: list[int] = []
    for i in [*range(c.size), -1]:
        if i >= 0 and c[i] > 1e-6:
            run.append(i)
            continue
        if run:
            w = c[run]
            out.append((float(w.sum()), float(np.exp(np.sum(w * np.log(grid[run])) / w.sum()))))
            run = []
    return out


def _refine(
    time: Array, y: Array, e: Array, rest: float, groups: list[tuple[float, float]]
) -> tuple[Array, Array, Array]:
    """Variables (c_0, c_1.., ln tau_1..), their Jacobian and the residual."""
    m = len(groups)

    def residual(x: Array) -> Array:
        model = x[0] * e
        for k in range(m):
            model = model + x[1 + k] * branch(e, time, math.exp(min(max(x[1 + m + k], -60.0), 60.0)))
        return model - y

    x0 = np.array([max(rest, 1e-6)] + [g for g, _ in groups] + [math.log(t) for _, t in groups])
    span = math.log(time[-1])
    low = np.array([0.0] * (m + 1) + [math.log(max(float(np.min(np.diff(time))), 1e-9)) - 3.0] * m)
    high = np.array([np.inf] * (m + 1) + [span + 2.0] * m)
    out = least_squares(
        residual,
        np.clip(x0, low + 1e-9, high - 1e-9),
        bounds=(low, high),
        x_scale="jac",
        xtol=1e-12,
        ftol=1e-12,
        gtol=1e-12,
    )
    return out.x, out.jac, out.fun


def _finish(x: Array, J: Array, r: Array) -> Prony:
    m = (x.size - 1) // 2
    total = float(np.sum(x[: m + 1]))
    free = max(r.size - x.size, 1)
    rho = float(np.sum(r[1:] * r[:-1]) / max(float(np.sum(r * r)), 1e-300))
    widening = (1.0 + rho) / (1.0 - rho) if rho > 2.0 / math.sqrt(r.size) else 1.0
    size = np.linalg.norm(J, axis=0)
    size = np.where(size > 0, size, 1e-300)
    _, s, Vt = np.linalg.svd(J / size, full_matrices=False)
    s = np.maximum(s, 1e-8 * s.max())
    cov = (
        (Vt.T / s**2)
        @ Vt
        / np.outer(size, size)
        * float(np.sum(r**2))
        / free
        * min(widening, r.size / x.size)
    )
    q = float(student.ppf(0.975, free))
    g = x[1 : m + 1] / total
    G = np.zeros((m, x.size))
    for k in range(m):
        G[k, : m + 1] = -g[k] / total
        G[k, 1 + k] += 1.0 / total
    sd_g = np.sqrt(np.maximum(np.einsum("ki,ij,kj->k", G, cov, G), 0.0))
    sd_t = np.sqrt(np.maximum(np.diag(cov)[m + 1 :], 0.0))
    tau = np.exp(x[m + 1 :])
    order = np.argsort(tau)
    far = np.exp(np.minimum(q * sd_t, 50.0))
    return Prony(
        g[order],
        tau[order],
        (g - q * sd_g)[order],
        (g + q * sd_g)[order],
        (tau / far)[order],
        (tau * far)[order],
        total,
        math.sqrt(float(np.mean(r**2))),
    )


def from_creep(compliance: Prony) -> tuple[Array, Array]:
    """(g, tau) of the relaxation that belongs to a creep series J(t)/J(0) = 1 + sum j_i (1 - exp(-t/l_i)).

    `compliance.g` holds the j_i (of any size), `compliance.tau` the l_i. Exact for linear
    viscoelasticity: G(s) J(s) = 1 in Carson's transform (J. D. Ferry, Viscoelastic Properties of
    Polymers, 1980, section 3.B).
    """
    j, l = np.asarray(compliance.g), np.asarray(compliance.tau)
    # J(s) = 1 + sum j_i/(1 + s l_i); its zeros s = -1/tau_i are the relaxation's poles.
    denominator = np.poly1d([1.0])
    for value in l:
        denominator = denominator * np.poly1d([value, 1.0])
    numerator = denominator * 1.0
    for i, value in enumerate(j):
        part = np.poly1d([1.0])
        for k, other in enumerate(l):
            if k != i:
                part = part * np.poly1d([other, 1.0])
        numerator = numerator + value * part
    poles = np.sort(np.real(numerator.roots))
    tau = -1.0 / poles
    slope = numerator.deriv()
    # G(s) = D/N = 1 - sum g_i/(1 + s tau_i); the residue R of D/N at the pole gives g_i = -R tau_i.
    g = np.array([-denominator(p) / slope(p) * t for p, t in zip(poles, tau, strict=True)])
    order = np.argsort(tau)
    return g[order], tau[order]


def fit_creep(time: Array, strain: Array) -> Prony:
    """The relaxation series that belongs to creep at a load held from time[0].

    Its 95 % intervals are from a parametric bootstrap: `DRAWS` records of the fitted creep with white noise
    of the residual's size, each fitted and turned into relaxation in the same way.

    Parameters
    ----------
    time : s, (n,), rising; strain : (n,), of one sign, at small or moderate strain (linear viscoelasticity)
    """
    time, strain = np.asarray(time, float), np.abs(np.asarray(strain, float))
    if strain.size < 12 or strain[0] <= 0:
        raise MaterialError(
            f"creep: {strain.size} rows from strain {strain[:1]}; at least 12 from a loaded start are needed"
        )
    series = _creep_series(time, strain)
    g, tau = from_creep(series)
    since = (time - time[0])[:, None]
    smooth = series.instantaneous * (1.0 + np.sum(series.g * (1.0 - np.exp(-since / series.tau)), axis=1))
    noise = float(np.std(strain - smooth))
    rng = np.random.default_rng(0)
    drawn = []
    for _ in range(DRAWS):
        try:
            other = from_creep(_creep_series(time, smooth + noise * rng.standard_normal(time.size)))
        except MaterialError:
            continue
        if other[0].size == g.size:
            drawn.append(np.concatenate([other[0] - g, np.log(other[1] / tau)]))
    # basic, not percentile: what a draw misses the fit by is what the fit misses the truth by
    enough = len(drawn) >= DRAWS // 2
    low, high = np.quantile(drawn, [0.025, 0.975], axis=0) if enough else np.full((2, 2 * g.size), math.nan)
    m = g.size
    return Prony(
        g, tau, g - high[:m], g - low[:m], tau * np.exp(-high[m:]), tau * np.exp(-low[m:]), 1.0, series.rmse
    )


def _creep_series(time: Array, strain: Array) -> Prony:
    """J(t)/J(0) = 1 + sum g (1 - exp(-t/tau)), `instantaneous` the strain at time[0]."""
    # J(t) = (J0 + sum j) - sum j exp(-t/l): the constant less a decaying series; flip it to one that relaxes.
    end = 1.5 * float(np.max(strain))
    flipped = fit_prony(time, end - strain)
    top = flipped.instantaneous * float(np.max(end - strain))
    start = end - top
    ratio = top / start
    return Prony(
        flipped.g * ratio,
        flipped.tau,
        flipped.g_low * ratio,
        flipped.g_high * ratio,
        flipped.tau_low,
        flipped.tau_high,
        start,
        flipped.rmse,
    )
