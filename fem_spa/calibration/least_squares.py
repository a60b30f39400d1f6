"""What a least-squares fit says of its parameters: 95 % intervals, correlation, how many samples count.

Neighbouring samples of a record err alike, so n samples count as n_eff = n (1 - r) / (1 + r) with r the
lag-one correlation of the residuals of one run (an autoregressive error; Bayley and Hammersley, Suppl. J. R.
Stat. Soc. 8, 1946). The covariance is s^2 (J^T J)^-1 n / n_eff, the interval Student's t with n_eff - k
degrees of freedom (Seber and Wild, Nonlinear Regression, 1989, 5.1).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Spread:
    """covariance : (k, k) of the working parameters;  half : (k,) half widths of their 95 % intervals
    correlation : (k, k);  samples, effective : how many samples there are, and how many count
    """

    covariance: np.ndarray
    half: np.ndarray
    correlation: np.ndarray
    samples: int
    effective: float


def systematic(told: Spread | None, error: float, span: float) -> list[str]:
    """A sentence where what remains (RMSE `error` of the fit) is no noise: neighbours err alike, and much.

    Then the intervals are those of a model that lacks something.
    """
    if told is None or told.samples < 12 or span <= 0:
        return []
    if told.effective > 0.2 * told.samples or error < 0.01 * span:
        return []
    return [
        f"what remains ({100 * error / span:.2g} % of the range) is no noise, neighbours err alike: "
        "the model lacks something, and the intervals are wide for that; fem-spa diagnose tells what"
    ]


def spread(jacobian: np.ndarray, residual: np.ndarray, parts: Sequence[int]) -> Spread:
    """Spread of the parameters of a fit.

    Parameters
    ----------
    jacobian : (n, k), of the residual to the working parameters;  residual : (n,)
    parts : lengths of the pieces of the residual that are each one output of one run, in order
    """
    n, k = jacobian.shape
    effective = max(effective_samples(residual, parts, k), k + 1.0)
    freedom = effective - k
    variance = float(residual @ residual) / (n * freedom / effective)
    information = jacobian.T @ jacobian
    scale = np.sqrt(np.diag(information))
    blind = scale == 0.0
    scale[blind] = 1.0
    normal = information / np.outer(scale, scale)
    inverse = np.linalg.pinv(normal, rcond=1e-12, hermitian=True) / np.outer(scale, scale)
    covariance = variance * n / effective * inverse
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    seen = normal[~blind][:, ~blind]
    mixed = seen.size > 0 and np.linalg.matrix_rank(seen, tol=1e-10, hermitian=True) < len(seen)
    half = np.where(blind | mixed, math.inf, student(freedom) * deviation)
    size = np.where(deviation > 0, deviation, 1.0)
    return Spread(covariance, half, covariance / np.outer(size, size), n, effective)


def effective_samples(residual: np.ndarray, parts: Sequence[int], k: int = 1) -> float:
    """How many independent samples the pieces of a residual are worth, where k numbers were fitted."""
    total, start = 0.0, 0
    for count in parts:
        piece = residual[start : start + count]
        start += count
        if count < 4 or not np.any(piece):
            total += count
            continue
        r = float(piece[1:] @ piece[:-1]) / float(piece @ piece)
        r += (k + (k + 2) * r) / count  # its bias in a short fitted series (Kendall, Biometrika 41, 1954)
        r = min(max(r, 0.0), 1.0 - 2.0 / count)
        total += count * (1.0 - r) / (1.0 + r)
    return total


def student(freedom: float) -> float:
    """The factor of a 95 % interval."""
    from scipy.stats import t

    return float(t.ppf(0.975, max(freedom, 1.0)))
