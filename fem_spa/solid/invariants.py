"""Principal stretches from invariants."""

from __future__ import annotations

import numpy as np


def principal_values(I1: np.ndarray, I2: np.ndarray) -> np.ndarray:
    """Eigenvalues of the isochoric C, largest first: the roots of x^3 - I1 x^2 + I2 x - 1, shape (3, ...)."""
    mean = I1 / 3
    q = np.sqrt(np.maximum(mean**2 - I2 / 3, 0.0))
    # r = det(C - mean) / 2 of the matrix whose invariants these are
    r = mean**3 - mean * I2 / 2 + 0.5
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = np.where(q > 0, r / q**3, 1.0)
    third = np.arccos(np.clip(cosine, -1, 1)) / 3
    return np.stack([mean + 2 * q * np.cos(third - k * 2 * np.pi / 3) for k in (0, 1, 2)])


def stretches(J: np.ndarray, I1: np.ndarray, I2: np.ndarray) -> np.ndarray:
    """Largest principal stretch from J and the isochoric invariants."""
    return np.cbrt(J) * np.sqrt(np.maximum(principal_values(I1, I2)[0], 0.0))
