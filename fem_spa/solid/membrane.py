"""An inextensible layer as a membrane: in-plane stiffness of a thin sheet, no bending.

Green strain of the surface E = (F^T F - 1) / 2 with F (3 x 2) the gradient along an orthonormal frame of
the rest surface; plane stress of a sheet that is linear in E (strains are small, rotations are not):
energy t/2 [ E nu / (1 - nu^2) tr^2 E + E / (1 + nu) E : E ] an area.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from fem_spa.solid.cavity import triangle_rule

# Three points: strain of a flat six-node triangle is quadratic, and full integration would stiffen
# inextensible bending (membrane locking).
_ORDER = 2


@dataclass(frozen=True)
class Membrane:
    """faces : (k, 6) nodes;  gradient : (k, n_q, 2, 6) 1/m;  weight : (k, n_q) m^2
    frame : (k, n_q, 3, 2) orthonormal tangents of the rest surface
    trace, shear : N/m, thickness times E nu / (1 - nu^2) and E / (1 + nu)
    """

    faces: np.ndarray
    gradient: np.ndarray
    weight: np.ndarray
    frame: np.ndarray
    trace: float
    shear: float

    def energy(self, displacement: np.ndarray) -> float:
        """J. displacement : (n_nodes, 3) m"""
        return float(_energy(self._F(displacement), self.weight, self.trace, self.shear))

    def residual(self, displacement: np.ndarray) -> np.ndarray:
        """(k, 18) N, node by node."""
        out = np.zeros((len(self.faces), 18))
        _residual(self._F(displacement), self.gradient, self.weight, self.trace, self.shear, out)
        return out

    def tangent(self, displacement: np.ndarray, stress: np.ndarray | None = None) -> np.ndarray:
        """(k, 171) N/m, upper triangles.

        stress : (k, n_q, 2, 2) N/m to be used in the geometric part instead of that at `displacement`
        """
        if stress is None:
            stress = self.stress(displacement)
        out = np.zeros((len(self.faces), 171))
        _tangent(self._F(displacement), stress, self.gradient, self.weight, self.trace, self.shear, out)
        return out

    def stress(self, displacement: np.ndarray) -> np.ndarray:
        """(k, n_q, 2, 2) N/m, second Piola-Kirchhoff stress times thickness."""
        return self._stress_of(self.strain(displacement))

    def linear_stress(self, displacement: np.ndarray, increment: np.ndarray) -> np.ndarray:
        """The stress at displacement + increment, each (n_nodes, 3), the strain linear in the increment."""
        F = self._F(displacement)
        dF = np.einsum("fai,fqba->fqib", increment[self.faces], self.gradient)
        change = np.einsum("fqia,fqib->fqab", F, dF)
        return self._stress_of(self.strain(displacement) + 0.5 * (change + np.swapaxes(change, -1, -2)))

    def _stress_of(self, strain: np.ndarray) -> np.ndarray:
        trace = strain[..., 0, 0] + strain[..., 1, 1]
        return self.shear * strain + self.trace * trace[..., None, None] * np.eye(2)

    def strain(self, displacement: np.ndarray) -> np.ndarray:
        """(k, n_q, 2, 2) Green strain."""
        F = self._F(displacement)
        return 0.5 * (np.einsum("fqia,fqib->fqab", F, F) - np.eye(2))

    def _F(self, displacement: np.ndarray) -> np.ndarray:
        return self.frame + np.einsum("fai,fqba->fqib", displacement[self.faces], self.gradient)


def make_membrane(
    faces: np.ndarray, points: np.ndarray, modulus: float, thickness: float, poisson: float
) -> Membrane:
    """A sheet of `modulus` (Pa) and `thickness` (m) on the faces (k, 6) of the rest points (n_nodes, 3)."""
    weight, _, d1, d2 = triangle_rule(_ORDER)
    X = points[faces]
    g1 = np.einsum("fai,qa->fqi", X, d1)
    g2 = np.einsum("fai,qa->fqi", X, d2)
    e1 = g1 / np.linalg.norm(g1, axis=-1, keepdims=True)
    normal = np.cross(g1, g2)
    area = np.linalg.norm(normal, axis=-1)
    e2 = np.cross(normal / area[..., None], e1)
    # x_xi = M_1b e_b, so that d/ds_b = (M^-1)_b,alpha d/dxi_alpha
    M = np.stack([np.stack([np.sum(g * e, -1) for e in (e1, e2)], -1) for g in (g1, g2)], -2)
    inverse = np.linalg.inv(M)
    reference = np.stack([d1, d2])  # (alpha, q, a)
    gradient = np.einsum("fqba,aqn->fqbn", inverse, reference)
    return Membrane(
        faces=faces,
        gradient=np.ascontiguousarray(gradient),
        weight=np.ascontiguousarray(area * weight),
        trace=thickness * modulus * poisson / (1 - poisson**2),
        shear=thickness * modulus / (1 + poisson),
        frame=np.ascontiguousarray(np.stack([e1, e2], -1)),
    )


@njit(cache=True)
def _stress(F, trace, shear, E, S):
    for a in range(2):
        for b in range(2):
            E[a, b] = 0.5 * (F[0, a] * F[0, b] + F[1, a] * F[1, b] + F[2, a] * F[2, b])
        E[a, a] -= 0.5
    t = trace * (E[0, 0] + E[1, 1])
    for a in range(2):
        for b in range(2):
            S[a, b] = shear * E[a, b]
        S[a, a] += t


@njit(cache=True)
def _energy(F, weight, trace, shear):
    E = np.empty((2, 2))
    S = np.empty((2, 2))
    total = 0.0
    for f in range(F.shape[0]):
        for q in range(F.shape[1]):
            _stress(F[f, q], trace, shear, E, S)
            total += 0.5 * weight[f, q] * np.sum(E * S)
    return total


@njit(cache=True)
def _residual(F, gradient, weight, trace, shear, out):
    E = np.empty((2, 2))
    S = np.empty((2, 2))
    for f in range(F.shape[0]):
        for q in range(F.shape[1]):
            _stress(F[f, q], trace, shear, E, S)
            for a in range(6):
                for i in range(3):
                    s = 0.0
                    for b in range(2):
                        for c in range(2):
                            s += F[f, q, i, b] * S[b, c] * gradient[f, q, c, a]
                    out[f, 3 * a + i] += weight[f, q] * s


@njit(cache=True)
def _tangent(F, stress, gradient, weight, trace, shear, out):
    B = np.empty((3, 18))
    block = np.empty((18, 18))
    for f in range(F.shape[0]):
        block[:] = 0.0
        for q in range(F.shape[1]):
            S = stress[f, q]
            w = weight[f, q]
            for a in range(6):
                g1 = gradient[f, q, 0, a]
                g2 = gradient[f, q, 1, a]
                for i in range(3):
                    B[0, 3 * a + i] = F[f, q, i, 0] * g1
                    B[1, 3 * a + i] = F[f, q, i, 1] * g2
                    B[2, 3 * a + i] = 0.5 * (F[f, q, i, 0] * g2 + F[f, q, i, 1] * g1)
            for r in range(18):
                for c in range(r, 18):
                    s = (trace + shear) * (B[0, r] * B[0, c] + B[1, r] * B[1, c])
                    s += trace * (B[0, r] * B[1, c] + B[1, r] * B[0, c])
                    s += 2.0 * shear * B[2, r] * B[2, c]
                    if r % 3 == c % 3:
                        a = r // 3
                        b = c // 3
                        for m in range(2):
                            for n in range(2):
                                s += S[m, n] * gradient[f, q, m, a] * gradient[f, q, n, b]
                    block[r, c] += w * s
        k = 0
        for r in range(18):
            for c in range(r, 18):
                out[f, k] = block[r, c]
                k += 1
