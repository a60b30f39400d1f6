"""Loops of contact: which faces lie opposite which points, how far, with which force and tangent.

A point is a quadrature point of a boundary face. It meets the nearest face that looks at it: of the same
side of the wall (outside, or the same cavity) and with a normal against its own.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from fem_spa.solid.closest_point import EDGE, INSIDE, closest, closest_of_kind, normal_at, second_derivative
from fem_spa.solid.closest_point import shape as _shape

FACING = -0.2  # cosine between the normals of two surfaces that can meet


@njit(cache=True)
def flat_normals(faces, X, out):
    """Unit normal of every face's corners, out of the body, (n_faces, 3)."""
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        p0, p1, p2 = X[b, 0] - X[a, 0], X[b, 1] - X[a, 1], X[b, 2] - X[a, 2]
        q0, q1, q2 = X[c, 0] - X[a, 0], X[c, 1] - X[a, 1], X[c, 2] - X[a, 2]
        n0, n1, n2 = p1 * q2 - p2 * q1, p2 * q0 - p0 * q2, p0 * q1 - p1 * q0
        size = (n0 * n0 + n1 * n1 + n2 * n2) ** 0.5
        out[f, 0], out[f, 1], out[f, 2] = n0 / size, n1 / size, n2 / size


@njit(cache=True)
def boxes(faces, X, reach, low, high):
    """Boxes round the faces, larger by `reach` on every side."""
    for f in range(len(faces)):
        for i in range(3):
            lo = hi = X[faces[f, 0], i]
            for a in range(1, 6):
                v = X[faces[f, a], i]
                lo, hi = min(lo, v), max(hi, v)
            bulge = 0.25 * (hi - lo)
            low[f, i], high[f, i] = lo - reach - bulge, hi + reach + bulge


@njit(cache=True)
def _cells(low, high, start, size, shape, fill, cell_faces, write):
    """Count (or write) the faces of each cell of a grid."""
    for f in range(len(low)):
        a0, b0 = _span(low[f, 0], high[f, 0], start[0], size, shape[0])
        a1, b1 = _span(low[f, 1], high[f, 1], start[1], size, shape[1])
        a2, b2 = _span(low[f, 2], high[f, 2], start[2], size, shape[2])
        for i in range(a0, b0 + 1):
            for j in range(a1, b1 + 1):
                for k in range(a2, b2 + 1):
                    cell = (i * shape[1] + j) * shape[2] + k
                    if write:
                        cell_faces[fill[cell]] = f
                    fill[cell] += 1


@njit(cache=True)
def _span(low, high, start, size, count):
    a = int(np.floor((low - start) / size))
    b = int(np.floor((high - start) / size))
    return max(a, 0), min(b, count - 1)


@njit(cache=True)
def _on(shape, face, other):
    """Is the point of a face, given by its shape functions (6,), a point of the other one, too?"""
    for a in range(6):
        if shape[a] != 0.0:
            shared = False
            for b in range(6):
                if other[b] == face[a]:
                    shared = True
            if not shared:
                return False
    return True


@njit(cache=True)
def opposite(faces, side, shape, acts, X, reach):
    """Pairs (point, face) that look at one another within `reach`, sorted by point.

    faces : (n_faces, 6);  side : (n_faces,), equal where two faces may meet;  shape : (m, 6) at the points of
    a face;  acts : (n_faces, m), which points count;  X : (n_nodes, 3). Points are numbered face by face.
    """
    nf, m = len(faces), len(shape)
    normal = np.empty((nf, 3))
    flat_normals(faces, X, normal)
    low, high = np.empty((nf, 3)), np.empty((nf, 3))
    boxes(faces, X, reach, low, high)
    start = np.array([low[:, 0].min(), low[:, 1].min(), low[:, 2].min()])
    end = np.array([high[:, 0].max(), high[:, 1].max(), high[:, 2].max()])
    size = (high - low).mean()
    while np.prod(np.ceil((end - start) / size)) > 2e6:
        size *= 1.5
    cells = np.maximum(np.ceil((end - start) / size), 1.0).astype(np.int64)
    fill = np.zeros(cells[0] * cells[1] * cells[2] + 1, dtype=np.int64)
    _cells(low, high, start, size, cells, fill, np.empty(0, dtype=np.int64), False)
    begin = np.zeros(len(fill), dtype=np.int64)
    for k in range(len(fill) - 1):
        begin[k + 1] = begin[k] + fill[k]
    cell_faces = np.empty(begin[-1], dtype=np.int64)
    fill[:] = begin
    _cells(low, high, start, size, cells, fill, cell_faces, True)
    capacity = 1024
    points = np.empty(capacity, dtype=np.int64)
    others = np.empty(capacity, dtype=np.int64)
    found = 0
    x = np.empty(3)
    for f in range(nf):
        for q in range(m):
            if not acts[f, q]:
                continue
            for i in range(3):
                x[i] = 0.0
                for a in range(6):
                    x[i] += shape[q, a] * X[faces[f, a], i]
            cell = 0
            for i in range(3):
                c = int(np.floor((x[i] - start[i]) / size))
                cell = cell * cells[i] + min(max(c, 0), cells[i] - 1)
            for k in range(begin[cell], begin[cell + 1]):
                o = cell_faces[k]
                if o == f or side[o] != side[f]:
                    continue
                if (
                    normal[f, 0] * normal[o, 0] + normal[f, 1] * normal[o, 1] + normal[f, 2] * normal[o, 2]
                    > FACING
                ):
                    continue
                if x[0] < low[o, 0] or x[0] > high[o, 0] or x[1] < low[o, 1] or x[1] > high[o, 1]:
                    continue
                if x[2] < low[o, 2] or x[2] > high[o, 2] or _on(shape[q], faces[f], faces[o]):
                    continue
                if found == capacity:
                    capacity *= 2
                    larger = np.empty(capacity, dtype=np.int64)
                    larger[:found] = points
                    points = larger
                    larger = np.empty(capacity, dtype=np.int64)
                    larger[:found] = others
                    others = larger
                points[found] = f * m + q
                others[found] = o
                found += 1
    return points[:found], others[:found]


@njit(cache=True)
def _corner(s, t):
    return 1 if s > 0.5 else (2 if t > 0.5 else 0)


@njit(cache=True)
def _level_apart(x, Y, reach):
    """Is x further than that from the plane of the face's corners, its bulge counted in?"""
    p0, p1, p2 = Y[1, 0] - Y[0, 0], Y[1, 1] - Y[0, 1], Y[1, 2] - Y[0, 2]
    q0, q1, q2 = Y[2, 0] - Y[0, 0], Y[2, 1] - Y[0, 1], Y[2, 2] - Y[0, 2]
    n0, n1, n2 = p1 * q2 - p2 * q1, p2 * q0 - p0 * q2, p0 * q1 - p1 * q0
    size = (n0 * n0 + n1 * n1 + n2 * n2) ** 0.5
    bulge = 0.0
    for a in range(3, 6):
        h = n0 * (Y[a, 0] - Y[0, 0]) + n1 * (Y[a, 1] - Y[0, 1]) + n2 * (Y[a, 2] - Y[0, 2])
        bulge += 2.0 * abs(h) / size
    level = (n0 * (x[0] - Y[0, 0]) + n1 * (x[1] - Y[0, 1]) + n2 * (x[2] - Y[0, 2])) / size
    return abs(level) > reach + bulge


@njit(cache=True)
def corner_normals(faces, normals, out):
    """Sums of the normals of the faces at each node, into out (n_nodes, 3) of zeros."""
    for f in range(len(faces)):
        for a in range(3):
            for i in range(3):
                out[faces[f, a], i] += normals[f, i]


@njit(cache=True, parallel=True)
def nearest(
    faces,
    across,
    shape,
    X,
    before,
    flat,
    corner,
    points,
    begin,
    others,
    depth,
    reach,
    held,
    face,
    kind,
    edge,
    place,
    gap,
    normal,
):
    """The nearest of each point's opposite faces.

    across : (n_faces, 3) the face behind each edge, or itself;  flat, corner : normals of faces and at nodes.
    On an edge or at a corner their sum tells outside from inside (Baerentzen and Aanaes, Signed Distance
    Computation Using the Angle Weighted Pseudonormal, IEEE Trans. Vis. Comput. Graph. 11, 2005).
    X, before : (n_nodes, 3) m now and in the last state that was accepted; a point is inside a face only as
    deep as both have moved against one another since, so that no far side is taken for a near one
    points : (n,) point numbers;  others[begin[k]:begin[k+1]] its faces;  depth, reach : m, how far inside and
    outside is looked;  held : (n,), points that keep their feature, its kind and edge in the results
    Results (n, ...): face or -1, kind of feature, its edge, (s, t), gap (m, negative inside), normal from the
    face to the point.
    """
    m = len(shape)
    for k in prange(len(points)):
        f, q = points[k] // m, points[k] % m
        x = np.zeros(3)
        for i in range(3):
            for a in range(6):
                x[i] += shape[q, a] * X[faces[f, a], i]
        N, dN, T, r, n = np.empty(6), np.empty((2, 6)), np.empty((2, 3)), np.empty(3), np.empty(3)
        Y = np.empty((6, 3))
        face[k] = -1
        best = np.inf
        for j in range(begin[k], begin[k + 1]):
            o = others[j]
            limit = min(max(reach, depth), best)
            apart = False
            for i in range(3):
                lo = hi = X[faces[o, 0], i]
                for a in range(6):
                    v = X[faces[o, a], i]
                    Y[a, i] = v
                    lo, hi = min(lo, v), max(hi, v)
                bulge = 0.25 * (hi - lo)
                if x[i] < lo - bulge - limit or x[i] > hi + bulge + limit:
                    apart = True
            if apart or _level_apart(x, Y, limit):
                continue
            if held[k]:
                what, e, s, t, square = closest_of_kind(
                    kind[k], edge[k], place[k, 0], place[k, 1], x, Y, N, dN, T, r
                )
            else:
                what, e, s, t, square = closest(x, Y, N, dN, T, r)
            distance = square**0.5
            if distance >= best:
                continue
            normal_at(Y, s, t, dN, T, n)
            side = r[0] * n[0] + r[1] * n[1] + r[2] * n[2]
            if what != INSIDE:
                side = 0.0
                for i in range(3):
                    if what == EDGE:
                        side += r[i] * (flat[o, i] + flat[across[o, e], i])
                    else:
                        side += r[i] * corner[faces[o, _corner(s, t)], i]
            g = distance
            if side < 0.0:
                g = -distance
                _shape(s, t, N)
                motion = 0.0
                for i in range(3):
                    v = r[i]
                    for a in range(6):
                        v += N[a] * before[faces[o, a], i] - shape[q, a] * before[faces[f, a], i]
                    motion += v * v
                if motion < square:
                    continue
            if what != INSIDE and distance > 0.0:
                for i in range(3):
                    n[i] = r[i] / g
            best = distance
            face[k], kind[k], edge[k], gap[k] = o, what, e, g
            place[k, 0], place[k, 1] = s, t
            for i in range(3):
                normal[k, i] = n[i]
        # the nearest of all decides, also where it is out of reach: the sign at a farther edge means nothing
        if face[k] >= 0 and (gap[k] > reach or gap[k] < -depth):
            face[k] = -1


@njit(cache=True)
def pressure(gap, distance, stiffness):
    """Contact pressure (Pa) and its derivative by the gap (Pa/m): quadratic up to zero gap, then linear."""
    if gap >= distance:
        return 0.0, 0.0
    if gap >= 0.0:
        part = 1.0 - gap / distance
        return stiffness * part * part, -2.0 * stiffness * part / distance
    return stiffness * (1.0 - 2.0 * gap / distance), -2.0 * stiffness / distance


@njit(cache=True)
def forces(faces, shape, weight, points, distance, stiffness, face, place, gap, normal, N, out):
    """Add the contact forces to out (n_nodes, 3): of the energy's gradient, N; N (6,) is room to work in."""
    m = len(shape)
    highest = 0.0
    for k in range(len(points)):
        o = face[k]
        if o < 0 or distance[k] == 0.0 or gap[k] >= distance[k]:
            continue
        f, q = points[k] // m, points[k] % m
        p, _ = pressure(gap[k], distance[k], stiffness)
        highest = max(highest, p)
        p *= 0.5 * weight[f, q]
        s, t = place[k, 0], place[k, 1]
        _shape(s, t, N)
        for a in range(6):
            for i in range(3):
                out[faces[f, a], i] -= p * shape[q, a] * normal[k, i]
                out[faces[o, a], i] += p * N[a] * normal[k, i]
    return highest


@njit(cache=True)
def _at(indptr, indices, i, j):
    lo, hi = indptr[i], indptr[i + 1]
    while hi - lo > 1:
        middle = (lo + hi) // 2
        if indices[middle] <= j:
            lo = middle
        else:
            hi = middle
    return lo


@njit(cache=True)
def scatter(nodes, block, number, indptr, indices, data):
    """Add a symmetric block (3 k, 3 k) of nodes (k,) to the upper triangle; False if a place is missing."""
    k = len(nodes)
    complete = True
    for a in range(k):
        for i in range(3):
            row = number[3 * nodes[a] + i]
            if row < 0:
                continue
            for b in range(k):
                for j in range(3):
                    column = number[3 * nodes[b] + j]
                    if column < row:
                        continue
                    at = _at(indptr, indices, row, column)
                    if indices[at] == column:
                        data[at] += block[3 * a + i, 3 * b + j]
                    else:
                        complete = False
    return complete


@njit(cache=True)
def tangent(
    faces,
    shape,
    weight,
    X,
    points,
    distance,
    stiffness,
    face,
    kind,
    edge,
    place,
    gap,
    normal,
    number,
    indptr,
    indices,
    data,
):
    """Add the second derivative of the contact energy to data; False where the pattern lacks a pair."""
    m = len(shape)
    H = np.empty((36, 36))
    N, dN, T, D = np.empty(6), np.empty((2, 6)), np.empty((2, 3)), np.empty((2, 12))
    c, Y = np.empty(12), np.empty((6, 3))
    nodes = np.empty(12, dtype=np.int64)
    complete = True
    for k in range(len(points)):
        o = face[k]
        if o < 0 or distance[k] == 0.0 or gap[k] >= distance[k]:
            continue
        f, q = points[k] // m, points[k] % m
        p, slope = pressure(gap[k], distance[k], stiffness)
        w = 0.5 * weight[f, q]
        s, t = place[k, 0], place[k, 1]
        _shape(s, t, N)
        for a in range(6):
            c[a], c[6 + a] = shape[q, a], -N[a]
            nodes[a], nodes[6 + a] = faces[f, a], faces[o, a]
            for i in range(3):
                Y[a, i] = X[faces[o, a], i]
        n = normal[k]
        second_derivative(c, Y, kind[k], edge[k], s, t, gap[k], n, dN, T, D, H)
        for a in range(12):
            for b in range(12):
                for i in range(3):
                    for j in range(3):
                        r, v = 3 * a + i, 3 * b + j
                        H[r, v] = w * (-slope * c[a] * c[b] * n[i] * n[j] - p * H[r, v])
        if not scatter(nodes, H, number, indptr, indices, data):
            complete = False
    return complete
