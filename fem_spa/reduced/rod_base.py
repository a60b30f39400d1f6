"""A clamp on a rotational spring: it turns by a compliance times the moment that the rod leaves at the base.

The clamp's frame turns by the vector theta = c M about the base point, M being the moment of all loads about
it. In the turned frame the rod is a clamped rod under loads that are turned back, and its moment there is M
itself, as M stands on the axis. So a root in three unknowns is sought around the equilibrium of rod_static,
by Broyden's method, which starts as the fixed point theta <- c M and keeps its slope along a record.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from fem_spa.reduced.rod_static import settle_from

CLOSE = 1e-12
"""rad, of the turn."""
MOST = 80
FARTHEST = 0.3
"""rad: the largest step of the turn."""


@njit(cache=True, nogil=True)
def turn(theta):
    """(3, 3) rotation by a vector (3,) rad."""
    x = theta[0] * theta[0] + theta[1] * theta[1] + theta[2] * theta[2]
    if x < 1e-8:
        u, w = 1.0 - x / 6.0, 0.5 - x / 24.0
    else:
        t = math.sqrt(x)
        u, w = math.sin(t) / t, (1.0 - math.cos(t)) / x
    a, b, c = theta[0], theta[1], theta[2]
    out = np.empty((3, 3))
    out[0, 0], out[1, 1], out[2, 2] = (
        1.0 - w * (b * b + c * c),
        1.0 - w * (a * a + c * c),
        1.0 - w * (a * a + b * b),
    )
    out[0, 1], out[1, 0] = w * a * b - u * c, w * a * b + u * c
    out[0, 2], out[2, 0] = w * a * c + u * b, w * a * c - u * b
    out[1, 2], out[2, 1] = w * b * c - u * a, w * b * c + u * a
    return out


@njit(cache=True, nogil=True)
def _leaves(theta, x, J, known, Q, r, rest, force, loads, hinge, length, axial, bending, compliance, g):
    """g (3,) = c M - theta with the rod settled in the frame so turned; False where it does not settle."""
    n = Q.shape[0]
    R = turn(theta)
    sums = np.zeros(3)
    for k in range(n - 1, -1, -1):
        for j in range(3):
            sums[j] += force[k + 1, j]
        for j in range(3):
            loads[k, j] = R[0, j] * sums[0] + R[1, j] * sums[1] + R[2, j] * sums[2]
    if not settle_from(x, J, known, Q, r, rest, loads, hinge, length, axial, bending):
        return False
    for j in range(3):
        g[j] = -theta[j]
    for k in range(n):  # the sum of r x f, by parts: edges against what hangs on them
        d0, d1, d2 = r[k + 1, 0] - r[k, 0], r[k + 1, 1] - r[k, 1], r[k + 1, 2] - r[k, 2]
        g[0] += compliance * (d1 * loads[k, 2] - d2 * loads[k, 1])
        g[1] += compliance * (d2 * loads[k, 0] - d0 * loads[k, 2])
        g[2] += compliance * (d0 * loads[k, 1] - d1 * loads[k, 0])
    return True


@njit(cache=True, nogil=True)
def compliant(strain, Q, r, weight, tip_force, hinge, length, axial, bending, compliance):
    """As `rod_static.equilibria`, on a clamp of `compliance` rad/(N m): tip (m, 3), NaN where none is found.

    All in the frame of the clamp's stand; Q and r are filled with the last state, turned.
    """
    n, rows = Q.shape[0], strain.shape[0]
    out = np.full((rows, 3), math.nan)
    loads, force = np.empty((n, 3)), weight.copy()
    for j in range(3):
        force[n, j] += tip_force[j]
    J, x = np.zeros((3, 3)), np.zeros(3)
    theta, g, new, step, s = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    H = -np.eye(3)  # the inverse slope of g
    known = False
    for m in range(rows):
        rest = strain[m]
        if known:
            old = strain[m - 1]
            if rest[0] == old[0] and rest[1] == old[1] and rest[2] == old[2]:
                out[m] = out[m - 1]
                continue
            x[0] += rest[1] - old[1]
            x[1] += rest[2] - old[2]
        known = _leaves(
            theta, x, J, known, Q, r, rest, force, loads, hinge, length, axial, bending, compliance, g
        )
        if not known:
            continue
        found = False
        for _ in range(MOST):
            size = max(abs(g[0]), abs(g[1]), abs(g[2]))
            if size <= CLOSE:
                found = True
                break
            far = 0.0
            for i in range(3):
                step[i] = -(H[i, 0] * g[0] + H[i, 1] * g[1] + H[i, 2] * g[2])
                far = max(far, abs(step[i]))
            for i in range(3):
                step[i] *= min(1.0, FARTHEST / max(far, 1e-300))
                theta[i] += step[i]
            known = _leaves(
                theta, x, J, True, Q, r, rest, force, loads, hinge, length, axial, bending, compliance, new
            )
            if not known:
                break
            whole = 0.0  # Broyden: H += (step - H y) step' H / (step' H y)
            for i in range(3):
                s[i] = 0.0
                for j in range(3):
                    s[i] += H[i, j] * (new[j] - g[j])
                whole += step[i] * s[i]
            if abs(whole) > 1e-300:
                row = np.array([step[0] * H[0, j] + step[1] * H[1, j] + step[2] * H[2, j] for j in range(3)])
                for i in range(3):
                    for j in range(3):
                        H[i, j] += (step[i] - s[i]) * row[j] / whole
            for i in range(3):
                g[i] = new[i]
        if not found:
            known = False
            for i in range(3):
                theta[i] = 0.0
                for j in range(3):
                    H[i, j] = -1.0 if i == j else 0.0
            continue
        R = turn(theta)
        for i in range(3):
            out[m, i] = R[i, 0] * r[n, 0] + R[i, 1] * r[n, 1] + R[i, 2] * r[n, 2]
    R = turn(theta)
    r[:] = r @ R.T
    for k in range(n):
        Q[k] = (Q[k].reshape(3, 3) @ R.T).ravel()
    return out
