"""Frictionless contact of the boundary with itself, with rigid obstacles and with its own mirror image.

Points of every boundary face (a quadrature rule) are held off the face opposite by a pressure that begins at
the gap `distance`, grows quadratically, is `stiffness` at zero gap and goes on linearly inside. The energy

    1/2 sum_faces sum_q w_q A_q phi(gap_q),   phi' = -pressure,

is taken on both surfaces, half each, so that forces are equal and opposite and the tangent is symmetric. The
law has no wall to infinity, so Newton's iterates may pass through one another and nothing cuts their steps;
the path (path.py) accepts only states in which no point is inside, and raises the stiffness where one is.

Who meets whom is found from the shape: outside with outside, a cavity with itself, normals against one
another. Points that are nearer to an opposite face at rest than `distance` keep a distance of their own, half
their clearance, so that nothing acts at rest. A point counts as inside a face only as deep as both have moved
against one another since the last accepted state, so that no far side is taken for a near one.

Where a point lies equally near to two faces, the force that holds it off lies between their normals, and
Newton's method goes to and fro between them with an error that stays; so it may at an edge, where the force
turns within a few micrometres. It then lets every point keep the face or edge it has, continued a little
beyond its end (`hold`): the state found has the force of one of the two.

Points of the rule lie inside the faces, and walls may cross by a hair between them. So nodes, edges and more
are watched (contact_points.py): where one is found inside something, that point acts from then on (`close`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_spa.errors import InputError
from fem_spa.solid import contact_kernel as kernel
from fem_spa.solid.contact_points import (
    Nearest,
    Pairs,
    across,
    areas,
    face_points,
    looks_at,
    mirror,
    only,
    parts,
    shape_at,
    sides,
)
from fem_spa.solid.obstacle_distance import distance as distance_to
from fem_spa.solid.obstacles import Obstacle, Plane
from fem_spa.solid.pattern import Pattern
from fem_spa.solid.problem import Problem
from fem_spa.solid.space import Space

REACH = 0.5  # of the element size: how far a neighbour is looked for, outside and inside
_SKIN = 0.25  # of the element size: how far nodes may move before neighbours are looked for anew
_PATTERN = 0.25  # of the element size: pairs nearer than this get their place in the sparsity pattern


@dataclass(frozen=True)
class Touching:
    """Contact at one shape.

    force : (n_nodes, 3) N, gradient of the contact energy;  highest : Pa, largest contact pressure
    inside : m, deepest point inside something, >= 0;  on_obstacles : (n_obstacles, 3) N, of the meshed part
    """

    force: np.ndarray
    highest: float
    inside: float
    on_obstacles: np.ndarray


class Contact:
    """Contact of one space's boundary.

    Parameters
    ----------
    space : the space
    symmetry : surface -> axis of the planes that mirror the body; they are walls for what is not on them
    obstacles : rigid bodies
    itself : whether the boundary meets itself
    distance : gap at which contact pressure begins, m
    stiffness : contact pressure at zero gap, Pa
    size : element size, m

    Raises
    ------
    InputError
        The body is inside an obstacle at rest.
    """

    def __init__(
        self,
        space: Space,
        symmetry: Mapping[str, str],
        obstacles: tuple[Obstacle, ...],
        itself: bool,
        distance: float,
        stiffness: float,
        size: float,
    ) -> None:
        plane = {tuple(sorted(f[:3])) for name in symmetry for f in space.surfaces[name].tolist()}
        keep = [tuple(sorted(f[:3])) not in plane for f in space.boundary.tolist()]
        self.faces = np.ascontiguousarray(space.boundary[keep])
        self._across = across(self.faces)
        self.n_nodes = space.n_nodes
        self.distance, self.stiffness, self.size = distance, stiffness, size
        self.itself = itself
        self.obstacles = obstacles
        self.side = sides(space, self.faces)
        self.loose = itself and parts(space.tets) > 1
        self.longest_motion = 0.4 * REACH * size
        points, weights, regular = face_points()
        self.shape = shape_at(points)
        rest = space.points
        self.weight = areas(self.faces, rest, points) * weights
        self.acts = np.zeros(self.weight.shape, dtype=bool)
        self.acts[:, :regular] = True
        self._regular = self.acts.copy()
        self.hold = False
        self.accept(rest)
        self._rest_distance(rest)
        self._built: np.ndarray | None = None
        # rigid things: what, and the faces that can meet it
        self._meets = [(o, self.side == 0) for o in obstacles]
        for name, axis in symmetry.items():
            on_it = np.unique(space.surfaces[name])
            away = ~np.isin(self.faces, on_it).any(axis=1)
            self._meets.append((mirror(axis, rest, on_it), away))
        self._rigid = self._meeting(self.acts)
        for k, (obstacle, outside) in enumerate(self._rigid[: len(obstacles)]):
            gap = distance_to(obstacle, self._places(rest, outside))[0].min(initial=np.inf)
            if gap < -0.02 * size:
                raise InputError(
                    f"obstacle {k + 1} is {-1e3 * gap:.3g} mm inside the body at rest; move it away, or turn "
                    "its normal round if it is a plane"
                )

    def memory(self) -> dict[str, Any]:
        """What the next evaluation depends on, besides the shape."""
        return {
            "stiffness": self.stiffness,
            "accepted": self._accepted,
            "built": self._built,
            "added": self.added,
        }

    def recall(self, memory: Mapping[str, Any]) -> None:
        """Go on from what `memory` gave: with the same neighbours, found from the same shape."""
        self.stiffness = memory["stiffness"]
        self._accepted = memory["accepted"]
        self.add(memory["added"])
        if memory["built"] is not None and self.itself:
            self._find(memory["built"], (REACH + _SKIN) * self.size)

    @property
    def added(self) -> np.ndarray:
        """(n,) numbers of the watched points that act."""
        return np.flatnonzero(self.acts & ~self._regular)

    def _watched(self, faces: np.ndarray) -> np.ndarray:
        """(n_faces, m), the watched points of faces (n,) that do not act."""
        of = np.zeros((len(self.faces), 1), dtype=bool)
        of[faces] = True
        return of & ~self.acts

    def add(self, points: np.ndarray) -> None:
        """Let watched points act, by their numbers (n,)."""
        self.acts.ravel()[points] = True
        self._rigid = self._meeting(self.acts)
        self._built = None

    def _meeting(self, which: np.ndarray) -> list[tuple[Obstacle, np.ndarray]]:
        """Rigid things and those of the points (n_faces, m) that can meet them."""
        return [(thing, np.flatnonzero(which & of[:, None])) for thing, of in self._meets]

    def accept(self, position: np.ndarray) -> None:
        """A state (n_nodes, 3) m in which nothing is inside anything: what comes is judged from there."""
        self._accepted = position.copy()

    def _rest_distance(self, rest: np.ndarray) -> None:
        """Each point's own distance of activation."""
        self.own_distance = np.full(self.weight.size, self.distance)
        if not self.itself:
            return
        wide = REACH * self.size
        pairs = self._pairs(np.ones_like(self.acts), rest, wide)
        near = self._nearest(pairs, rest, wide)
        own = np.minimum(self.distance, 0.5 * np.where(near.face >= 0, near.gap, np.inf))
        self.own_distance[pairs.points] = np.where(own < 0.1 * self.distance, 0.0, own)

    # -- neighbours ------------------------------------------------------------------------------

    def _pairs(self, which: np.ndarray, position: np.ndarray, reach: float) -> Pairs:
        """Which of the points (n_faces, m) have which faces opposite, within `reach`."""
        points, others = kernel.opposite(self.faces, self.side, self.shape, which, position, reach)
        points, first = np.unique(points, return_index=True)
        return Pairs(points, np.append(first, len(others)).astype(np.int64), others)

    def _find(self, position: np.ndarray, reach: float) -> None:
        self._kept = self._pairs(self.acts, position, reach)
        self._points = self._kept.points
        self._built = position.copy()
        self._last: Nearest | None = None

    def _nearest(self, pairs: Pairs, position: np.ndarray, reach: float) -> Nearest:
        n = len(pairs.points)
        found = Nearest(
            face=np.full(n, -1, dtype=np.int64),
            kind=np.zeros(n, dtype=np.int64),
            edge=np.zeros(n, dtype=np.int64),
            place=np.zeros((n, 2)),
            gap=np.full(n, np.inf),
            normal=np.zeros((n, 3)),
        )
        begin, others = pairs.begin, pairs.others
        held = np.zeros(n, dtype=bool)
        if self.hold and self._last is not None and pairs is self._kept:
            last = self._last
            held = last.face >= 0
            begin, others = only(last.face, begin, others)
            found.kind[:], found.edge[:], found.place[:] = last.kind, last.edge, last.place
        flat = np.empty((len(self.faces), 3))
        corner = np.zeros((self.n_nodes, 3))
        kernel.flat_normals(self.faces, position, flat)
        kernel.corner_normals(self.faces, flat, corner)
        kernel.nearest(
            self.faces,
            self._across,
            self.shape,
            position,
            self._accepted,
            flat,
            corner,
            pairs.points,
            begin,
            others,
            REACH * self.size,
            reach,
            held,
            found.face,
            found.kind,
            found.edge,
            found.place,
            found.gap,
            found.normal,
        )
        return found

    def _look(self, position: np.ndarray, reach: float) -> Nearest:
        """The nearest opposite faces within `reach`, from the kept neighbours as long as they hold."""
        skin = _SKIN * self.size
        moved = np.inf if self._built is None else np.abs(position - self._built).max() * 2.0 * np.sqrt(3.0)
        if moved > skin:
            self._find(position, (REACH + _SKIN) * self.size)
        return self._nearest(self._kept, position, reach)

    # -- energy, forces, tangent -----------------------------------------------------------------

    def _places(self, position: np.ndarray, points: np.ndarray) -> np.ndarray:
        """(n, 3) m, where the points are."""
        m = len(self.shape)
        return np.einsum("na,nai->ni", self.shape[points % m], position[self.faces[points // m]])

    def evaluate(self, position: np.ndarray) -> Touching:
        """Forces at position (n_nodes, 3) m."""
        force = np.zeros((self.n_nodes, 3))
        highest, inside = 0.0, 0.0
        if self.itself:
            near = self._look(position, self.distance)
            self._last = near
            own = self.own_distance[self._points]
            highest = kernel.forces(
                self.faces,
                self.shape,
                self.weight,
                self._points,
                own,
                self.stiffness,
                near.face,
                near.place,
                near.gap,
                near.normal,
                np.empty(6),
                force,
            )
            acting = (near.face >= 0) & (own > 0) & (near.gap < own)
            inside = float(max(0.0, -near.gap[acting].min(initial=0.0)))
        on = np.zeros((len(self.obstacles), 3))
        m = len(self.shape)
        for k, (obstacle, points) in enumerate(self._rigid):
            near_points, gap, normal, _ = self._at(obstacle, points, position)
            if len(near_points) == 0:
                continue
            p, _ = self._pressure(gap)
            highest, inside = max(highest, float(p.max())), max(inside, float(-gap.min()))
            push = (p * self.weight.ravel()[near_points])[:, None] * normal
            for a in range(6):
                np.add.at(
                    force, self.faces[near_points // m, a], -self.shape[near_points % m, a][:, None] * push
                )
            if k < len(on):
                on[k] = -push.sum(axis=0)
        return Touching(force, highest, inside, on)

    def _at(self, obstacle: Obstacle, points: np.ndarray, position: np.ndarray):
        """Those of the points that the obstacle pushes: numbers, gaps, normals, Hessians of the gap."""
        gap, normal, hessian = distance_to(obstacle, self._places(position, points))
        act = gap < self.distance
        return points[act], gap[act], normal[act], hessian[act]

    def _pressure(self, gap: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        part = 1.0 - gap / self.distance
        k, d = self.stiffness, self.distance
        p = np.where(gap >= 0, k * part**2, k * (1.0 - 2.0 * gap / d))
        return p, np.where(gap >= 0, -2.0 * k * part / d, -2.0 * k / d)

    def add_tangent(self, position: np.ndarray, pattern: Pattern, data: np.ndarray) -> bool:
        """Add the second derivative to data (N/m) of the pattern's upper triangle.

        Returns False where the pattern has no place for a pair; data is of no use then.
        """
        complete = True
        if self.itself:
            near = self._last if self._last is not None else self._look(position, self.distance)
            complete = kernel.tangent(
                self.faces,
                self.shape,
                self.weight,
                position,
                self._points,
                self.own_distance[self._points],
                self.stiffness,
                near.face,
                near.kind,
                near.edge,
                near.place,
                near.gap,
                near.normal,
                pattern.number,
                pattern.indptr,
                pattern.indices,
                data,
            )
        m = len(self.shape)
        for obstacle, points in self._rigid:
            near_points, gap, normal, hessian = self._at(obstacle, points, position)
            p, slope = self._pressure(gap)
            N = self.shape[near_points % m]
            w = self.weight.ravel()[near_points]
            outer = normal[:, :, None] * normal[:, None, :]
            inner = -w[:, None, None] * (slope[:, None, None] * outer + p[:, None, None] * hessian)
            blocks = np.einsum("na,nij,nb->naibj", N, inner, N).reshape(len(w), 18, 18)
            for f, block in zip(self.faces[near_points // m], blocks, strict=True):
                kernel.scatter(f, block, pattern.number, pattern.indptr, pattern.indices, data)
        return bool(complete)

    def too_soft(self, touching: Touching) -> bool:
        """Is a point inside something, or so near to it that the next step would bring it there?"""
        return touching.inside > 0.0 or touching.highest > 0.9 * self.stiffness

    def close(self, position: np.ndarray) -> bool:
        """Let watched points act that are inside something at position (n_nodes, 3) m; whether any was."""
        found = []
        if self.itself:
            near = self._look(position, _PATTERN * self.size)
            use = near.face >= 0
            beside = self._watched(np.append(self._points[use] // len(self.shape), near.face[use]))
            pairs = self._pairs(beside, position, _PATTERN * self.size)
            watched = self._nearest(pairs, position, self.distance)
            own = self.own_distance[pairs.points]
            found.append(pairs.points[(watched.face >= 0) & (own > 0) & (watched.gap < 0)])
        for thing, points in self._meeting(~self.acts):
            found.append(points[distance_to(thing, self._places(position, points))[0] < 0])
        inside = np.unique(np.concatenate(found)) if found else np.zeros(0, dtype=np.int64)
        if len(inside) == 0:
            return False
        self.add(inside)
        return True

    def reach(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns (unknowns) of all pairs of faces that touch or may soon."""
        m = len(self.shape)
        found = []
        for near in (self._look(position, self.distance), self._look(position, _PATTERN * self.size)):
            use = near.face >= 0
            found.append(np.stack([self._points[use] // m, near.face[use]], axis=1))
        pairs = np.unique(np.concatenate(found), axis=0)
        a = self.faces[pairs[:, 0]]
        b = self.faces[pairs[:, 1]]
        da = (3 * a[:, :, None] + np.arange(3)).reshape(len(a), 18)
        db = (3 * b[:, :, None] + np.arange(3)).reshape(len(b), 18)
        rows = np.repeat(da, 18, axis=1).ravel()
        columns = np.tile(db, (1, 18)).ravel()
        return rows, columns

    def gap(self, position: np.ndarray) -> float:
        """Smallest gap at position (n_nodes, 3) m, inf where nothing is near. Nothing depends on it.

        Of the boundary to itself: of faces that share no node, and of those that do (the sides of a fold meet
        at its edge anyhow) where contact acts between them. To obstacles. To the planes of symmetry: of faces
        that look at them, or on which they act. Watched points count on the faces that are nearest.
        """
        gap, m, reach, slack = np.inf, len(self.shape), REACH * self.size, _PATTERN * self.size
        if self.itself:
            near = self._look(position, reach)
            gaps = self._counted(self._points, near)
            gap = gaps.min(initial=np.inf)
            first = gaps < gap + slack
            beside = self._watched(np.append(self._points[first] // m, near.face[first]))
            pairs = self._pairs(beside, position, reach)
            watched = self._counted(pairs.points, self._nearest(pairs, position, reach))
            gap = min(gap, watched.min(initial=np.inf))
        for k, (thing, points) in enumerate(self._rigid):
            away = distance_to(thing, self._places(position, points))[0]
            first = np.unique(points[away < away.min(initial=np.inf) + slack] // m)
            points = np.append(points, np.flatnonzero(self._watched(first)))
            away = distance_to(thing, self._places(position, points))[0]
            if k >= len(self.obstacles) and isinstance(thing, Plane):  # of symmetry
                looks = looks_at(self.faces, position, thing)[points // m] & (away < reach)
                away = away[looks | (self.acts.ravel()[points] & (away < self.distance))]
            gap = min(gap, away.min(initial=np.inf))
        return float(gap)

    def _counted(self, points: np.ndarray, near: Nearest) -> np.ndarray:
        """(n,) m, the gaps that `gap` counts, of points (n,); inf for the others."""
        own, other = self.faces[points // len(self.shape)], self.faces[near.face]
        apart = ~(own[:, :, None] == other[:, None, :]).any(axis=(1, 2))
        acting = self.acts.ravel()[points] & (near.gap < self.own_distance[points])
        return np.where((near.face >= 0) & (apart | acting), near.gap, np.inf)


def contact_of(problem: Problem, space: Space, part: float, size: float, modulus: float) -> Contact:
    """A problem's contact: the distance follows from the smaller faces' size, the stiffness from the loads.

    part : distance of activation over the size of the smaller faces;  size : element size, m
    modulus : stiffest shear modulus, Pa
    """
    X = space.points[space.boundary[:, :3]]
    areas = np.linalg.norm(np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]), axis=1)
    smaller = float(np.sqrt(np.percentile(areas, 5)))
    loads = problem.loads
    stiffness = 0.02 * modulus
    if loads.control == "pressure":
        highest = max((abs(p) for point in loads.points for p in point.values()), default=0.0)
        stiffness = max(4.0 * highest, 1e-3 * modulus)
    return Contact(
        space, problem.symmetry, problem.obstacles, problem.contact, part * smaller, stiffness, size
    )
