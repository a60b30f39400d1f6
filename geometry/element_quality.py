"""How good the tets of a mesh are: scaled Jacobian at points of the element."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.measures import jacobians
from geometry.tagged import TaggedMesh
from geometry.topology import place

FLAT = 1e-3
"""Scaled Jacobian below which an element counts as flat."""

_C = 0.1381966011250105
_D = 1 - 3 * _C
# Gauss points of degree 2 and 3, the corners, the middles of the edges
SAMPLES = np.array(
    [
        *([_C, _C, _C], [_D, _C, _C], [_C, _D, _C], [_C, _C, _D], [1 / 4] * 3),
        *([1 / 6] * 3, [1 / 2, 1 / 6, 1 / 6], [1 / 6, 1 / 2, 1 / 6], [1 / 6, 1 / 6, 1 / 2]),
        *([0.0] * 3, [1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]),
        *([0.5, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0], [0, 0, 0.5], [0.5, 0, 0.5], [0, 0.5, 0.5]),
    ]
)


@dataclass(frozen=True)
class Quality:
    """Report on the elements of a mesh.

    Attributes
    ----------
    elements, nodes : counts
    worst : smallest scaled Jacobian (1: regular tet; 0: flat; below: inverted)
    worst_element : its number; worst_at : its centre, (3,) m
    mean : mean over the elements of their smallest scaled Jacobian
    inverted, flat : numbers of elements below 0, and from 0 to FLAT
    shortest, longest : edge lengths, m
    """

    elements: int
    nodes: int
    worst: float
    worst_element: int
    worst_at: np.ndarray
    mean: float
    inverted: int
    flat: int
    shortest: float
    longest: float

    def __str__(self) -> str:
        return (
            f"{self.elements} tets, {self.nodes} nodes, scaled Jacobian mean {self.mean:.2f}, "
            f"worst {self.worst:.3g} (element {self.worst_element} at {place(self.worst_at)})"
        )


def scaled_jacobian(mesh: TaggedMesh) -> np.ndarray:
    """Smallest scaled Jacobian of every tet, (n_tets,).

    The Jacobian at 19 points (Gauss points, corners, middles of edges; one for straight tets), times
    sqrt(2) over the cube of the root mean square of the straight edges: 1 for a regular tet.
    """
    corners = mesh.points[mesh.tets[:, :4]]
    at = SAMPLES if mesh.tets.shape[1] == 10 else SAMPLES[4:5]
    smallest = jacobians(mesh.points, mesh.tets, at).min(axis=1)
    square = (_edge_vectors(corners) ** 2).sum(axis=2).mean(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(square > 0, np.sqrt(2) * smallest / square**1.5, 0.0)


def _edge_vectors(corners: np.ndarray) -> np.ndarray:
    return corners[:, [1, 2, 2, 3, 3, 3]] - corners[:, [0, 0, 1, 0, 1, 2]]


def quality(mesh: TaggedMesh) -> Quality:
    """The report on a mesh (see Quality)."""
    value = scaled_jacobian(mesh)
    worst = int(np.argmin(value))
    corners = mesh.points[mesh.tets[:, :4]]
    lengths = np.linalg.norm(_edge_vectors(corners), axis=2)
    return Quality(
        elements=len(mesh.tets),
        nodes=len(mesh.points),
        worst=float(value[worst]),
        worst_element=worst,
        worst_at=corners[worst].mean(axis=0),
        mean=float(value.mean()),
        inverted=int(np.count_nonzero(value < 0)),
        flat=int(np.count_nonzero((value >= 0) & (value < FLAT))),
        shortest=float(lengths.min()),
        longest=float(lengths.max()),
    )
