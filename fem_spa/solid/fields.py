"""Fields at the nodes for a look at them: stretches, Cauchy stress, pressure."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba import njit
from skfem import ElementTetP2

from fem_spa.solid.invariants import principal_values
from fem_spa.solid.kernel import cofactor, deformation_gradient, gather, physical_gradient, squares
from fem_spa.solid.problem import Material, State
from fem_spa.solid.space import Space

_NODES = np.array(
    [
        [0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0, 0],
        [0.5, 0.5, 0], [0, 0.5, 0], [0, 0, 0.5], [0.5, 0, 0.5], [0, 0.5, 0.5],
    ],
    dtype=float,
).T  # fmt: skip
MIDDLE = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])


class NodalFields:
    """Volume-weighted averages of the elements' values at the nodes of a space."""

    def __init__(self, space: Space, materials: Mapping[str, Material]) -> None:
        self.space, self.materials = space, materials
        element = ElementTetP2()
        reference = np.stack([element.lbasis(_NODES, a)[1] for a in range(10)], axis=-1)  # (3, 10 nodes, a)
        self._reference = np.ascontiguousarray(np.swapaxes(reference, 0, 1))  # (10 nodes, 3, a)
        jacobian = self._reference @ space.points[space.tets][:, None]  # dX_j / dxi_i, (n_el, 10, i, j)
        self._inverse = np.ascontiguousarray(np.swapaxes(np.linalg.inv(jacobian), -1, -2))

    def __call__(self, state: State) -> dict[str, np.ndarray]:
        """The fields of one state; may be called from another thread than the solver's.

        Returns
        -------
        `displacement` (n, 3) m; `pressure field` (n,) Pa, positive in tension; `principal stretches` (n, 3),
        largest first; `Cauchy stress` (n, 6) Pa as xx, yy, zz, xy, yz, xz
        """
        space = self.space
        shape = space.tets.shape
        J, I1, I2, b = np.empty(shape), np.empty(shape), np.empty(shape), np.empty((*shape, 6))
        _strain(space.tets, self._inverse, self._reference, state.displacement.ravel(), J, I1, I2, b)
        p = np.empty(space.n_nodes)
        p[: space.n_vertices] = state.pressure_field
        p[space.tets[:, 4:]] = p[space.tets[:, MIDDLE]].mean(axis=2)
        stress = np.empty((*shape, 6))
        for name, material in self.materials.items():
            part = space.region_slices[name]
            W1, W2, *_ = material.law.derivatives(I1[part], I2[part], **material.parameters)
            _cauchy(J[part], I1[part], b[part], W1, W2, p[space.tets[part]], stress[part])
        stretch = np.moveaxis(np.cbrt(J) * np.sqrt(np.maximum(principal_values(I1, I2), 0.0)), 0, -1)
        volume = space.weight.sum(axis=1)
        return {
            "displacement": state.displacement,
            "pressure field": p,
            "principal stretches": _average(space, volume, stretch),
            "Cauchy stress": _average(space, volume, stress),
        }


_PAIRS = np.array([[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [0, 2]])


# Not parallel: it runs beside the solver, on a thread of its own.
@njit(cache=True, nogil=True)
def _strain(tets, inverse, reference, displacement, J, I1, I2, b):
    """J, isochoric invariants and isochoric b = F F^T (six entries) at the ten nodes of every element."""
    u = np.empty((3, 10))
    dN = np.empty((3, 10))
    F = np.empty((3, 3))
    cof = np.empty((3, 3))
    for e in range(tets.shape[0]):
        gather(tets, e, displacement, u)
        for n in range(10):
            physical_gradient(reference[n], inverse[e, n], dN)
            deformation_gradient(dN, u, F)
            det = cofactor(F, cof)
            J[e, n] = det
            if det <= 0.0:
                J[e, n] = np.nan
            m = np.abs(det) ** (-2.0 / 3.0)
            i1, i2 = squares(F, cof)
            I1[e, n] = i1 * m
            I2[e, n] = i2 * m * m
            for k in range(6):
                r = _PAIRS[k, 0]
                c = _PAIRS[k, 1]
                b[e, n, k] = m * (F[r, 0] * F[c, 0] + F[r, 1] * F[c, 1] + F[r, 2] * F[c, 2])


@njit(cache=True, nogil=True)
def _cauchy(J, I1, b, W1, W2, p, out):
    """2/J dev[(W1 + I1 W2) b - W2 b b] + p, six entries."""
    full = np.empty((3, 3))
    for e in range(J.shape[0]):
        for n in range(10):
            for k in range(6):
                full[_PAIRS[k, 0], _PAIRS[k, 1]] = b[e, n, k]
                full[_PAIRS[k, 1], _PAIRS[k, 0]] = b[e, n, k]
            first = 2.0 * (W1[e, n] + I1[e, n] * W2[e, n]) / J[e, n]
            second = 2.0 * W2[e, n] / J[e, n]
            for k in range(6):
                r = _PAIRS[k, 0]
                c = _PAIRS[k, 1]
                square = full[r, 0] * full[0, c] + full[r, 1] * full[1, c] + full[r, 2] * full[2, c]
                out[e, n, k] = first * b[e, n, k] - second * square
            mean = (out[e, n, 0] + out[e, n, 1] + out[e, n, 2]) / 3.0
            for k in range(3):
                out[e, n, k] += p[e, n] - mean


def _average(space: Space, volume: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Elements that are turned inside out at a node (no finite value there) do not count at it."""
    nodes = space.tets.ravel()
    finite = np.isfinite(values).all(axis=-1).ravel()
    weight = np.where(finite, np.repeat(volume, 10), 0.0)
    total = np.bincount(nodes, weight, space.n_nodes)
    columns = [
        np.bincount(nodes, weight * np.where(finite, values[..., k].ravel(), 0.0), space.n_nodes)
        for k in range(values.shape[-1])
    ]
    with np.errstate(invalid="ignore"):
        return np.stack(columns, axis=1) / total[:, None]
