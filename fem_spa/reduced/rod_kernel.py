"""The time loop of the rod in one kernel: position Verlet on the staggered grid of PyElastica.

Gazzola, Dudte, McCormick, Mahadevan, R. Soc. Open Sci. 5 (2018) 171628, and Alessi et al. (5)-(13),
(31)-(32): n + 1 nodes with positions r and velocities v, n elements with directors Q (rows d1, d2, d3) and
spins w about them, n - 1 inner points with curvatures. The first node is held, and so is the first element
(PyElastica's clamp, first order in 1/n); or, with `hinge`, the frame that this element is bent against over
half its length (second order). All arrays are SI.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

CLAMP = np.array([-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0])
"""Directors of the base, {-x, y, -z} (section III.F)."""


@njit(cache=True, inline="always")
def turned(Q, k, a, b, c):
    """Directors `Q[k]` (a row of nine) turned by the vector (a, b, c) rad about themselves, in place."""
    x = a * a + b * b + c * c
    if x < 0.05:
        u = 1.0 - x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0 * (1.0 - x / 72.0)))
        w = 0.5 - x / 24.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0 * (1.0 - x / 90.0)))
    else:
        t = math.sqrt(x)
        u = math.sin(t) / t
        w = (1.0 - math.cos(t)) / x
    r00, r11, r22 = 1.0 - w * (b * b + c * c), 1.0 - w * (a * a + c * c), 1.0 - w * (a * a + b * b)
    r01, r10 = u * c + w * a * b, -u * c + w * a * b
    r02, r20 = -u * b + w * a * c, u * b + w * a * c
    r12, r21 = u * a + w * b * c, -u * a + w * b * c
    for j in range(3):
        q0, q1, q2 = Q[k, j], Q[k, 3 + j], Q[k, 6 + j]
        Q[k, j] = r00 * q0 + r01 * q1 + r02 * q2
        Q[k, 3 + j] = r10 * q0 + r11 * q1 + r12 * q2
        Q[k, 6 + j] = r20 * q0 + r21 * q1 + r22 * q2


@njit(cache=True, inline="always")
def arc_over_sine(s):
    """asin(x)/x of s = x^2, which makes a rotation vector of the skew part of a rotation below 90 degrees."""
    if s < 0.03:
        return 1.0 + s * (
            1 / 6 + s * (3 / 40 + s * (15 / 336 + s * (105 / 3456 + s * (945 / 42240 + s * 0.01735))))
        )
    x = math.sqrt(s)
    return math.asin(min(x, 1.0)) / x


@njit(cache=True, inline="always")
def bent(a, c):
    """Rotation vector from the directors a (9,) to c (9,), about themselves, rad; below 90 degrees."""
    x0 = 0.5 * (c[3] * a[6] + c[4] * a[7] + c[5] * a[8] - c[6] * a[3] - c[7] * a[4] - c[8] * a[5])
    x1 = 0.5 * (c[6] * a[0] + c[7] * a[1] + c[8] * a[2] - c[0] * a[6] - c[1] * a[7] - c[2] * a[8])
    x2 = 0.5 * (c[0] * a[3] + c[1] * a[4] + c[2] * a[5] - c[3] * a[0] - c[4] * a[1] - c[5] * a[2])
    f = arc_over_sine(x0 * x0 + x1 * x1 + x2 * x2)
    return x0 * f, x1 * f, x2 * f


@njit(cache=True, inline="always")
def decay(x):
    """exp(-x), x >= 0."""
    if x < 1e-3:
        return 1.0 - x * (1.0 - x * (0.5 - x * (1 / 6 - x / 24)))
    return math.exp(-x)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "arcp", "nsz", "reassoc"})
def verlet(
    r,
    v,
    Q,
    w,
    strain,
    substeps,
    dt,
    hinge,
    length,
    mass,
    tip,
    inertia,
    axial,
    bending,
    gravity,
    slow,
    spin_slow,
):
    """March the state in place; the tip at every grid point, (m, 3).

    Parameters
    ----------
    r, v : (n + 1, 3) m, m/s;  Q : (n, 9) directors, row by row;  w : (n, 3) rad/s about them
    strain : (m, 3) spontaneous sigma_3, kappa_1, kappa_2 at the grid points, linear in between
    substeps : time steps of `dt` s between two grid points;  hinge : see above
    length : of an element at rest, m
    mass : (n + 1,) kg;  tip : further mass at the last node, kg;  inertia : (3,) of an element, kg m^2
    axial, bending : (3,) N and N m^2;  gravity : (3,) m/s^2
    slow : translational damping lambda_t, 1/s;  spin_slow : (3,) rotational damping rates at rest length, 1/s
    """
    n = Q.shape[0]
    out = np.empty((strain.shape[0], 3))
    force = np.zeros((n + 1, 3))  # of element k on its nodes, at k + 1; nothing before the first
    couple = np.zeros((n + 1, 3))  # at inner point k, between elements k - 1 and k: M; zero at both ends
    cross = np.zeros((n + 1, 3))  # half of kappa x M there, times the length
    shear = np.zeros((n, 3))
    stretch = np.zeros(n)
    rate = np.zeros(n)
    ga, gb, ea = axial[0], axial[1], axial[2]
    b0, b1, b2 = bending[0], bending[1], bending[2]
    keep = np.empty(n + 1)
    for k in range(n + 1):
        keep[k] = math.exp(-slow * dt)
    keep[n] = math.exp(-slow * dt * mass[n] / (mass[n] + tip))
    inverse = 1.0 / length
    free = 0 if hinge else 1
    for j in range(3):
        out[0, j] = r[n, j]
    # the half step of positions that opens the first time step; afterwards two halves run as one
    for k in range(1, n + 1):
        for j in range(3):
            r[k, j] += 0.5 * dt * v[k, j]
    for k in range(free, n):
        turned(Q, k, 0.5 * dt * w[k, 0], 0.5 * dt * w[k, 1], 0.5 * dt * w[k, 2])
    for point in range(strain.shape[0] - 1):
        for step in range(substeps):
            share = (step + 0.5) / substeps
            s3 = 1.0 + strain[point, 0] + share * (strain[point + 1, 0] - strain[point, 0])
            k1 = strain[point, 1] + share * (strain[point + 1, 1] - strain[point, 1])
            k2 = strain[point, 2] + share * (strain[point + 1, 2] - strain[point, 2])
            for k in range(n):
                dx, dy, dz = r[k + 1, 0] - r[k, 0], r[k + 1, 1] - r[k, 1], r[k + 1, 2] - r[k, 2]
                l2 = dx * dx + dy * dy + dz * dz
                l = math.sqrt(l2)
                e = l * inverse
                stretch[k] = e
                g0 = (Q[k, 0] * dx + Q[k, 1] * dy + Q[k, 2] * dz) * inverse  # e Q t
                g1 = (Q[k, 3] * dx + Q[k, 4] * dy + Q[k, 5] * dz) * inverse
                g2 = (Q[k, 6] * dx + Q[k, 7] * dy + Q[k, 8] * dz) * inverse
                n0, n1, n2 = ga * g0 / e, gb * g1 / e, ea * (g2 - s3) / e
                for j in range(3):
                    force[k + 1, j] = Q[k, j] * n0 + Q[k, 3 + j] * n1 + Q[k, 6 + j] * n2
                shear[k, 0] = (g1 * n2 - g2 * n1) * length
                shear[k, 1] = (g2 * n0 - g0 * n2) * length
                shear[k, 2] = (g0 * n1 - g1 * n0) * length
                rate[k] = (
                    dx * (v[k + 1, 0] - v[k, 0]) + dy * (v[k + 1, 1] - v[k, 1]) + dz * (v[k + 1, 2] - v[k, 2])
                ) / l2  # (de/dt) / e
            for k in range(free, n):
                x0, x1, x2 = bent(Q[k - 1] if k > 0 else CLAMP, Q[k])
                per = inverse if k > 0 else 2.0 * inverse
                E = 0.5 * (stretch[max(k - 1, 0)] + stretch[k])
                E = 1.0 / (E * E * E)
                m0, m1, m2 = b0 * (x0 * per - k1) * E, b1 * (x1 * per - k2) * E, b2 * x2 * per * E
                couple[k, 0], couple[k, 1], couple[k, 2] = m0, m1, m2
                cross[k, 0] = 0.5 * (x1 * m2 - x2 * m1)
                cross[k, 1] = 0.5 * (x2 * m0 - x0 * m2)
                cross[k, 2] = 0.5 * (x0 * m1 - x1 * m0)
            for k in range(1, n + 1):
                if k < n:
                    h = dt / mass[k]
                    for j in range(3):
                        new = v[k, j] + h * (force[k + 1, j] - force[k, j]) + dt * gravity[j]
                        v[k, j] = new * keep[k]
                        r[k, j] += dt * v[k, j]
                else:
                    h = dt / (mass[n] + tip)
                    for j in range(3):
                        v[n, j] = (v[n, j] - h * force[n, j] + dt * gravity[j]) * keep[n]
                        r[n, j] += dt * v[n, j]
            for k in range(free, n):
                e = stretch[k]
                p0, p1, p2 = w[k, 0], w[k, 1], w[k, 2]
                j0, j1, j2 = inertia[0] * p0 / e, inertia[1] * p1 / e, inertia[2] * p2 / e
                t0 = couple[k + 1, 0] - couple[k, 0] + cross[k, 0] + cross[k + 1, 0] + shear[k, 0]
                t1 = couple[k + 1, 1] - couple[k, 1] + cross[k, 1] + cross[k + 1, 1] + shear[k, 1]
                t2 = couple[k + 1, 2] - couple[k, 2] + cross[k, 2] + cross[k + 1, 2] + shear[k, 2]
                t0 += j1 * p2 - j2 * p1 + j0 * rate[k]
                t1 += j2 * p0 - j0 * p2 + j1 * rate[k]
                t2 += j0 * p1 - j1 * p0 + j2 * rate[k]
                w[k, 0] = (p0 + dt * e / inertia[0] * t0) * decay(spin_slow[0] * e * dt)
                w[k, 1] = (p1 + dt * e / inertia[1] * t1) * decay(spin_slow[1] * e * dt)
                w[k, 2] = (p2 + dt * e / inertia[2] * t2) * decay(spin_slow[2] * e * dt)
                turned(Q, k, dt * w[k, 0], dt * w[k, 1], dt * w[k, 2])
        for j in range(3):
            out[point + 1, j] = r[n, j] - 0.5 * dt * v[n, j]
        if not abs(r[n, 0]) < 1e3:
            out[point + 1 :] = np.nan
            return out
    return out
