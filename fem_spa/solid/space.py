"""The finite-element space: Taylor-Hood P2 displacement, P1 pressure, on scikit-fem's mesh and basis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from skfem import Basis, ElementTetP1, ElementTetP2, MeshTet2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from fem_spa.errors import InputError
from geometry.second_order import to_second_order
from geometry.tagged import TaggedMesh

QUADRATURE_ORDER = 5  # 14 points with positive weights; p (J - 1) on a straight tet is of degree 4


@dataclass(frozen=True)
class Space:
    """Nodes, elements and the geometry at the quadrature points. Corner nodes come first.

    points : (n_nodes, 3) m, vertices before middle nodes;  n_vertices : how many are vertices
    tets : (n_el, 10), VTK order, sorted by region;  region : (n_el,) index into region_names
    region_slices : name -> slice of elements
    surfaces : name -> (k, 6) node numbers, oriented out of the body
    boundary : (k, 6) all boundary faces
    inverse_jacobian : (n_el, n_q, 3, 3), d xi_i / d X_j, 1/m;  weight : (n_el, n_q) m^3
    shape : (n_q, 10), shape_gradient : (n_q, 3, 10) on the reference tet;  pressure_shape : (n_q, 4)
    element_of : (n_el,) element number in the tagged mesh
    node_of : (n_nodes_tagged,) node number here of every node of the second-order tagged mesh
    """

    points: np.ndarray
    n_vertices: int
    tets: np.ndarray
    region: np.ndarray
    region_names: tuple[str, ...]
    region_slices: dict[str, slice]
    surfaces: dict[str, np.ndarray]
    boundary: np.ndarray
    inverse_jacobian: np.ndarray
    weight: np.ndarray
    shape: np.ndarray
    shape_gradient: np.ndarray
    pressure_shape: np.ndarray
    element_of: np.ndarray
    node_of: np.ndarray

    @property
    def n_nodes(self) -> int:
        return len(self.points)

    @property
    def n_dofs(self) -> int:
        """Displacements (3 n_nodes, node by node), then pressures (n_vertices)."""
        return 3 * self.n_nodes + self.n_vertices


def build_space(mesh: TaggedMesh) -> Space:
    """The space of a tagged mesh (4-node tets get straight middle nodes).

    Raises
    ------
    InputError
        An element is in no volume or in two, or its Jacobian is not positive.
    """
    mesh = to_second_order(mesh)
    names = tuple(sorted(mesh.volumes))
    region = np.full(len(mesh.tets), -1)
    for i, name in enumerate(names):
        if np.any(region[mesh.volumes[name]] >= 0):
            raise InputError(
                f"volume '{name}' shares elements with another volume; each element needs just one"
            )
        region[mesh.volumes[name]] = i
    if np.any(region < 0):
        raise InputError(
            f"{np.sum(region < 0)} elements are in no named volume; name all of them in the mesh"
        )
    order = np.argsort(region, kind="stable")
    region = region[order]
    tets = mesh.tets[order]
    slices = {}
    for i, name in enumerate(names):
        lo, hi = np.searchsorted(region, [i, i + 1])
        slices[name] = slice(int(lo), int(hi))

    sk = MeshTet2(mesh.points.T, tets.T)
    dofs = np.ascontiguousarray(sk.dofs.element_dofs.T.astype(np.int64))
    node_of = np.full(len(mesh.points), -1, dtype=np.int64)
    node_of[tets.ravel()] = dofs.ravel()
    n_nodes = int(dofs.max()) + 1
    points = np.ascontiguousarray(sk.doflocs[:, :n_nodes].T)

    quadrature = get_quadrature(RefTet, QUADRATURE_ORDER)
    xi = quadrature[0]
    # scikit-fem's mapping and quadrature; its vector bases would tabulate 30 shape functions an
    # element, so only the scalar ones are evaluated and the kernel does the rest.
    pressure_basis = Basis(sk, ElementTetP1(), quadrature=quadrature)
    mapping = pressure_basis.mapping
    element = ElementTetP2()
    shape = np.empty((xi.shape[1], 10))
    gradient = np.empty((xi.shape[1], 3, 10))
    for a in range(10):
        value, derivative = element.lbasis(xi, a)
        shape[:, a] = value
        gradient[:, :, a] = derivative.T
    pressure_shape = np.stack(
        [ElementTetP1().lbasis(xi, a)[0] * np.ones(xi.shape[1]) for a in range(4)], axis=1
    )
    determinant = mapping.detDF(xi)
    if not np.all(determinant > 0):
        worst = int(np.argmin(determinant.min(axis=1)))
        where = ", ".join(f"{1e3 * c:.2f}" for c in points[dofs[worst, :4]].mean(axis=0))
        raise InputError(
            f"element {order[worst]} at ({where}) mm is inverted or flat "
            f"(Jacobian {determinant[worst].min():.2e} m^3); mesh finer or mend the geometry there"
        )
    inverse = np.ascontiguousarray(np.moveaxis(mapping.invDF(xi), (0, 1), (2, 3)))
    weight = np.ascontiguousarray(pressure_basis.dx)
    surfaces = {name: node_of[faces] for name, faces in mesh.surfaces.items()}
    return Space(
        points=points,
        n_vertices=sk.nvertices,
        tets=dofs,
        region=region,
        region_names=names,
        region_slices=slices,
        surfaces=surfaces,
        boundary=_boundary_faces(dofs),
        inverse_jacobian=inverse,
        weight=weight,
        shape=shape,
        shape_gradient=gradient,
        pressure_shape=pressure_shape,
        element_of=order,
        node_of=node_of,
    )


# Faces of a ten-node tet, corners then the middle nodes of their edges, seen from outside anticlockwise.
FACES = np.array([[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6]])


def _boundary_faces(tets: np.ndarray) -> np.ndarray:
    faces = tets[:, FACES].reshape(-1, 6)
    key = np.sort(faces[:, :3], axis=1)
    n = int(tets.max()) + 1
    code = (key[:, 0] * n + key[:, 1]) * n + key[:, 2]
    _, index, count = np.unique(code, return_index=True, return_counts=True)
    return faces[np.sort(index[count == 1])]
