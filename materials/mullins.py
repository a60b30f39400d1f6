"""Mullins effect after Ogden and Roxburgh: sigma = eta * sigma of the virgin law, with

    eta = 1 - (1/r) erf[(Wm - W)/(m + beta Wm)],   Wm the largest W ever reached.

R. W. Ogden, D. G. Roxburgh, Proc. R. Soc. A 455 (1999) 2861, eq. 4.9 (beta = 0); beta as in Abaqus
Analysis User's Guide 22.6.1. The law itself comes from the first loading.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.special import erf
from scipy.stats import t as student

from materials.errors import MaterialError
from materials.fitting import predict
from materials.laws import Array, Law
from materials.response import invariants, principal_stretches
from materials.specimen import Specimen


@dataclass(frozen=True)
class Mullins:
    """Parameters of the softening.

    Parameters
    ----------
    r : > 1, dimensionless;  m : Pa, >= 0;  beta : >= 0
    low, high : 95 % intervals of (r, m, beta)
    rmse : of the stress on all rows, Pa
    rmse_without : the same of the virgin law alone, Pa
    """

    r: float
    m: float
    beta: float
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    rmse: float
    rmse_without: float

    def table(self) -> dict[str, object]:
        """As a card stores it."""

        def row(i: int, value: float, scale: float, unit: str) -> dict[str, object]:
            return {
                "value": value / scale,
                "unit": unit,
                "low": self.low[i] / scale,
                "high": self.high[i] / scale,
            }

        return {
            "r": row(0, self.r, 1.0, "1"),
            "m": row(1, self.m, 1e6, "MPa"),
            "beta": row(2, self.beta, 1.0, "1"),
        }


def softening(W: Array, Wm: Array, r: float, m: float, beta: float) -> Array:
    """eta, (n,), for W and the largest W so far, Pa."""
    return 1.0 - erf((Wm - W) / np.maximum(m + beta * Wm, 1e-300)) / r


def fit_mullins(specimen: Specimen, law: Law, parameters: Mapping[str, float]) -> Mullins:
    """Softening of a cyclic test in order of time, given the virgin law.

    Raises MaterialError where the test never unloads, or where unloading lies above first loading.
    """
    l = principal_stretches(specimen.mode, specimen.stretch)
    W = law.energy(*invariants(l), **parameters)
    Wm = np.maximum.accumulate(W)
    virgin = predict(law, dict(parameters), l)
    unloaded = W < 0.98 * Wm
    if unloaded.sum() < 5:
        raise MaterialError(f"{specimen.name}: the test never unloads; Mullins needs a cyclic test")
    ratio = specimen.stress[unloaded] / np.where(virgin[unloaded] != 0, virgin[unloaded], np.nan)
    if np.nanmedian(ratio) > 1.0:
        raise MaterialError(f"{specimen.name}: unloading lies above first loading; no softening to fit")
    top = float(np.max(np.abs(specimen.stress)))
    scale = float(W.max())

    def residual(x: Array) -> Array:
        return (virgin * softening(W, Wm, x[0], x[1] * scale, x[2]) - specimen.stress) / top

    low, high = np.array([1.0 + 1e-6, 1e-6, 0.0]), np.array([1e3, 1e3, 1e2])
    starts = [np.array([r, m, b]) for r in (1.3, 3.0) for m in (0.05, 0.5) for b in (0.05, 0.3)]
    runs = [
        least_squares(residual, s, bounds=(low, high), x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14)
        for s in starts
    ]
    best = min(runs, key=lambda run: run.cost)
    J, r = best.jac, best.fun
    free = max(r.size - 3, 1)
    size = np.where(np.linalg.norm(J, axis=0) > 0, np.linalg.norm(J, axis=0), 1e-300)
    _, s, Vt = np.linalg.svd(J / size, full_matrices=False)
    s = np.maximum(s, 1e-8 * s.max())
    rho = float(np.sum(r[1:] * r[:-1]) / max(float(np.sum(r * r)), 1e-300))
    widening = min((1 + rho) / (1 - rho), r.size / 4) if rho > 2 / math.sqrt(r.size) else 1.0
    cov = (Vt.T / s**2) @ Vt / np.outer(size, size) * (2 * best.cost / free) * widening
    half = float(student.ppf(0.975, free)) * np.sqrt(np.diag(cov))
    unit = np.array([1.0, scale, 1.0])
    a, b = np.maximum(best.x - half, low) * unit, np.minimum(best.x + half, high) * unit
    x = best.x * unit
    return Mullins(
        float(x[0]),
        float(x[1]),
        float(x[2]),
        (float(a[0]), float(a[1]), float(a[2])),
        (float(b[0]), float(b[1]), float(b[2])),
        top * math.sqrt(float(np.mean(r**2))),
        math.sqrt(float(np.mean((virgin - specimen.stress) ** 2))),
    )
