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


@njit(cache=True, nogil=True)
def shoot(first, Q, r, rest, loads, share, hinge, length, axial, bending):
    """March from the clamp with curvature `first` (3,): fills Q (n, 9), r (n + 1, 3); what is left (3,).

    rest : (3,) spontaneous sigma_3, kappa_1, kappa_2;  loads : (n, 3) force in each element, N
    share : of `rest` and `loads` that acts
    Not finite where an element would have to be pressed to nothing.
    """
    n = Q.shape[0]
    left = np.empty(3)
    k0, k1, k2 = first[0], first[1], first[2]
    s0, s1, s2 = 1.0 + share * rest[0], share * rest[1], share * rest[2]
    M0 = M1 = M2 = 0.0  # moment at the last inner point, as it enters the balance
    C0 = C1 = C2 = 0.0  # and half its kappa x M times the length
    old = 1.0
    free = 0 if hinge else 1
    for j in range(3):
        r[0, j] = 0.0
    for k in range(n):
        if k < free:
            for j in range(9):
                Q[k, j] = CLAMP[j]
        else:
            D = length if k > 0 else 0.5 * length
            R0, R1, R2 = M0 - C0 - left[0], M1 - C1 - left[1], M2 - C2 - left[2]
            for _ in range(40):
                for j in range(9):
                    Q[k, j] = Q[k - 1, j] if k > 0 else CLAMP[j]
                turned(Q, k, k0 * D, k1 * D, k2 * D)
                e = _stretch(Q, k, loads, share, s0, axial)[0]
                E = 0.5 * (old + e) if k > 0 else e
                E = E * E * E
                M0 = bending[0] * (k0 - s1) / E
                M1 = bending[1] * (k1 - s2) / E
                M2 = bending[2] * k2 / E
                C0 = 0.5 * D * (k1 * M2 - k2 * M1)
                C1 = 0.5 * D * (k2 * M0 - k0 * M2)
                C2 = 0.5 * D * (k0 * M1 - k1 * M0)
                if k == free:
                    break
                d0 = E * (R0 - C0) / bending[0] + s1 - k0
                d1 = E * (R1 - C1) / bending[1] + s2 - k1
                d2 = E * (R2 - C2) / bending[2] - k2
                k0, k1, k2 = k0 + d0, k1 + d1, k2 + d2
                if not abs(d0) + abs(d1) + abs(d2) > 1e-12:
                    break
        e, g0, g1, g2, a0, a1, a2 = _stretch(Q, k, loads, share, s0, axial)
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
def _stretch(Q, k, loads, share, along, axial):
    """Stretch e of element k, e Q t (3) and Q N (3): S (e Q t - d3 - sigma) = e Q N has a closed solution."""
    f0, f1, f2 = share * loads[k, 0], share * loads[k, 1], share * loads[k, 2]
    a0 = Q[k, 0] * f0 + Q[k, 1] * f1 + Q[k, 2] * f2
    a1 = Q[k, 3] * f0 + Q[k, 4] * f1 + Q[k, 5] * f2
    a2 = Q[k, 6] * f0 + Q[k, 7] * f1 + Q[k, 8] * f2
    g0, g1 = a0 / axial[0], a1 / axial[1]
    below = math.sqrt(max(1.0 - g0 * g0 - g1 * g1, 0.0)) - a2 / axial[2]
    e = along / below if below > 1e-3 else math.nan
    return e, e * g0, e * g1, along + e * a2 / axial[2], a0, a1, a2


@njit(cache=True, nogil=True)
def _against(J, f, step):
    """step (3,) of J step = -f by cross products; False where J (3, 3) is singular."""
    a, b, c = J[:, 0], J[:, 1], J[:, 2]
    x = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
    det = a[0] * x[0] + a[1] * x[1] + a[2] * x[2]
    if not abs(det) > 1e-300:
        return False
    step[0] = -(f[0] * x[0] + f[1] * x[1] + f[2] * x[2]) / det
    y = f[1] * c[2] - f[2] * c[1], f[2] * c[0] - f[0] * c[2], f[0] * c[1] - f[1] * c[0]
    step[1] = -(a[0] * y[0] + a[1] * y[1] + a[2] * y[2]) / det
    z = b[1] * f[2] - b[2] * f[1], b[2] * f[0] - b[0] * f[2], b[0] * f[1] - b[1] * f[0]
    step[2] = -(a[0] * z[0] + a[1] * z[1] + a[2] * z[2]) / det
    return True


@njit(cache=True, nogil=True)
def _largest(f):
    return max(abs(f[0]), abs(f[1]), abs(f[2]))


@njit(cache=True, nogil=True)
def settle(x, J, fresh, Q, r, rest, loads, share, hinge, length, axial, bending):
    """Newton from the first curvature x (3,) in place, J (3, 3) in place, used at once unless `fresh`.

    True where the moment at the tip vanishes; then Q and r hold the state.
    """
    small = TOLERANCE * bending[0] / length
    f, y, step, size = np.empty(3), x.copy(), np.zeros(3), math.inf
    part, column, turn = 1.0, -1, 0  # column of J that the next march is for; -1: a step is tried
    while turn < MOST:
        g = shoot(y, Q, r, rest, loads, share, hinge, length, axial, bending)
        if column >= 0:
            for i in range(3):
                J[i, column] = (g[i] - f[i]) / 1e-5
            column += 1
        else:
            turn += 1
            new = _largest(g)
            if turn == 1 and not math.isfinite(new):
                return False
            if turn == 1 or new < (1.0 - 0.1 * part) * size:
                if turn > 1:
                    whole = 0.0
                    for i in range(3):
                        step[i] = y[i] - x[i]
                        whole += step[i] * step[i]
                    for i in range(3):
                        off = g[i] - f[i] - J[i, 0] * step[0] - J[i, 1] * step[1] - J[i, 2] * step[2]
                        for j in range(3):
                            J[i, j] += off * step[j] / whole
                    fresh = new > 0.2 * size
                for i in range(3):
                    x[i], f[i] = y[i], g[i]
                size, part = new, 1.0
                if size <= small:
                    return True
                column = 0 if fresh else 3
            elif fresh:
                part *= 0.5
                if part < 1e-3:
                    break
                column = 3
            else:
                fresh, part, column = True, 1.0, 0
        if column == 3:
            column = -1
            if not _against(J, f, step):
                return False
            for i in range(3):
                y[i] = x[i] + part * step[i]
        else:
            for i in range(3):
                y[i] = x[i]
            y[column] += 1e-5
    shoot(x, Q, r, rest, loads, share, hinge, length, axial, bending)
    return size < 1e3 * small


@njit(cache=True, nogil=True)
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
    J, x = np.zeros((3, 3)), np.zeros(3)
    known = False
    for m in range(strain.shape[0]):
        rest = strain[m]
        if known:
            old = strain[m - 1]
            if rest[0] == old[0] and rest[1] == old[1] and rest[2] == old[2]:
                for j in range(3):
                    out[m, j] = out[m - 1, j]
                continue
            x[0] += rest[1] - old[1]
            x[1] += rest[2] - old[2]
        known = settle_from(x, J, known, Q, r, rest, loads, hinge, length, axial, bending)
        if known:
            for j in range(3):
                out[m, j] = r[n, j]
    return out


@njit(cache=True, nogil=True)
def settle_from(x, J, known, Q, r, rest, loads, hinge, length, axial, bending):
    """From a neighbour's x and J where they are `known`, else from the unloaded rod, else by steps."""
    if known and settle(x, J, False, Q, r, rest, loads, 1.0, hinge, length, axial, bending):
        return True
    x[0], x[1], x[2] = rest[1], rest[2], 0.0
    if settle(x, J, True, Q, r, rest, loads, 1.0, hinge, length, axial, bending):
        return True
    return _by_steps(x, J, Q, r, rest, loads, hinge, length, axial, bending)


@njit(cache=True, nogil=True)
def _by_steps(x, J, Q, r, rest, loads, hinge, length, axial, bending):
    """Loads and spontaneous strains put on in steps that halve where one fails."""
    y = np.zeros(3)
    for j in range(3):
        x[j] = 0.0
    done, step = 0.0, 0.1
    while done < 1.0:
        aim = min(1.0, done + step)
        for j in range(3):
            y[j] = x[j]
        if settle(y, J, True, Q, r, rest, loads, aim, hinge, length, axial, bending):
            for j in range(3):
                x[j] = y[j]
            done = aim
            step *= 1.5
        else:
            step *= 0.5
            if step < 1e-4:
                return False
    return True
