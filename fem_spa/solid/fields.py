"""Fields at the nodes for a look at them: stretches, Cauchy stress, pressure."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from skfem import ElementTetP2

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


def deformation_gradients(space: Space, displacement: np.ndarray) -> np.ndarray:
    """F at the ten nodes of every element, (n_el, 10, 3, 3). displacement : (n_nodes, 3) m"""
    element = ElementTetP2()
    reference = np.stack([element.lbasis(_NODES, a)[1] for a in range(10)], axis=-1)  # (3, 10 nodes, a)
    X = space.points[space.tets]
    u = displacement[space.tets]
    jacobian = np.einsum("eai,jna->enij", X, reference)
    slope = np.einsum("eai,jna->enij", u, reference)
    return np.eye(3) + slope @ np.linalg.inv(jacobian)


def nodal_fields(space: Space, materials: Mapping[str, Material], state: State) -> dict[str, np.ndarray]:
    """Volume-weighted averages of the elements' values at each node.

    Returns
    -------
    `displacement` (n, 3) m; `pressure field` (n,) Pa, positive in tension; `principal stretches` (n, 3),
    largest first; `Cauchy stress` (n, 6) Pa as xx, yy, zz, xy, yz, xz
    """
    F = deformation_gradients(space, state.displacement)
    J = np.linalg.det(F)
    J = np.where(J > 0, J, np.nan)
    C = np.swapaxes(F, -1, -2) @ F
    isochoric = C * np.cbrt(J)[..., None, None] ** -2
    I1 = np.trace(isochoric, axis1=-2, axis2=-1)
    I2 = 0.5 * (I1**2 - np.einsum("enij,enij->en", isochoric, isochoric))
    p = np.empty(space.n_nodes)
    p[: space.n_vertices] = state.pressure_field
    p[space.tets[:, 4:]] = p[space.tets[:, MIDDLE]].mean(axis=2)
    stress = np.empty_like(F)
    b = F @ np.swapaxes(F, -1, -2) * np.cbrt(J)[..., None, None] ** -2
    for name, material in materials.items():
        part = space.region_slices[name]
        W1, W2, *_ = material.law.derivatives(I1[part], I2[part], **material.parameters)
        bp = b[part]
        t = 2 * ((W1 + I1[part] * W2)[..., None, None] * bp - W2[..., None, None] * (bp @ bp))
        t -= np.trace(t, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3)
        stress[part] = t / J[part][..., None, None]
    stress += p[space.tets][..., None, None] * np.eye(3)
    finite = np.where(np.isfinite(C), C, 0.0)
    stretch = np.sqrt(np.maximum(np.linalg.eigvalsh(finite)[..., ::-1], 0.0))
    six = stress[..., [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    volume = space.weight.sum(axis=1)
    return {
        "displacement": state.displacement,
        "pressure field": p,
        "principal stretches": _average(space, volume, stretch),
        "Cauchy stress": _average(space, volume, six),
    }


def _average(space: Space, volume: np.ndarray, values: np.ndarray) -> np.ndarray:
    nodes = space.tets.ravel()
    weight = np.repeat(volume, 10)
    total = np.bincount(nodes, weight, space.n_nodes)
    columns = [
        np.bincount(nodes, weight * values[..., k].ravel(), space.n_nodes) / total
        for k in range(values.shape[-1])
    ]
    return np.stack(columns, axis=1)
