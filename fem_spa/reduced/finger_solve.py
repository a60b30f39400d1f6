"""Inverse of an increasing function for many values at once."""

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
            done = np.abs(new - x) <= 4e-16 * np.maximum(np.abs(x), 1e-3 * (high - low))
            x = np.where(error == 0, x, new)
            if done.all():
                break
    return x[np.ravel(back)].reshape(shape)
