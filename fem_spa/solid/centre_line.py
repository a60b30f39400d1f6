"""The centre line: points of the rest axis, each carried along by the section of the body around it."""

from __future__ import annotations

import numpy as np

from fem_spa.solid.motion import base_centre, has_base
from fem_spa.solid.observables import Angle, best_rotation
from fem_spa.solid.observe import Silent
from fem_spa.solid.problem import Problem, Row, State
from fem_spa.solid.space import Space

POINTS = 41
"""Points of the line, both ends counted."""
_FEWEST = 12  # corner nodes of a section; a thinner one takes more of its neighbours


class CentreLine(Silent):
    """The observer that keeps the centre line of every state.

    The axis goes straight from the base's to the tip's centroid at rest. A section is what lies about one
    of its points, weighted by volume and by a hat over the neighbouring points; its best-fitting rigid motion
    (mirror images in planes of symmetry counted) carries the point.

    Attributes
    ----------
    arc : (n,) m, of the points from the base, at rest; empty where the mesh has no base or no tip
    lines : a state each, (n, 3) m
    """

    def __init__(self, points: int = POINTS) -> None:
        self.points = points
        self.arc = np.zeros(0)
        self.lines: list[np.ndarray] = []

    def start(self, problem: Problem, space: Space) -> None:
        """The sections at rest."""
        self.lines = []
        self.arc = np.zeros(0)
        if not has_base(problem, space):
            return
        angle = Angle(problem, space)
        rest = np.zeros_like(space.points)
        base, tip = base_centre(angle, rest), angle.tip(rest)
        length = float(np.linalg.norm(tip - base))
        self.axis = base + np.linspace(0.0, 1.0, self.points)[:, None] * (tip - base)
        self.planes = list(angle.planes.items())
        self.nodal = space.points
        self.arc = np.linspace(0.0, length, self.points)
        volume = np.zeros(space.n_nodes)
        np.add.at(volume, space.tets[:, :4], np.repeat(space.weight.sum(axis=1)[:, None] / 4, 4, axis=1))
        place = (space.points - base) @ (tip - base) / length
        self.sections = [_section(volume, place, s, length / (self.points - 1)) for s in self.arc]

    def converged(self, state: State, row: Row, fraction: float = 0.0) -> None:
        """Keep the line of one state."""
        self.lines.append(self.line(state.displacement))

    def line(self, displacement: np.ndarray) -> np.ndarray:
        """(n, 3) m, the centre line at a displacement ((n_nodes, 3) m)."""
        out = np.empty((len(self.arc), 3))
        for k in range(len(self.arc)):
            nodes, weight = self.sections[k]
            rest = self.nodal[nodes]
            rotation, before, after = best_rotation(weight, rest, rest + displacement[nodes], self.planes)
            out[k] = after + rotation @ (self.axis[k] - before)
        return out


def _section(volume: np.ndarray, place: np.ndarray, s: float, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of the section at `s` (m along the axis); `place` (n_nodes,) m along the axis."""
    while True:
        weight = volume * np.maximum(0.0, 1.0 - np.abs(place - s) / reach)
        nodes = np.flatnonzero(weight)
        if len(nodes) >= min(_FEWEST, int(np.count_nonzero(volume))):
            return nodes, weight[nodes]
        reach *= 1.5
