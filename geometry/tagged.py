"""A tagged mesh: what a shape or a file becomes, and all that the solver sees of it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class TaggedMesh:
    """Tetrahedra with named volumes and surfaces, in metres.

    Parameters
    ----------
    points : float array of shape (n_points, 3), m
    tets : int array of shape (n_tets, 4) or (n_tets, 10)
        Right-handed. Ten-node tets in VTK order: corners 0-3, then the middle nodes of the
        edges 01, 12, 02, 03, 13, 23.
    volumes : name -> int array of element numbers. Every tet is in exactly one volume.
    surfaces : name -> int array of shape (n_faces, 3) or (n_faces, 6)
        Node numbers of boundary (or, for `layer ...`, inner) triangles; six-node ones have the
        middle nodes of the edges 01, 12, 20. `cavity ...` faces are oriented with the normal
        pointing out of the body, into the cavity; so are all other boundary faces.
    source : what the mesh was made from, in words
    """

    points: np.ndarray
    tets: np.ndarray
    volumes: dict[str, np.ndarray]
    surfaces: dict[str, np.ndarray]
    source: str = ""
    notes: tuple[str, ...] = field(default=())

    @property
    def cavities(self) -> tuple[str, ...]:
        """Names of the pneumatic networks, without the word `cavity`, sorted."""
        return tuple(sorted(name[7:] for name in self.surfaces if name.startswith("cavity ")))

    @property
    def layers(self) -> tuple[str, ...]:
        """Names of the inner surfaces that carry a membrane, without the word `layer`, sorted."""
        return tuple(sorted(name[6:] for name in self.surfaces if name.startswith("layer ")))

    def hash(self) -> str:
        """SHA-256 over points, tets and groups: the same mesh, the same digest."""
        digest = hashlib.sha256()
        digest.update(np.ascontiguousarray(self.points, dtype="<f8").tobytes())
        digest.update(np.ascontiguousarray(self.tets, dtype="<i8").tobytes())
        for kind in (self.volumes, self.surfaces):
            for name in sorted(kind):
                digest.update(name.encode())
                digest.update(np.ascontiguousarray(kind[name], dtype="<i8").tobytes())
        return digest.hexdigest()
