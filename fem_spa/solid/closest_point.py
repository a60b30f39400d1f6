"""Closest point of a quadratic triangle to a point, and the distance's second derivative.

Nodes of a face: corners 0, 1, 2 and the middles 3 (01), 4 (12), 5 (20). A closest point lies inside the
face, on one of its edges or at a corner: two, one or no parameter is left to vary. With r = x - y(s), T the
derivatives of y by those parameters, c = (N of the source, -N of the target) and D = (0, dN of the target),
minimising |r|^2 / 2 over s gives its second derivative by all nodes

    H = c c^T (x) 1 - sum_kl M^-1_kl (D_k (x) r + c (x) T_k) (D_l (x) r + c (x) T_l)^T,
    M = T^T T - r . y_ss,

and (H - grad g grad g^T) / g is that of the distance g; inside a face the division by g is done by hand, so
that g = 0 is regular.
"""

from __future__ import annotations

import numpy as np
from numba import njit

INSIDE, EDGE, CORNER = 2, 1, 0
_BEYOND = 0.1  # of a face's or an edge's parameters
_STARTS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
_ALONG = np.array([[1.0, 0.0], [-1.0, 1.0], [0.0, -1.0]])


@njit(cache=True)
def shape(s, t, N):
    """The six shape functions at (s, t) into N (6,)."""
    l = 1.0 - s - t
    N[0] = l * (2 * l - 1)
    N[1] = s * (2 * s - 1)
    N[2] = t * (2 * t - 1)
    N[3] = 4 * l * s
    N[4] = 4 * s * t
    N[5] = 4 * t * l


@njit(cache=True)
def derivatives(s, t, dN):
    """Their derivatives by s and t into dN (2, 6)."""
    l = 1.0 - s - t
    dN[0, 0] = dN[1, 0] = 1 - 4 * l
    dN[0, 1] = 4 * s - 1
    dN[1, 1] = 0.0
    dN[0, 2] = 0.0
    dN[1, 2] = 4 * t - 1
    dN[0, 3] = 4 * (l - s)
    dN[1, 3] = -4 * s
    dN[0, 4] = 4 * t
    dN[1, 4] = 4 * s
    dN[0, 5] = -4 * t
    dN[1, 5] = 4 * (l - t)


# second derivatives: ss, st, tt
_SECOND = np.array(
    [[4.0, 4, 0, -8, 0, 0], [4.0, 0, 0, -4, 4, -4], [4.0, 0, 4, 0, 0, -8]],
)


@njit(cache=True)
def _residual(x, X, s, t, N, r):
    shape(s, t, N)
    square = 0.0
    for i in range(3):
        y = 0.0
        for a in range(6):
            y += N[a] * X[a, i]
        r[i] = x[i] - y
        square += r[i] * r[i]
    return square


@njit(cache=True)
def _along(dN, X, T):
    for k in range(2):
        for i in range(3):
            v = 0.0
            for a in range(6):
                v += dN[k, a] * X[a, i]
            T[k, i] = v


@njit(cache=True)
def _bend(X, r):
    """r . y_ss, r . y_st, r . y_tt."""
    b0 = b1 = b2 = 0.0
    for a in range(6):
        v = r[0] * X[a, 0] + r[1] * X[a, 1] + r[2] * X[a, 2]
        b0 += _SECOND[0, a] * v
        b1 += _SECOND[1, a] * v
        b2 += _SECOND[2, a] * v
    return b0, b1, b2


@njit(cache=True)
def closest(x, X, N, dN, T, r):
    """Closest point of the face X (6, 3) to x (3,).

    Returns (kind, edge, s, t, square of the distance), kind INSIDE, EDGE or CORNER; r (3,) is x - y.
    The other arrays are room to work in: N (6,), dN (2, 6), T (2, 3).
    """
    s, t = _foot(x, X, N, dN, T, r)
    if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
        return INSIDE, 0, s, t, _residual(x, X, s, t, N, r)
    best = np.inf
    kind, at, s, t = CORNER, 0, 0.0, 0.0
    for edge in range(3):
        u = _on_edge(x, X, edge, 0.0, N, dN, T, r)
        es = _STARTS[edge, 0] + u * _ALONG[edge, 0]
        et = _STARTS[edge, 1] + u * _ALONG[edge, 1]
        square = _residual(x, X, es, et, N, r)
        if square < best:
            best, at, s, t = square, edge, es, et
            kind = EDGE if 0.0 < u < 1.0 else CORNER
    return kind, at, s, t, _residual(x, X, s, t, N, r)


@njit(cache=True)
def closest_of_kind(kind, edge, s, t, x, X, N, dN, T, r):
    """Likewise, but of the same kind as before, on the face or edge continued a little beyond its end.

    kind, edge, s, t : what `closest` gave at a place nearby. Where the face or the edge would have to be
    continued by more than a tenth of its size, the answer is `closest`'s.
    """
    if kind == INSIDE:
        s, t = _foot(x, X, N, dN, T, r)
        if s >= -_BEYOND and t >= -_BEYOND and s + t <= 1.0 + _BEYOND:
            return INSIDE, 0, s, t, _residual(x, X, s, t, N, r)
    elif kind == EDGE:
        u = _on_edge(x, X, edge, _BEYOND, N, dN, T, r)
        if -_BEYOND < u < 1.0 + _BEYOND:
            s = _STARTS[edge, 0] + u * _ALONG[edge, 0]
            t = _STARTS[edge, 1] + u * _ALONG[edge, 1]
            return EDGE, edge, s, t, _residual(x, X, s, t, N, r)
    else:
        return CORNER, edge, s, t, _residual(x, X, s, t, N, r)
    return closest(x, X, N, dN, T, r)


@njit(cache=True)
def _foot(x, X, N, dN, T, r):
    """(s, t) where x - y is normal to the face or its continuation; of no use far outside."""
    s, t = 1.0 / 3.0, 1.0 / 3.0
    for _ in range(20):
        _residual(x, X, s, t, N, r)
        derivatives(s, t, dN)
        _along(dN, X, T)
        b0, b1, b2 = _bend(X, r)
        g0 = T[0, 0] * r[0] + T[0, 1] * r[1] + T[0, 2] * r[2]
        g1 = T[1, 0] * r[0] + T[1, 1] * r[1] + T[1, 2] * r[2]
        a0 = T[0, 0] ** 2 + T[0, 1] ** 2 + T[0, 2] ** 2
        a1 = T[0, 0] * T[1, 0] + T[0, 1] * T[1, 1] + T[0, 2] * T[1, 2]
        a2 = T[1, 0] ** 2 + T[1, 1] ** 2 + T[1, 2] ** 2
        m0, m1, m2 = a0 - b0, a1 - b1, a2 - b2
        det = m0 * m2 - m1 * m1
        if m0 <= 0.0 or det <= 1e-3 * (a0 * a2 - a1 * a1):
            m0, m1, m2 = a0, a1, a2
            det = m0 * m2 - m1 * m1
            if det <= 0.0:
                break
        ds = (m2 * g0 - m1 * g1) / det
        dt = (m0 * g1 - m1 * g0) / det
        longest = max(abs(ds), abs(dt))
        if longest > 0.5:
            ds *= 0.5 / longest
            dt *= 0.5 / longest
        s += ds
        t += dt
        if s < -1.0 or t < -1.0 or s + t > 2.0:
            break
        if longest < 1e-13:
            break
    return s, t


@njit(cache=True)
def _on_edge(x, X, edge, beyond, N, dN, T, r):
    u = 0.5
    for _ in range(20):
        s = _STARTS[edge, 0] + u * _ALONG[edge, 0]
        t = _STARTS[edge, 1] + u * _ALONG[edge, 1]
        _residual(x, X, s, t, N, r)
        derivatives(s, t, dN)
        _along(dN, X, T)
        b0, b1, b2 = _bend(X, r)
        p, q = _ALONG[edge, 0], _ALONG[edge, 1]
        g = a = 0.0
        for i in range(3):
            e = p * T[0, i] + q * T[1, i]
            g += e * r[i]
            a += e * e
        m = a - (p * p * b0 + 2 * p * q * b1 + q * q * b2)
        if m <= 1e-2 * a:
            m = a
        if m <= 0.0:
            break
        step = g / m
        new = min(max(u + step, -beyond), 1.0 + beyond)
        if abs(new - u) < 1e-13:
            u = new
            break
        u = new
    return u


@njit(cache=True)
def normal_at(X, s, t, dN, T, n):
    """Unit normal (3,) of the face at (s, t), out of the body, into n; T and dN are those there."""
    derivatives(s, t, dN)
    _along(dN, X, T)
    n[0] = T[0, 1] * T[1, 2] - T[0, 2] * T[1, 1]
    n[1] = T[0, 2] * T[1, 0] - T[0, 0] * T[1, 2]
    n[2] = T[0, 0] * T[1, 1] - T[0, 1] * T[1, 0]
    size = (n[0] ** 2 + n[1] ** 2 + n[2] ** 2) ** 0.5
    for i in range(3):
        n[i] /= size


@njit(cache=True)
def second_derivative(c, X, kind, edge, s, t, g, n, dN, T, D, out):
    """The second derivative of the distance g by the twelve nodes into out (36, 36).

    c : (12,) shape functions of the source and minus those of the target;  n : (3,) gradient by x
    D : (2, 12) room to work in
    """
    derivatives(s, t, dN)
    _along(dN, X, T)
    b0, b1, b2 = _bend(X, n)
    m = np.zeros((2, 2))
    curve = np.zeros((2, 2))  # (A^-1 - M^-1) / g = -A^-1 B M^-1, of use inside only
    D[:] = 0.0
    count = kind
    if kind == INSIDE:
        a0 = T[0, 0] ** 2 + T[0, 1] ** 2 + T[0, 2] ** 2
        a1 = T[0, 0] * T[1, 0] + T[0, 1] * T[1, 1] + T[0, 2] * T[1, 2]
        a2 = T[1, 0] ** 2 + T[1, 1] ** 2 + T[1, 2] ** 2
        m0, m1, m2 = a0 - g * b0, a1 - g * b1, a2 - g * b2
        det = m0 * m2 - m1 * m1
        m[0, 0], m[1, 1] = m2 / det, m0 / det
        m[0, 1] = m[1, 0] = -m1 / det
        da = a0 * a2 - a1 * a1
        i00, i01, i11 = a2 / da, -a1 / da, a0 / da
        # A^-1 B
        p00, p01 = i00 * b0 + i01 * b1, i00 * b1 + i01 * b2
        p10, p11 = i01 * b0 + i11 * b1, i01 * b1 + i11 * b2
        curve[0, 0] = -(p00 * m[0, 0] + p01 * m[1, 0])
        curve[0, 1] = -(p00 * m[0, 1] + p01 * m[1, 1])
        curve[1, 0] = -(p10 * m[0, 0] + p11 * m[1, 0])
        curve[1, 1] = -(p10 * m[0, 1] + p11 * m[1, 1])
        for k in range(2):
            for a in range(6):
                D[k, 6 + a] = dN[k, a]
    elif kind == EDGE:
        p, q = _ALONG[edge, 0], _ALONG[edge, 1]
        a0 = 0.0
        for i in range(3):
            T[0, i] = p * T[0, i] + q * T[1, i]
            a0 += T[0, i] ** 2
        for a in range(6):
            D[0, 6 + a] = p * dN[0, a] + q * dN[1, a]
        m[0, 0] = 1.0 / (a0 - g * (p * p * b0 + 2 * p * q * b1 + q * q * b2))
    for i in range(3):
        for j in range(3):
            if kind == INSIDE:
                P = 0.0
                for k in range(2):
                    for l in range(2):
                        P += curve[k, l] * T[k, i] * T[l, j]
            else:
                P = (1.0 if i == j else 0.0) - n[i] * n[j]
                if kind == EDGE:
                    P -= m[0, 0] * T[0, i] * T[0, j]
                P /= g if g != 0.0 else np.inf
            for a in range(12):
                for b in range(12):
                    v = c[a] * c[b] * P
                    for k in range(count):
                        for l in range(count):
                            mk = m[k, l]
                            v -= mk * (
                                D[k, a] * c[b] * n[i] * T[l, j]
                                + c[a] * D[l, b] * T[k, i] * n[j]
                                + g * D[k, a] * D[l, b] * n[i] * n[j]
                            )
                    out[3 * a + i, 3 * b + j] = v
