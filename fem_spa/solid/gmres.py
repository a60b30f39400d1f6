"""GMRES without restart, preconditioned on the right (Saad and Schultz 1986, SIAM J Sci Stat Comput 7)."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

Apply = Callable[[np.ndarray], np.ndarray]


class Iterated(NamedTuple):
    """solution : (n,);  iterations;  residual : |b - A x| / |b|, inf or nan where numbers ended"""

    solution: np.ndarray
    iterations: int
    residual: float


def gmres(product: Apply, precondition: Apply, b: np.ndarray, accuracy: float, most: int) -> Iterated:
    """Solve A x = b until the residual is `accuracy` of b, or for `most` iterations: the caller looks at it.

    Parameters
    ----------
    product : v -> A v;  precondition : v -> an approximation of A^-1 v;  both (n,) -> a new (n,)
    """
    norm = float(np.linalg.norm(b))
    if norm == 0.0:
        return Iterated(np.zeros_like(b), 0, 0.0)
    basis, directions = [b / norm], []
    small = np.zeros((most + 1, most))
    y: np.ndarray = np.zeros(0)
    residual = 1.0
    for j in range(most):
        direction = precondition(basis[j])
        w = product(direction)
        for _ in range(2):  # orthogonal twice, as rounding wants it
            for i, v in enumerate(basis):
                part = w @ v
                small[i, j] += part
                w -= part * v
        small[j + 1, j] = length = float(np.linalg.norm(w))
        if not np.isfinite(length):
            residual = np.inf
            break
        directions.append(direction)
        right = np.zeros(j + 2)
        right[0] = norm
        y = np.linalg.lstsq(small[: j + 2, : j + 1], right, rcond=None)[0]
        residual = float(np.linalg.norm(small[: j + 2, : j + 1] @ y - right)) / norm
        if residual <= accuracy or length == 0.0:
            break
        basis.append(w / length)
    solution = sum((c * z for c, z in zip(y, directions, strict=True)), start=np.zeros_like(b))
    return Iterated(solution, len(directions), residual)
