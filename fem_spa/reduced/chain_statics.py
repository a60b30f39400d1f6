"""Equilibrium of a chain: springs, torques of the air, weights.

Without weights every joint opens by its own torque. With them k q (1 + s q^2) = t + moment(q) is solved by
Newton's method for all loads at once; where one number sets the load, on a grid of it, and interpolated in
between.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from fem_spa.errors import InputError
from fem_spa.reduced.chain_links import Links, weight_moments

GRID = 129
"""Loads solved where more are asked for and one number sets them."""
BATCH = 256
STEPS = 60


def turns(links: Links, torque: np.ndarray, gravity: complex = 0j) -> np.ndarray:
    """Turns q (n, m), rad, at equilibrium.

    Parameters
    ----------
    torque : (n, m) N m of the air on each joint;  gravity : m/s^2 as x + iy

    Raises
    ------
    InputError : no equilibrium was found (the chain buckles under its weights)
    """
    free = opened(torque / links.stiffness, links.stiffening)
    if gravity == 0j or not np.any(links.mass):
        return np.asarray(free)
    result = np.empty_like(free)
    for begin in range(0, len(free), BATCH):
        part = slice(begin, begin + BATCH)
        result[part] = _newton(links, torque[part], free[part], gravity)
    return result


def opened(q: np.ndarray, stiffening: np.ndarray | float) -> np.ndarray:
    """Turns (n, m), rad, of stiffening springs that would turn by q (n, m) without: x (1 + s x^2) = q.

    The one real root of the cubic, by hyperbolic sines; `stiffening` s >= 0, (m,) or one for all, 1/rad^2.
    """
    s = np.broadcast_to(stiffening, np.shape(q))
    root = np.sqrt(3.0 * np.where(s > 0.0, s, 1.0))
    stiffer = 2.0 / root * np.sinh(np.arcsinh(1.5 * root * q) / 3.0)
    return np.where(s > 0.0, stiffer, q)


def along(links: Links, scale: np.ndarray, torque: np.ndarray, gravity: complex) -> np.ndarray:
    """Turns (n, m) for torques scale_i * torque: `scale` (n,), `torque` (m,) N m."""
    scale = np.asarray(scale, float)
    if gravity == 0j or scale.size <= GRID:
        return turns(links, scale[:, None] * torque, gravity)
    grid = np.linspace(scale.min(), scale.max(), GRID)
    if grid[0] == grid[-1]:
        return np.repeat(turns(links, scale[:1, None] * torque, gravity), scale.size, axis=0)
    return np.asarray(CubicSpline(grid, turns(links, grid[:, None] * torque, gravity))(scale))


def _newton(links: Links, torque: np.ndarray, start: np.ndarray, gravity: complex) -> np.ndarray:
    """Damped Newton from springs alone, (n, m)."""
    q = start.copy()
    count = q.shape[1]
    later = np.maximum(np.arange(count)[:, None], np.arange(count)[None, :])
    for _ in range(STEPS):
        moment, W = weight_moments(links, q, gravity)
        left = torque + moment - links.stiffness * q * (1.0 + links.stiffening * q**2)
        slope = links.stiffness * (1.0 + 3.0 * links.stiffening * q**2)
        springs = slope[:, :, None] * np.eye(count)
        step = np.linalg.solve(springs + W[:, later], left[..., None])[..., 0]
        q += step * np.minimum(1.0, 0.5 / np.maximum(np.max(np.abs(step), axis=1), 1e-300))[:, None]
        if np.max(np.abs(step)) < 1e-11:
            return q
    raise InputError("the chain finds no equilibrium under its weights; give less payload or stiffer joints")
