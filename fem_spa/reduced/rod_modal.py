"""The rod's motion in few strain modes, implicit in time: for fits and loops, which need it by the hundred.

Unknowns are the strains' Legendre coefficients along the rod (`BEND` for each curvature, `TWIST`, `SHEAR`,
`STRETCH`); directors and nodes follow from them on the same grid as in rod_kernel. The balance of forces
and moments of that grid is taken in the form of the statics: loads summed from the tip give the force in
each element and, marching back, the moment at each inner point; what is left between these and the
constitutive law, weighed by the modes, vanishes. A clamp on a rotational spring has three unknowns more, the
vector of its turn, which vanishes against the compliance times the moment of all loads about the base.

Time enters by the loads: a node pulls with m (g - lambda v - a), v and a by BDF2 from the nodes' positions,
second order and stable at any step. Left out, against the explicit loop: rotational inertia and rotational
damping, which are 0.5 % of the inertia and 1e-5 of the damping. Newton with a difference Jacobian that is
kept until it converges slowly.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from fem_spa.reduced.rod_kernel import CLAMP, turned

BEND, TWIST, SHEAR, STRETCH = 4, 2, 2, 2
MODES = 2 * BEND + TWIST + 2 * SHEAR + STRETCH
CLOSE = 1e-6
"""Newton's last step in strain (curvatures times the length of the rod)."""
MOST = 40
SHORT = 0.2
"""Longest step of Newton's method where it was in trouble, likewise."""


def bases(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Legendre polynomials at the inner points (n, BEND), the first at the clamp; in the elements (n, 2)."""
    from numpy.polynomial.legendre import legvander

    points, middles = np.arange(n) / n, (np.arange(n) + 0.5) / n
    return legvander(2 * points - 1, BEND - 1), legvander(2 * middles - 1, max(SHEAR, STRETCH) - 1)


@njit(cache=True, nogil=True, error_model="numpy")
def balance(q, R, r, v, load, known, rate, drag, strain, rod, work):
    """What is left of the balance, R (m,), at coefficients q (m,); fills r, v (n + 1, 3).

    q : MODES strains, and where there are three more the turn of the clamp, rad

    load : (n + 1, 3) constant part of the nodes' loads, N
    known : (n + 1, 3) m/s: v = rate r + known
    drag : (n + 1,) kg/s: the load besides is - drag v
    strain : (3,) spontaneous;  rod : see `implicit`;  work : (n, 16) scratch
    """
    inner, middle, hinge, length, axial, bending, compliance = rod
    n = inner.shape[0]
    turns = q.size > MODES
    free = 0 if hinge else 1
    whole = n * length
    for j in range(3):
        r[0, j] = 0.0
    Q = work[:, :9]
    for k in range(n):
        if k > 0:
            for j in range(9):
                Q[k, j] = Q[k - 1, j]
        else:
            for j in range(9):
                Q[k, j] = CLAMP[j]
            if turns:  # about the clamp's own directors, {-x, y, -z}
                turned(Q, 0, -q[MODES], q[MODES + 1], -q[MODES + 2])
        k0 = k1 = k2 = 0.0
        if k >= free:
            for j in range(BEND):
                k0 += inner[k, j] * q[j]
                k1 += inner[k, j] * q[BEND + j]
            for j in range(TWIST):
                k2 += inner[k, j] * q[2 * BEND + j]
            part = length if k > 0 else 0.5 * length
            turned(Q, k, k0 * part / whole, k1 * part / whole, k2 * part / whole)
        s = 2 * BEND + TWIST
        g0 = g1 = 0.0
        g2 = 1.0
        for j in range(SHEAR):
            g0 += middle[k, j] * q[s + j]
            g1 += middle[k, j] * q[s + SHEAR + j]
        for j in range(STRETCH):
            g2 += middle[k, j] * q[s + 2 * SHEAR + j]
        work[k, 9], work[k, 10], work[k, 11] = k0, k1, k2
        work[k, 12], work[k, 13], work[k, 14] = g0, g1, g2
        work[k, 15] = math.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
        for j in range(3):
            r[k + 1, j] = r[k, j] + length * (Q[k, j] * g0 + Q[k, 3 + j] * g1 + Q[k, 6 + j] * g2)
            v[k + 1, j] = rate * r[k + 1, j] + known[k + 1, j]
    for j in range(q.size):
        R[j] = 0.0
    if turns:
        for j in range(3):
            R[MODES + j] = q[MODES + j]
    N0 = N1 = N2 = 0.0
    M0 = M1 = M2 = 0.0
    C0 = C1 = C2 = 0.0
    for k in range(n - 1, -1, -1):
        N0 += load[k + 1, 0] - drag[k + 1] * v[k + 1, 0]
        N1 += load[k + 1, 1] - drag[k + 1] * v[k + 1, 1]
        N2 += load[k + 1, 2] - drag[k + 1] * v[k + 1, 2]
        if turns:  # the moment of all loads about the base, by parts
            d0, d1, d2 = r[k + 1, 0] - r[k, 0], r[k + 1, 1] - r[k, 1], r[k + 1, 2] - r[k, 2]
            R[MODES] -= compliance * (d1 * N2 - d2 * N1)
            R[MODES + 1] -= compliance * (d2 * N0 - d0 * N2)
            R[MODES + 2] -= compliance * (d0 * N1 - d1 * N0)
        a0 = Q[k, 0] * N0 + Q[k, 1] * N1 + Q[k, 2] * N2
        a1 = Q[k, 3] * N0 + Q[k, 4] * N1 + Q[k, 5] * N2
        a2 = Q[k, 6] * N0 + Q[k, 7] * N1 + Q[k, 8] * N2
        g0, g1, g2, e = work[k, 12], work[k, 13], work[k, 14], work[k, 15]
        p0 = g0 - e * a0 / axial[0]
        p1 = g1 - e * a1 / axial[1]
        p2 = g2 - 1.0 - strain[0] - e * a2 / axial[2]
        s = 2 * BEND + TWIST
        for j in range(SHEAR):
            R[s + j] += middle[k, j] * p0
            R[s + SHEAR + j] += middle[k, j] * p1
        for j in range(STRETCH):
            R[s + 2 * SHEAR + j] += middle[k, j] * p2
        if k < free:
            continue
        b0 = M0 + C0 + (g1 * a2 - g2 * a1) * length
        b1 = M1 + C1 + (g2 * a0 - g0 * a2) * length
        b2 = M2 + C2 + (g0 * a1 - g1 * a0) * length
        part = (length if k > 0 else 0.5 * length) / whole
        k0, k1, k2 = work[k, 9], work[k, 10], work[k, 11]
        x0, x1, x2 = 0.5 * part * k0, 0.5 * part * k1, 0.5 * part * k2
        dot = x0 * b0 + x1 * b1 + x2 * b2
        share = 1.0 / (1.0 + x0 * x0 + x1 * x1 + x2 * x2)
        M0 = (b0 + x1 * b2 - x2 * b1 + x0 * dot) * share  # M - x cross M = b
        M1 = (b1 + x2 * b0 - x0 * b2 + x1 * dot) * share
        M2 = (b2 + x0 * b1 - x1 * b0 + x2 * dot) * share
        C0, C1, C2 = x1 * M2 - x2 * M1, x2 * M0 - x0 * M2, x0 * M1 - x1 * M0
        E = 0.5 * (work[k - 1, 15] + e) if k > 0 else e
        E = E * E * E * whole
        weight = 1.0 if k > 0 else 0.5
        p0 = weight * (k0 - strain[1] * whole - E * M0 / bending[0])
        p1 = weight * (k1 - strain[2] * whole - E * M1 / bending[1])
        p2 = weight * (k2 - E * M2 / bending[2])
        for j in range(BEND):
            R[j] += inner[k, j] * p0
            R[BEND + j] += inner[k, j] * p1
        for j in range(TWIST):
            R[2 * BEND + j] += inner[k, j] * p2


@njit(cache=True, nogil=True, error_model="numpy")
def _improve(inverse, s, before, after, y, c):
    """Broyden's update of the inverse Jacobian by the step s between two residuals; y, c : scratch."""
    whole = 0.0
    m = s.size
    for i in range(m):
        d = e = 0.0
        for j in range(m):
            d += inverse[i, j] * (after[j] - before[j])
            e += s[j] * inverse[j, i]
        y[i], c[i] = s[i] - d, e
        whole += s[i] * d
    if abs(whole) > 1e-30:
        for i in range(m):
            for j in range(m):
                inverse[i, j] += y[i] * c[j] / whole


@njit(cache=True, nogil=True, error_model="numpy")
def _invert(A, inverse):
    """Inverse of A (m, m), which is spoilt, by Gauss and Jordan with pivots; False where singular."""
    m = A.shape[0]
    for i in range(m):
        for j in range(m):
            inverse[i, j] = 1.0 if i == j else 0.0
    for k in range(m):
        best = k
        for i in range(k + 1, m):
            if abs(A[i, k]) > abs(A[best, k]):
                best = i
        if not abs(A[best, k]) > 1e-300:
            return False
        for j in range(m):
            A[k, j], A[best, j] = A[best, j], A[k, j]
            inverse[k, j], inverse[best, j] = inverse[best, j], inverse[k, j]
        whole = 1.0 / A[k, k]
        for j in range(m):
            A[k, j] *= whole
            inverse[k, j] *= whole
        for i in range(m):
            part = A[i, k]
            if i != k and part != 0.0:
                for j in range(m):
                    A[i, j] -= part * A[k, j]
                    inverse[i, j] -= part * inverse[k, j]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _solve(q, inverse, anew, careful, r, v, load, known, rate, drag, strain, rod, work):
    """Newton from q (m,) in place, `inverse` the kept inverse Jacobian; True where it converges.

    careful : a new Jacobian at every step, and no step larger than `SHORT`
    """
    m = q.size
    R, T, s, y, c = np.empty(m), np.empty(m), np.zeros(m), np.empty(m), np.empty(m)
    J = np.empty((m, m))
    before = math.inf
    for turn in range(5 * MOST if careful else MOST):
        balance(q, R, r, v, load, known, rate, drag, strain, rod, work)
        if anew or careful or turn == 8:
            for j in range(m):
                keep = q[j]
                q[j] += 1e-6
                balance(q, T, r, v, load, known, rate, drag, strain, rod, work)
                q[j] = keep
                for i in range(m):
                    J[i, j] = (T[i] - R[i]) / 1e-6
            if not _invert(J, inverse):
                return False
        elif turn > 0:
            _improve(inverse, s, T, R, y, c)
        size = 0.0
        for i in range(m):
            d = 0.0
            for j in range(m):
                d -= inverse[i, j] * R[j]
            s[i] = d
            size = max(size, abs(d))
            T[i] = R[i]
        if not math.isfinite(size):
            return False
        for i in range(m):
            s[i] /= max(1.0, size / SHORT if careful else size)
            q[i] += s[i]
        if size < CLOSE:
            balance(q, R, r, v, load, known, rate, drag, strain, rod, work)
            return True
        anew = turn > 1 and size > 0.5 * before
        before = size
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def implicit(strain, step, weight, mass, damped, slow, rod):
    """Tip (m, 3) at points `step` s apart, from rest at the first strain; NaN from where Newton fails.

    Parameters
    ----------
    strain : (m, 3) spontaneous sigma_3, kappa_1, kappa_2 at the points
    weight : (n + 1, 3) N;  mass : (n + 1,) with the payload, kg;  damped : (n + 1,) without it
    slow : translational damping, 1/s
    rod : modes at the inner points (n, BEND) and in the elements (n, 2), whether the clamp is a hinge, length
        of an element in m, axial and bending stiffness (3,) each, the clamp's compliance in rad/(N m)
    """
    n = mass.size - 1
    count = MODES + (3 if rod[6] > 0.0 else 0)
    out = np.full((strain.shape[0], 3), math.nan)
    q, move, last = np.zeros(count), np.zeros(count), np.zeros(count)
    inverse = np.zeros((count, count))
    r, v, known, load = np.zeros((n + 1, 3)), np.zeros((n + 1, 3)), np.zeros((n + 1, 3)), np.zeros((n + 1, 3))
    r1, r2, v1, v2 = np.zeros((n + 1, 3)), np.zeros((n + 1, 3)), np.zeros((n + 1, 3)), np.zeros((n + 1, 3))
    drag, work = np.zeros(n + 1), np.empty((n, 16))
    rate = 0.0
    for m in range(strain.shape[0]):
        if m > 0:  # v = (3 r - 4 r1 + r2) / 2h, a = (3 v - 4 v1 + v2) / 2h
            rate = 1.5 / step
        for k in range(n + 1):
            drag[k] = mass[k] * rate + damped[k] * slow
            for j in range(3):
                known[k, j] = (-2.0 * r1[k, j] + 0.5 * r2[k, j]) / step
                load[k, j] = weight[k, j] + mass[k] * (2.0 * v1[k, j] - 0.5 * v2[k, j]) / step
        for i in range(count):
            last[i] = q[i]
            q[i] += move[i]
        if not _solve(q, inverse, m <= 1, False, r, v, load, known, rate, drag, strain[m], rod, work):
            for i in range(count):
                q[i] = last[i]
            soft = count > MODES  # else the explicit loop is at hand
            if not soft or not _solve(
                q, inverse, True, True, r, v, load, known, rate, drag, strain[m], rod, work
            ):
                return out
        for i in range(count):
            move[i] = q[i] - last[i] if m > 0 else 0.0
        for k in range(n + 1):
            for j in range(3):
                r2[k, j] = r1[k, j] if m > 0 else r[k, j]
                r1[k, j] = r[k, j]
                v2[k, j] = v1[k, j]
                v1[k, j] = v[k, j] if m > 0 else 0.0
        for j in range(3):
            out[m, j] = r[n, j]
    return out
