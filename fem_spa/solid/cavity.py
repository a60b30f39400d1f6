"""A cavity's enclosed volume, its gradient and its Hessian: pressure and volume loads are made of them.

With outward normals n of the body on the cavity's faces,  V = - sum_faces int (D (x - o)) . n da  with any
diagonal D of trace 1. With t1 = dx/dxi, t2 = dx/deta and y = D (x - o):  V = - sum w y . (t1 x t2), a cubic
polynomial of the nodal positions that six points integrate exactly. Planes of symmetry close the surface
without being meshed: they add nothing where o lies on them, or where D is zero along their normal (two
parallel planes). A pressure p is the potential -p V: follower force p dV/du, tangent p d2V/du2, symmetric
by construction.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numba import njit
from skfem import ElementTriP2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from fem_spa.errors import InputError


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
    """faces : (k, 6) nodes, oriented out of the body;  origin : (3,) o, m;  share : (3,) diagonal of D."""

    faces: np.ndarray
    origin: np.ndarray
    share: np.ndarray

    def volume(self, position: np.ndarray) -> float:
        """m^3 of the meshed part. position : (n_nodes, 3) m"""
        return float(_volume(self.faces, position, self.origin, self.share, *_RULE))

    def gradient(self, position: np.ndarray) -> np.ndarray:
        """(k, 18) m^2, node by node: dV/dx of each face's nodes."""
        out = np.zeros((len(self.faces), 18))
        _gradient(self.faces, position, self.origin, self.share, *_RULE, out)
        return out

    def hessian(self, position: np.ndarray) -> np.ndarray:
        """(k, 171) m, upper triangles of each face's 18 x 18 block."""
        out = np.zeros((len(self.faces), 171))
        _hessian(self.faces, position, self.origin, self.share, *_RULE, out)
        return out


_RULE = triangle_rule(4)


def plane_levels(
    symmetry: Mapping[str, str], surfaces: Mapping[str, np.ndarray], points: np.ndarray
) -> dict[int, list[float]]:
    """Axis number -> coordinates (m) of the planes of symmetry normal to it. symmetry : surface -> axis"""
    levels: dict[int, list[float]] = {}
    for name, axis in symmetry.items():
        i = "xyz".index(axis)
        levels.setdefault(i, []).append(float(points[surfaces[name][:, :3], i].mean()))
    return levels


def closing(levels: Mapping[int, list[float]]) -> tuple[np.ndarray, np.ndarray]:
    """Origin (m) and shares with which planes of symmetry close a cavity, each (3,).

    Raises
    ------
    InputError
        There are two parallel planes along each of x, y and z.
    """
    origin, share = np.zeros(3), np.ones(3)
    for i, where in levels.items():
        origin[i] = where[0]
        if np.ptp(where) > 1e-9:
            share[i] = 0.0
    if not share.any():
        raise InputError(
            "pairs of parallel symmetry planes along x, y and z leave no direction in which a cavity's "
            "volume can be told; take one plane away"
        )
    return origin, share / share.sum()


@njit(cache=True)
def _frame(nodes, position, origin, share, value, d1, d2, y, t1, t2):
    for i in range(3):
        y[i] = -origin[i]
        t1[i] = 0.0
        t2[i] = 0.0
        for a in range(6):
            c = position[nodes[a], i]
            y[i] += value[a] * c
            t1[i] += d1[a] * c
            t2[i] += d2[a] * c
        y[i] *= share[i]


@njit(cache=True)
def _cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def _volume(faces, position, origin, share, weight, value, d1, d2):
    y = np.empty(3)
    t1 = np.empty(3)
    t2 = np.empty(3)
    n = np.empty(3)
    total = 0.0
    for f in range(len(faces)):
        for q in range(len(weight)):
            _frame(faces[f], position, origin, share, value[q], d1[q], d2[q], y, t1, t2)
            _cross(t1, t2, n)
            total -= weight[q] * (y[0] * n[0] + y[1] * n[1] + y[2] * n[2])
    return total


@njit(cache=True)
def _gradient(faces, position, origin, share, weight, value, d1, d2, out):
    y = np.empty(3)
    t1 = np.empty(3)
    t2 = np.empty(3)
    n = np.empty(3)
    m1 = np.empty(3)
    m2 = np.empty(3)
    for f in range(len(faces)):
        for q in range(len(weight)):
            _frame(faces[f], position, origin, share, value[q], d1[q], d2[q], y, t1, t2)
            _cross(t1, t2, n)
            _cross(t2, y, m1)
            _cross(y, t1, m2)
            for a in range(6):
                for i in range(3):
                    out[f, 3 * a + i] -= weight[q] * (
                        value[q, a] * share[i] * n[i] + d1[q, a] * m1[i] + d2[q, a] * m2[i]
                    )


@njit(cache=True)
def _hessian(faces, position, origin, share, weight, value, d1, d2, out):
    y = np.empty(3)
    t1 = np.empty(3)
    t2 = np.empty(3)
    block = np.empty((18, 18))
    for f in range(len(faces)):
        block[:] = 0.0
        for q in range(len(weight)):
            _frame(faces[f], position, origin, share, value[q], d1[q], d2[q], y, t1, t2)
            for a in range(6):
                for b in range(6):
                    ab1 = value[q, a] * d1[q, b]
                    ba1 = value[q, b] * d1[q, a]
                    ab2 = value[q, a] * d2[q, b]
                    ba2 = value[q, b] * d2[q, a]
                    on_y = d1[q, a] * d2[q, b] - d1[q, b] * d2[q, a]
                    # block[a i, b k] -= w epsilon_ikm v_m; (i, k, m) cyclic is +, (k, i, m) is -
                    for m in range(3):
                        i = (m + 1) % 3
                        k = (m + 2) % 3
                        on_t2 = share[i] * ab1 - share[k] * ba1
                        on_t1 = share[k] * ba2 - share[i] * ab2
                        block[3 * a + i, 3 * b + k] -= weight[q] * (
                            on_t2 * t2[m] + on_t1 * t1[m] + on_y * y[m]
                        )
                        on_t2 = share[k] * ab1 - share[i] * ba1
                        on_t1 = share[i] * ba2 - share[k] * ab2
                        block[3 * a + k, 3 * b + i] += weight[q] * (
                            on_t2 * t2[m] + on_t1 * t1[m] + on_y * y[m]
                        )
        k = 0
        for r in range(18):
            for c in range(r, 18):
                out[f, k] = block[r, c]
                k += 1
