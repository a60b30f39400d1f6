"""Inverse of an increasing function for many values at once, and a smooth function at very many."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def solve_increasing(
    function: Callable[[np.ndarray], np.ndarray],
    slope: Callable[[np.ndarray], np.ndarray],
    target: np.ndarray,
    low: float,
    high: float,
    start: np.ndarray,
) -> np.ndarray:
    """x with function(x) = target between low and high; at the end where the target lies beyond it.

    Newton's steps, bisection where one leaves the bracket; equal targets are solved once.

    Parameters
    ----------
    function, slope : of an array (n,), elementwise; `function` increases
    target, start : any shape, first guesses of the same shape
    """
    shape = np.shape(target)
    goals, first, back = np.unique(np.ravel(target), return_index=True, return_inverse=True)
    x = np.clip(np.ravel(start)[first], low, high)
    left, right = np.full(goals.shape, float(low)), np.full(goals.shape, float(high))
    with np.errstate(all="ignore"):
        for _ in range(100):
            error = function(x) - goals
            left, right = np.where(error <= 0, x, left), np.where(error >= 0, x, right)
            new = x - error / slope(x)
            new = np.where((new >= left) & (new <= right), new, 0.5 * (left + right))
            done = np.abs(new - x) <= 1e-13 * np.maximum(np.abs(x), 1e-3 * (high - low))
            x = np.where(error == 0, x, new)
            if done.all():
                break
    return x[np.ravel(back)].reshape(shape)


def smooth(function: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> np.ndarray:
    """function(x) for x of any shape; where x has more than 200 entries, through Chebyshev's interpolation.

    Degree 64 between the smallest and largest x: 1e-9 of the finger's largest values and better.
    """
    low, high = float(np.min(x)), float(np.max(x))
    if np.size(x) <= 200 or not high > low:
        return function(x)
    series = np.polynomial.Chebyshev.interpolate(function, 64, domain=[low, high])
    return np.asarray(series(x))
