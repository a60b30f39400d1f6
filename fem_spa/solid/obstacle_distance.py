"""Distance of points to a rigid obstacle, with its first and second derivative."""

from __future__ import annotations

import numpy as np

from fem_spa.errors import InputError
from fem_spa.solid.obstacles import Cylinder, Obstacle, Plane


def distance(obstacle: Obstacle, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gap (n,) m, negative inside; its gradient (n, 3), the outward normal; its Hessian (n, 3, 3) 1/m.

    x : (n, 3) m
    """
    if isinstance(obstacle, Plane):
        normal = unit(obstacle.normal)
        gap = (x - np.asarray(obstacle.point)) @ normal
        return gap, np.broadcast_to(normal, x.shape), np.zeros((len(x), 3, 3))
    if isinstance(obstacle, Cylinder):
        axis = unit(obstacle.axis)
        r = x - np.asarray(obstacle.point)
        r = r - (r @ axis)[:, None] * axis
        return _round(r, float(obstacle.radius), np.eye(3) - np.outer(axis, axis))
    r = x - np.asarray(obstacle.centre)
    if np.ndim(obstacle.radius) == 0:
        return _round(r, float(obstacle.radius), np.eye(3))  # type: ignore[arg-type]
    return _ellipsoid(r, np.asarray(obstacle.radius, dtype=float))


def unit(direction: tuple[float, float, float]) -> np.ndarray:
    """The direction with length one."""
    d = np.asarray(direction, dtype=float)
    size = float(np.linalg.norm(d))
    if not np.isfinite(size) or size == 0.0:
        raise InputError(f"given {list(direction)} as a direction: its length must be positive")
    return d / size


def _round(r: np.ndarray, radius: float, across: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    far = np.maximum(np.linalg.norm(r, axis=1), 1e-300)
    normal = r / far[:, None]
    hessian = (across - normal[:, :, None] * normal[:, None, :]) / far[:, None, None]
    return far - radius, normal, hessian


def _ellipsoid(r: np.ndarray, axes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The closest point is y = a^2 r / (a^2 + t), where t is the largest root of sum (a r / (a^2 + t))^2 = 1.

    Eberly, Distance from a Point to an Ellipse, an Ellipsoid, or a Hyperellipsoid, 2013.
    """
    square = axes**2
    low = -square.min() + axes[np.argmin(axes)] * np.abs(r[:, np.argmin(axes)])
    high = np.linalg.norm(axes * r, axis=1) - square.min()
    high = np.maximum(high, low)
    for _ in range(200):
        t = 0.5 * (low + high)
        value = np.sum((axes * r / np.maximum(square + t[:, None], 1e-300)) ** 2, axis=1) - 1.0
        low, high = np.where(value > 0, t, low), np.where(value > 0, high, t)
        if np.all(high - low <= 1e-15 * square.max()):
            break
    t = 0.5 * (low + high)
    y = square * r / np.maximum(square + t[:, None], 1e-300)
    g = y / square
    normal = g / np.maximum(np.linalg.norm(g, axis=1), 1e-300)[:, None]
    gap = np.einsum("ni,ni->n", r - y, normal)
    # Weingarten map at the closest point, carried out along the normal: S (1 + gap S)^-1
    across = np.eye(3) - normal[:, :, None] * normal[:, None, :]
    S = across @ np.diag(1.0 / square) @ across / np.linalg.norm(g, axis=1)[:, None, None]
    hessian = S @ np.linalg.inv(np.eye(3) + gap[:, None, None] * S)
    return gap, normal, hessian
