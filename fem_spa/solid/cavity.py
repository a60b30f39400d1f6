"""A cavity's enclosed volume, its gradient and its Hessian: pressure and volume loads are made of them.

With outward normals n of the body on the cavity's faces,  V = -1/3 sum_faces int x . n da.  Written with
t1 = dx/dxi, t2 = dx/deta:  V = -1/3 sum w x . (t1 x t2), a cubic polynomial of the nodal positions that
six points integrate exactly. A pressure p is the potential -p V: follower force p dV/du, tangent p d2V/du2,
symmetric by construction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from skfem import ElementTriP2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri


def triangle_rule(order: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Six-node triangle: weights (n_q,), shape functions and their two derivatives, each (n_q, 6)."""
    xi, weight = get_quadrature(RefTri, order)
    element = ElementTriP2()
    value = np.empty((len(weight), 6))
    d1 = np.empty((len(weight), 6))
    d2 = np.empty((len(weight), 6))
    for a in range(6):
        phi, dphi = element.lbasis(xi, a)
        value[:, a], d1[:, a], d2[:, a] = phi, dphi[0], dphi[1]
    return weight, value, d1, d2


@dataclass(frozen=True)
class Cavity:
    """faces : (k, 6) nodes, oriented out of the body;  origin : a point on every symmetry plane, m."""

    faces: np.ndarray
    origin: np.ndarray

    def volume(self, position: np.ndarray) -> float:
        """m^3 of the meshed part. position : (n_nodes, 3) m"""
        return float(_volume(self.faces, position, self.origin, *_RULE))

    def gradient(self, position: np.ndarray) -> np.ndarray:
        """(k, 18) m^2, node by node: dV/dx of each face's nodes."""
        out = np.zeros((len(self.faces), 18))
        _gradient(self.faces, position, self.origin, *_RULE, out)
        return out

    def hessian(self, position: np.ndarray) -> np.ndarray:
        """(k, 171) m, upper triangles of each face's 18 x 18 block."""
        out = np.zeros((len(self.faces), 171))
        _hessian(self.faces, position, self.origin, *_RULE, out)
        return out


_RULE = triangle_rule(4)


@njit(cache=True)
def _frame(nodes, position, origin, value, d1, d2, x, t1, t2):
    for i in range(3):
        x[i] = -origin[i]
        t1[i] = 0.0
        t2[i] = 0.0
        for a in range(6):
            c = position[nodes[a], i]
            x[i] += value[a] * c
            t1[i] += d1[a] * c
            t2[i] += d2[a] * c


@njit(cache=True)
def _cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def _volume(faces, position, origin, weight, value, d1, d2):
    x = np.empty(3)
    t1 = np.empty(3)
    t2 = np.empty(3)
    n = np.empty(3)
    total = 0.0
    for f in range(len(faces)):
        for q in range(len(weight)):
            _frame(faces[f], position, origin, value[q], d1[q], d2[q], x, t1, t2)
            _cross(t1, t2, n)
            total -= weight[q] / 3.0 * (x[0] * n[0] + x[1] * n[1] + x[2] * n[2])
    return total


@njit(cache=True)
def _gradient(faces, position, origin, weight, value, d1, d2, out):
    x = np.empty(3)
    t1 = np.empty(3)
    t2 = np.empty(3)
    n = np.empty(3)
    m1 = np.empty(3)
    m2 = np.empty(3)
    for f in range(len(faces)):
        for q in range(len(weight)):
            _frame(faces[f], position, origin, value[q], d1[q], d2[q], x, t1, t2)
            _cross(t1, t2, n)
            _cross(t2, x, m1)
            _cross(x, t1, m2)
            for a in range(6):
                for i in range(3):
                    out[f, 3 * a + i] -= (
                        weight[q] / 3.0 * (value[q, a] * n[i] + d1[q, a] * m1[i] + d2[q, a] * m2[i])
                    )


@njit(cache=True)
def _hessian(faces, position, origin, weight, value, d1, d2, out):
    x = np.empty(3)
    t1 = np.empty(3)
    t2 = np.empty(3)
    v = np.empty(3)
    block = np.empty((18, 18))
    for f in range(len(faces)):
        block[:] = 0.0
        for q in range(len(weight)):
            _frame(faces[f], position, origin, value[q], d1[q], d2[q], x, t1, t2)
            for a in range(6):
                for b in range(6):
                    on_t2 = value[q, a] * d1[q, b] - value[q, b] * d1[q, a]
                    on_t1 = value[q, b] * d2[q, a] - value[q, a] * d2[q, b]
                    on_x = d1[q, a] * d2[q, b] - d1[q, b] * d2[q, a]
                    for i in range(3):
                        v[i] = -weight[q] / 3.0 * (on_t2 * t2[i] + on_t1 * t1[i] + on_x * x[i])
                    # block[a i, b k] += epsilon_ikm v_m
                    block[3 * a, 3 * b + 1] += v[2]
                    block[3 * a, 3 * b + 2] -= v[1]
                    block[3 * a + 1, 3 * b] -= v[2]
                    block[3 * a + 1, 3 * b + 2] += v[0]
                    block[3 * a + 2, 3 * b] += v[1]
                    block[3 * a + 2, 3 * b + 1] -= v[0]
        k = 0
        for r in range(18):
            for c in range(r, 18):
                out[f, k] = block[r, c]
                k += 1
