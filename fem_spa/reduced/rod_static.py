"""Equilibrium of the rod by shooting, on the same grid and with the same equations as the time loop.

Dead loads make the force in every element known beforehand, so its stretch and shear follow from its
directors in closed form, and the balance of moments marches from the clamp to the tip: three unknowns, the
curvature at the first inner point (or the clamp's hinge), and three conditions, no moment left at the last
element. Newton with a difference Jacobian that is kept (Broyden) along a record; where it fails, the loads
are put on in steps.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from fem_spa.reduced.rod_kernel import CLAMP, turned

TOLERANCE = 1e-11
"""Of the moment left at the tip over the bending stiffness over the length of an element: rad."""
MOST = 60


@njit(cache=True)
def shoot(first, Q, r, rest, loads, hinge, length, axial, bending):
    """March from the clamp with curvature `first` (3,): fills Q (n, 9), r (n + 1, 3); what is left (3,).

    rest : (n, 3) spontaneous sigma_3 of each element, kappa_1 and kappa_2 of the inner point before it
    loads : (n, 3) force in each element, of all that hangs beyond it, N
    Not finite where an element would have to be pressed to nothing.
    """
    n = Q.shape[0]
    left = np.empty(3)
    k0, k1, k2 = first[0], first[1], first[2]
    M0 = M1 = M2 = 0.0  # moment at the last inner point, as it enters the balance
    C0 = C1 = C2 = 0.0  # and half its kappa x M times the length
    old = 1.0
    free = 0 if hinge else 1
    for j in range(3):
        r[0, j] = 0.0
    for k in range(n):
        if k < free:
            Q[k] = CLAMP
        else:
            D = length if k > 0 else 0.5 * length
            R0, R1, R2 = M0 - C0 - left[0], M1 - C1 - left[1], M2 - C2 - left[2]
            for _ in range(40):
                for j in range(9):
                    Q[k, j] = Q[k - 1, j] if k > 0 else CLAMP[j]
                turned(Q, k, k0 * D, k1 * D, k2 * D)
                e = _stretch(Q, k, loads, rest, axial)[0]
                E = 0.5 * (old + e) if k > 0 else e
                E = E * E * E
                M0 = bending[0] * (k0 - rest[k, 1]) / E
                M1 = bending[1] * (k1 - rest[k, 2]) / E
                M2 = bending[2] * k2 / E
                C0 = 0.5 * D * (k1 * M2 - k2 * M1)
                C1 = 0.5 * D * (k2 * M0 - k0 * M2)
                C2 = 0.5 * D * (k0 * M1 - k1 * M0)
                if k == free:
                    break
                d0 = E * (R0 - C0) / bending[0] + rest[k, 1] - k0
                d1 = E * (R1 - C1) / bending[1] + rest[k, 2] - k1
                d2 = E * (R2 - C2) / bending[2] - k2
                k0, k1, k2 = k0 + d0, k1 + d1, k2 + d2
                if not abs(d0) + abs(d1) + abs(d2) > 1e-12:
                    break
        e, g0, g1, g2, a0, a1, a2 = _stretch(Q, k, loads, rest, axial)
        old = e
        for j in range(3):
            r[k + 1, j] = r[k, j] + length * (Q[k, j] * g0 + Q[k, 3 + j] * g1 + Q[k, 6 + j] * g2)
        # (e Q t) x n_L per element length, n_L = Q N e / e
        left[0] = (g1 * a2 - g2 * a1) * length
        left[1] = (g2 * a0 - g0 * a2) * length
        left[2] = (g0 * a1 - g1 * a0) * length
    left[0], left[1], left[2] = M0 - C0 - left[0], M1 - C1 - left[1], M2 - C2 - left[2]
    return left


@njit(cache=True, inline="always")
def _stretch(Q, k, loads, rest, axial):
    """Stretch e of element k, e Q t (3) and Q N (3): S (e Q t - d3 - sigma) = e Q N has a closed solution."""
    a0 = Q[k, 0] * loads[k, 0] + Q[k, 1] * loads[k, 1] + Q[k, 2] * loads[k, 2]
    a1 = Q[k, 3] * loads[k, 0] + Q[k, 4] * loads[k, 1] + Q[k, 5] * loads[k, 2]
    a2 = Q[k, 6] * loads[k, 0] + Q[k, 7] * loads[k, 1] + Q[k, 8] * loads[k, 2]
    s0, s1 = a0 / axial[0], a1 / axial[1]
    below = math.sqrt(max(1.0 - s0 * s0 - s1 * s1, 0.0)) - a2 / axial[2]
    e = (1.0 + rest[k, 0]) / below if below > 1e-3 else math.nan
    return e, e * s0, e * s1, 1.0 + rest[k, 0] + e * a2 / axial[2], a0, a1, a2


@njit(cache=True)
def _jacobian(x, f, Q, r, rest, loads, hinge, length, axial, bending):
    """d left / d first (3, 3) by differences."""
    J = np.empty((3, 3))
    for j in range(3):
        y = x.copy()
        y[j] += 1e-5
        J[:, j] = (shoot(y, Q, r, rest, loads, hinge, length, axial, bending) - f) / 1e-5
    return J


@njit(cache=True)
def settle(x, J, fresh, Q, r, rest, loads, hinge, length, axial, bending):
    """Newton from the first curvature x (3,) in place, J (3, 3) in place, used at once unless `fresh`.

    True where the moment at the tip vanishes; then Q and r hold the state.
    """
    small = TOLERANCE * bending[0] / length
    f = shoot(x, Q, r, rest, loads, hinge, length, axial, bending)
    size = np.abs(f).max()
    for _ in range(MOST):
        if size <= small:
            return True
        if not math.isfinite(size):
            return False
        if fresh:
            J[:] = _jacobian(x, f, Q, r, rest, loads, hinge, length, axial, bending)
            if not math.isfinite(J.sum()) or abs(np.linalg.det(J)) < 1e-300:
                return False
        step = np.linalg.solve(J, -f)
        share, taken = 1.0, False
        while share > 1e-3:
            y = x + share * step
            g = shoot(y, Q, r, rest, loads, hinge, length, axial, bending)
            if np.abs(g).max() < (1.0 - 0.1 * share) * size:
                taken = True
                break
            if not fresh:
                break
            share *= 0.5
        if not taken:
            if fresh:
                return size < 1e3 * small
            fresh = True
            continue
        moved = y - x
        J += np.outer(g - f - J @ moved, moved) / np.dot(moved, moved)
        fresh = np.abs(g).max() > 0.2 * size
        x[:], f = y, g
        size = np.abs(f).max()
    return size < 1e3 * small


@njit(cache=True)
def equilibria(strain, Q, r, weight, tip_force, hinge, length, axial, bending):
    """Tip (m, 3) at each of the spontaneous strains (m, 3), one after the other; NaN where none is found.

    Parameters
    ----------
    strain : (m, 3) sigma_3, kappa_1, kappa_2, the same all along the rod
    Q, r : (n, 9), (n + 1, 3), filled with the last state;  hinge : see rod_kernel
    weight : (n + 1, 3) force on each node, N;  tip_force : (3,) at the last node besides, N
    """
    n = Q.shape[0]
    out = np.full((strain.shape[0], 3), math.nan)
    loads = np.empty((n, 3))
    for j in range(3):
        total = tip_force[j]
        for k in range(n - 1, -1, -1):
            total += weight[k + 1, j]
            loads[k, j] = total
    rest = np.empty((n, 3))
    J = np.eye(3)
    x = np.zeros(3)
    known = False
    for m in range(strain.shape[0]):
        if m > 0 and known and np.all(strain[m] == strain[m - 1]):
            out[m] = out[m - 1]
            continue
        rest[:] = strain[m]
        if known:
            y = x.copy()
            y[:2] += strain[m, 1:] - strain[m - 1, 1:]
            known = settle(y, J, False, Q, r, rest, loads, hinge, length, axial, bending)
            x[:] = y
        if not known:
            x[0], x[1], x[2] = strain[m, 1], strain[m, 2], 0.0
            known = settle(x, J, True, Q, r, rest, loads, hinge, length, axial, bending)
        if not known:
            known = _by_steps(x, J, Q, r, rest, loads, hinge, length, axial, bending)
        if known:
            out[m] = r[n]
    return out


@njit(cache=True)
def _by_steps(x, J, Q, r, rest, loads, hinge, length, axial, bending):
    """Loads and spontaneous strains put on in steps that halve where one fails."""
    x[:] = 0.0
    done, step = 0.0, 0.1
    y = np.zeros(3)
    while done < 1.0:
        aim = min(1.0, done + step)
        y[:] = x
        if settle(y, J, True, Q, r, aim * rest, aim * loads, hinge, length, axial, bending):
            x[:] = y
            done = aim
            step *= 1.5
        else:
            step *= 0.5
            if step < 1e-4:
                return False
    return True
