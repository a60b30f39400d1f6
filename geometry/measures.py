"""Volumes, areas and area vectors of a tagged mesh, exact for its curved elements."""

from __future__ import annotations

import numpy as np

from geometry.tagged import TaggedMesh

# Grundmann-Moeller, degree 3: exact for the Jacobian of a ten-node tet
_TET_POINTS = np.array(
    [[1 / 4] * 3, [1 / 6] * 3, [1 / 2, 1 / 6, 1 / 6], [1 / 6, 1 / 2, 1 / 6], [1 / 6, 1 / 6, 1 / 2]]
)
_TET_WEIGHTS = np.array([-4 / 5, 9 / 20, 9 / 20, 9 / 20, 9 / 20]) / 6

# Dunavant, degree 4
_A, _B = 0.445948490915965, 0.091576213509771
_TRI_POINTS = np.array(
    [[_A, _A], [1 - 2 * _A, _A], [_A, 1 - 2 * _A], [_B, _B], [1 - 2 * _B, _B], [_B, 1 - 2 * _B]]
)
_TRI_WEIGHTS = np.array([0.223381589678011] * 3 + [0.109951743655322] * 3) / 2


def tet_gradients(at: np.ndarray, nodes: int) -> np.ndarray:
    """Derivatives of a 4- or 10-node tet's shape functions, (n_at, nodes, 3), at local points (n_at, 3)."""
    corner = np.array([[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    if nodes == 4:
        return np.broadcast_to(corner, (len(at), 4, 3)).copy()
    value = np.column_stack([1 - at.sum(axis=1), at])
    out = np.empty((len(at), 10, 3))
    out[:, :4] = (4 * value - 1)[:, :, None] * corner
    for k, (i, j) in enumerate(((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))):
        out[:, 4 + k] = 4 * (value[:, i, None] * corner[j] + value[:, j, None] * corner[i])
    return out


def jacobians(points: np.ndarray, tets: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Determinant of the Jacobian of every tet at local points (n_at, 3): (n_tets, n_at), m^3."""
    gradients = tet_gradients(at, tets.shape[1])
    return np.linalg.det(np.einsum("ena,qnb->eqab", points[tets], gradients, optimize=True))


def tet_volumes(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Volume of every tet, m^3, negative where it is inverted as a whole."""
    return jacobians(points, tets, _TET_POINTS) @ _TET_WEIGHTS


def _triangle_shape(at: np.ndarray, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Values (n_at, nodes) and derivatives (n_at, nodes, 2) of a 3- or 6-node triangle's functions."""
    value = np.column_stack([1 - at.sum(axis=1), at])
    corner = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    if nodes == 3:
        return value, np.broadcast_to(corner, (len(at), 3, 2)).copy()
    pairs = ((0, 1), (1, 2), (2, 0))
    middle = np.column_stack([4 * value[:, i] * value[:, j] for i, j in pairs])
    slope = np.empty((len(at), 6, 2))
    slope[:, :3] = (4 * value - 1)[:, :, None] * corner
    for k, (i, j) in enumerate(pairs):
        slope[:, 3 + k] = 4 * (value[:, i, None] * corner[j] + value[:, j, None] * corner[i])
    return np.column_stack([value * (2 * value - 1), middle]), slope


def _sampled(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and normals (times area weight) at the quadrature points, both (n_faces, n_at, 3)."""
    value, slope = _triangle_shape(_TRI_POINTS, faces.shape[1])
    x = points[faces]
    tangents = np.einsum("fna,qnb->fqab", x, slope, optimize=True)
    normal = np.cross(tangents[..., 0], tangents[..., 1]) * _TRI_WEIGHTS[None, :, None]
    return np.einsum("fna,qn->fqa", x, value, optimize=True), normal


def area_vectors(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Area vector of every (curved) triangle, (n_faces, 3), m^2."""
    return _sampled(points, faces)[1].sum(axis=1)


def face_areas(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Area of every (curved) triangle, m^2."""
    return np.linalg.norm(_sampled(points, faces)[1], axis=2).sum(axis=1)


def flux(points: np.ndarray, faces: np.ndarray, origin: np.ndarray) -> float:
    """Integral of (x - origin) . n / 3 over the faces, m^3: the volume inside, where they are closed."""
    x, normal = _sampled(points, faces)
    return float(np.sum((x - origin) * normal) / 3)


def body_volume(mesh: TaggedMesh, name: str | None = None) -> float:
    """Volume of a named part of the mesh, or of all of it, m^3."""
    tets = mesh.tets if name is None else mesh.tets[mesh.volumes[name]]
    return float(tet_volumes(mesh.points, tets).sum())


def area(mesh: TaggedMesh, name: str) -> float:
    """Area of a named surface, m^2."""
    return float(face_areas(mesh.points, mesh.surfaces[name]).sum())


def symmetry_names(mesh: TaggedMesh) -> tuple[str, ...]:
    """Names of the surfaces that are planes of symmetry: `symmetry`, `symmetry x`, ..."""
    return tuple(sorted(n for n in mesh.surfaces if n == "symmetry" or n.startswith("symmetry ")))


def symmetry_origin(mesh: TaggedMesh) -> np.ndarray:
    """A point, (3,) m, that lies in every plane of symmetry of the mesh."""
    names = symmetry_names(mesh)
    centre = mesh.points.mean(axis=0)
    if not names:
        return centre
    normals, offsets = [], []
    for name in names:
        total = area_vectors(mesh.points, mesh.surfaces[name]).sum(axis=0)
        normal = total / np.linalg.norm(total)
        normals.append(normal)
        offsets.append(normal @ (mesh.points[mesh.surfaces[name][0, 0]] - centre))
    step, *_ = np.linalg.lstsq(np.array(normals), np.array(offsets), rcond=None)
    return centre + step


def cavity_volume(mesh: TaggedMesh, name: str) -> float:
    """Volume that a cavity encloses in the model (half of it, where the model is a half), m^3."""
    return -flux(mesh.points, mesh.surfaces[f"cavity {name}"], symmetry_origin(mesh))
