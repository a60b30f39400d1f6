"""Element kernel of the u-p solid: invariants, residual, tangent.

Energy of an element (design.md):  sum_q w [ W(I1bar, I2bar) + p (J - 1) - p^2 / (2 K) ]
with I1bar = J^(-2/3) tr C, I2bar = J^(-4/3) (tr^2 C - tr C^2) / 2, C = F^T F. Its derivatives:

    dI1bar/dF = 2 J^(-2/3) (F - I1/3 F^-T)                       =: A1
    dI2bar/dF = 2 J^(-4/3) (I1 F - F C - 2/3 I2 F^-T)            =: A2
    dJ/dF     = J F^-T
    P = W1 A1 + W2 A2 + p J F^-T
    dP/dF = W11 A1 A1 + W12 (A1 A2 + A2 A1) + W22 A2 A2 + W1 dA1/dF + W2 dA2/dF + p d(J F^-T)/dF

The law enters as its derivatives W1 ... W22 at each quadrature point, so one compiled kernel serves all.
Local unknowns run component by component: u_x of the ten nodes, u_y, u_z, then the four pressures.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

N_U = 30
N_LOCAL = 34
N_UPPER = N_LOCAL * (N_LOCAL + 1) // 2


@njit(cache=True, inline="always")
def deformation_gradient(dN, u, F):
    for i in range(3):
        for j in range(3):
            s = 0.0
            for a in range(10):
                s += u[i, a] * dN[j, a]
            F[i, j] = s
        F[i, i] += 1.0


@njit(cache=True, inline="always")
def physical_gradient(reference, inverse, dN):
    for j in range(3):
        for a in range(10):
            dN[j, a] = (
                inverse[0, j] * reference[0, a]
                + inverse[1, j] * reference[1, a]
                + inverse[2, j] * reference[2, a]
            )


@njit(cache=True, inline="always")
def cofactor(F, cof):
    cof[0, 0] = F[1, 1] * F[2, 2] - F[1, 2] * F[2, 1]
    cof[0, 1] = F[1, 2] * F[2, 0] - F[1, 0] * F[2, 2]
    cof[0, 2] = F[1, 0] * F[2, 1] - F[1, 1] * F[2, 0]
    cof[1, 0] = F[2, 1] * F[0, 2] - F[2, 2] * F[0, 1]
    cof[1, 1] = F[2, 2] * F[0, 0] - F[2, 0] * F[0, 2]
    cof[1, 2] = F[2, 0] * F[0, 1] - F[2, 1] * F[0, 0]
    cof[2, 0] = F[0, 1] * F[1, 2] - F[0, 2] * F[1, 1]
    cof[2, 1] = F[0, 2] * F[1, 0] - F[0, 0] * F[1, 2]
    cof[2, 2] = F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]
    return F[0, 0] * cof[0, 0] + F[0, 1] * cof[0, 1] + F[0, 2] * cof[0, 2]


@njit(cache=True, inline="always")
def squares(F, cof):
    """tr C and (tr^2 C - tr C^2) / 2, the sums of the squared entries of F and of its cofactors."""
    i1 = 0.0
    i2 = 0.0
    for i in range(3):
        for j in range(3):
            i1 += F[i, j] * F[i, j]
            i2 += cof[i, j] * cof[i, j]
    return i1, i2


@njit(cache=True, inline="always")
def gather(tets, e, displacement, u):
    for a in range(10):
        node = tets[e, a]
        for i in range(3):
            u[i, a] = displacement[3 * node + i]


@njit(cache=True, parallel=True)
def invariants(tets, inverse_jacobian, shape_gradient, displacement, J, I1, I2):
    """J and the isochoric I1, I2 at every quadrature point; where J <= 0, I1 = I2 = 3.

    displacement : (>= 3 n_nodes,) m;  J, I1, I2 : (n_el, n_q), overwritten
    """
    n_q = shape_gradient.shape[0]
    for e in prange(tets.shape[0]):
        u = np.empty((3, 10))
        dN = np.empty((3, 10))
        F = np.empty((3, 3))
        cof = np.empty((3, 3))
        gather(tets, e, displacement, u)
        for q in range(n_q):
            physical_gradient(shape_gradient[q], inverse_jacobian[e, q], dN)
            deformation_gradient(dN, u, F)
            det = cofactor(F, cof)
            J[e, q] = det
            if det <= 0.0:
                I1[e, q] = 3.0
                I2[e, q] = 3.0
                continue
            i1, i2 = squares(F, cof)
            third = det ** (-1.0 / 3.0)
            I1[e, q] = i1 * third * third
            I2[e, q] = i2 * (third * third) ** 2


@njit(cache=True, parallel=True)
def residual(
    tets,
    inverse_jacobian,
    weight,
    shape_gradient,
    pressure_shape,
    displacement,
    pressure,
    inverse_bulk,
    W1,
    W2,
    out,
):
    """Internal forces, element by element.

    pressure : (n_vertices,) Pa;  inverse_bulk : (n_el,) 1/Pa;  W1, W2 : (n_el, n_q) Pa
    out : (n_el, 34), overwritten: N for displacements, m^3 for pressures
    """
    n_q = weight.shape[1]
    for e in prange(tets.shape[0]):
        u = np.empty((3, 10))
        dN = np.empty((3, 10))
        F = np.empty((3, 3))
        cof = np.empty((3, 3))
        P = np.empty((3, 3))
        gather(tets, e, displacement, u)
        for k in range(N_LOCAL):
            out[e, k] = 0.0
        for q in range(n_q):
            physical_gradient(shape_gradient[q], inverse_jacobian[e, q], dN)
            deformation_gradient(dN, u, F)
            det = cofactor(F, cof)
            p = 0.0
            for n in range(4):
                p += pressure_shape[q, n] * pressure[tets[e, n]]
            _stress(F, cof, det, p, W1[e, q], W2[e, q], P)
            w = weight[e, q]
            for i in range(3):
                for a in range(10):
                    out[e, 10 * i + a] += w * (P[i, 0] * dN[0, a] + P[i, 1] * dN[1, a] + P[i, 2] * dN[2, a])
            g = w * (det - 1.0 - p * inverse_bulk[e])
            for n in range(4):
                out[e, N_U + n] += g * pressure_shape[q, n]


@njit(cache=True, inline="always")
def _stress(F, cof, det, p, w1, w2, P):
    """First Piola-Kirchhoff stress; F F^T F enters as (b F) with b = F F^T."""
    i1, i2 = squares(F, cof)
    m = det ** (-2.0 / 3.0)
    c1 = 2.0 * m * w1
    c2 = 2.0 * m * m * w2
    # J F^-T = cof
    on_cof = p - (c1 * i1 / 3.0 + c2 * 2.0 / 3.0 * i2) / det
    for i in range(3):
        for j in range(3):
            P[i, j] = (c1 + c2 * i1) * F[i, j] + on_cof * cof[i, j]
    if w2 != 0.0:
        for i in range(3):
            for k in range(3):
                b = F[i, 0] * F[k, 0] + F[i, 1] * F[k, 1] + F[i, 2] * F[k, 2]
                for j in range(3):
                    P[i, j] -= c2 * b * F[k, j]


@njit(cache=True, inline="always")
def _moduli(F, cof, det, p, w1, w2, w11, w12, w22, A1, A2, H, A):
    """dP/dF as A[3 i + j, 3 k + l] (symmetric, all entries). A1, A2, H: (3, 3) work arrays."""
    i1, i2 = squares(F, cof)
    m = det ** (-2.0 / 3.0)
    for i in range(3):
        for j in range(3):
            H[i, j] = cof[i, j] / det  # F^-T
    for i in range(3):
        for j in range(3):
            A1[i, j] = 2.0 * m * (F[i, j] - i1 / 3.0 * H[i, j])
    quartic = w2 != 0.0 or w12 != 0.0 or w22 != 0.0
    if quartic:
        for i in range(3):
            for j in range(3):
                s = 0.0
                for k in range(3):
                    b = F[i, 0] * F[k, 0] + F[i, 1] * F[k, 1] + F[i, 2] * F[k, 2]
                    s += b * F[k, j]
                A2[i, j] = 2.0 * m * m * (i1 * F[i, j] - s - 2.0 / 3.0 * i2 * H[i, j])
    c1 = 2.0 * m * w1
    swap1 = c1 * i1 / 3.0  # on  H_il H_kj, from dF^-T/dF = -F^-T F^-T
    for r in range(9):
        i = r // 3
        j = r % 3
        for s in range(r, 9):
            k = s // 3
            l = s % 3
            hh = H[i, j] * H[k, l]
            value = (
                w11 * A1[i, j] * A1[k, l]
                + c1 * (-2.0 / 3.0 * (F[i, j] * H[k, l] + H[i, j] * F[k, l]) + 2.0 / 9.0 * i1 * hh)
                + (swap1 - p * det) * H[i, l] * H[k, j]
                + p * det * hh
            )
            if i == k and j == l:
                value += c1
            A[r, s] = value
    if quartic:
        c2 = 2.0 * m * m * w2
        for r in range(9):
            i = r // 3
            j = r % 3
            for s in range(r, 9):
                k = s // 3
                l = s % 3
                # D1 = 2 F = dI1/dF and D2 = dI2/dF = 2 (I1 F - b F), so that
                # d2I2bar = m^2 [ d2I2 - 4/3 (D2 H + H D2) + 16/9 I2 H H + 4/3 I2 H_il H_kj ]
                b = F[i, 0] * F[k, 0] + F[i, 1] * F[k, 1] + F[i, 2] * F[k, 2]
                c = F[0, j] * F[0, l] + F[1, j] * F[1, l] + F[2, j] * F[2, l]
                second = 2.0 * F[i, j] * F[k, l] - F[i, l] * F[k, j]
                if i == k:
                    second -= c
                if j == l:
                    second -= b
                if i == k and j == l:
                    second += i1
                d2_r = A2[i, j] / (2.0 * m * m) + 2.0 / 3.0 * i2 * H[i, j]
                d2_s = A2[k, l] / (2.0 * m * m) + 2.0 / 3.0 * i2 * H[k, l]
                A[r, s] += (
                    w12 * (A1[i, j] * A2[k, l] + A2[i, j] * A1[k, l])
                    + w22 * A2[i, j] * A2[k, l]
                    + c2
                    * (
                        second
                        - 4.0 / 3.0 * (d2_r * H[k, l] + H[i, j] * d2_s)
                        + 8.0 / 9.0 * i2 * H[i, j] * H[k, l]
                        + 2.0 / 3.0 * i2 * H[i, l] * H[k, j]
                    )
                )
    for r in range(9):
        for s in range(r):
            A[r, s] = A[s, r]


@njit(cache=True, parallel=True)
def tangent(
    tets,
    first,
    last,
    inverse_jacobian,
    weight,
    shape_gradient,
    pressure_shape,
    displacement,
    pressure,
    inverse_bulk,
    W1,
    W2,
    W11,
    W12,
    W22,
    out,
):
    """Upper triangles of the element matrices of elements first ... last - 1.

    out : (>= last - first, 595), overwritten: row by row, columns from the diagonal on
    """
    n_q = weight.shape[1]
    for e in prange(first, last):
        u = np.empty((3, 10))
        dN = np.empty((3, 10))
        F = np.empty((3, 3))
        cof = np.empty((3, 3))
        A1 = np.empty((3, 3))
        A2 = np.zeros((3, 3))
        H = np.empty((3, 3))
        A = np.empty((9, 9))
        G = np.empty((9, N_U))
        K = np.zeros((N_LOCAL, N_LOCAL))
        gather(tets, e, displacement, u)
        for q in range(n_q):
            physical_gradient(shape_gradient[q], inverse_jacobian[e, q], dN)
            deformation_gradient(dN, u, F)
            det = cofactor(F, cof)
            p = 0.0
            for n in range(4):
                p += pressure_shape[q, n] * pressure[tets[e, n]]
            _moduli(F, cof, det, p, W1[e, q], W2[e, q], W11[e, q], W12[e, q], W22[e, q], A1, A2, H, A)
            w = weight[e, q]
            for r in range(9):
                for k in range(3):
                    a0 = w * A[r, 3 * k]
                    a1 = w * A[r, 3 * k + 1]
                    a2 = w * A[r, 3 * k + 2]
                    for b in range(10):
                        G[r, 10 * k + b] = a0 * dN[0, b] + a1 * dN[1, b] + a2 * dN[2, b]
            for i in range(3):
                for a in range(10):
                    d0 = dN[0, a]
                    d1 = dN[1, a]
                    d2 = dN[2, a]
                    row = 10 * i + a
                    for c in range(10 * i, N_U):
                        K[row, c] += d0 * G[3 * i, c] + d1 * G[3 * i + 1, c] + d2 * G[3 * i + 2, c]
                    g = w * (d0 * cof[i, 0] + d1 * cof[i, 1] + d2 * cof[i, 2])
                    for n in range(4):
                        K[row, N_U + n] += g * pressure_shape[q, n]
            if inverse_bulk[e] != 0.0:
                for m in range(4):
                    for n in range(m, 4):
                        K[N_U + m, N_U + n] -= (
                            w * inverse_bulk[e] * pressure_shape[q, m] * pressure_shape[q, n]
                        )
        k = 0
        for row in range(N_LOCAL):
            for c in range(row, N_LOCAL):
                out[e - first, k] = K[row, c]
                k += 1
