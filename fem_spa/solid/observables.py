"""What is read off a converged state: angle, tip, stretch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fem_spa.errors import InputError
from fem_spa.solid.problem import Problem
from fem_spa.solid.space import Space
from fem_spa.solid.system import AXES

_NOISE = 1e-6  # rad: no rotation to speak of
_CLEAR = 0.02  # rad: a rotation whose axis is no matter of the mesh


class Angle:
    """Bending angle against the rest shape, followed continuously along the path (beyond 180 deg too).

    "tip-face": best-fitting rotation, in the bending plane, of the tip face's corner nodes, each
    weighted with its share of the face's area. "tangent": the same for the last tenth of the body,
    weighted by volume.
    "chord": rotation of the line from the base's to the tip's centroid.

    The bending plane is the symmetry plane that contains the actuator's axis; without one it is the plane
    in which the load path turns the tip away from its shape under the dead loads, held fast once that
    rotation exceeds a degree. Positive angles turn about the normal's positive direction (without a plane:
    that in which its largest component is positive): with y as normal, from +x towards -z.

    Where two planes of symmetry hold the axis it is zero: what one quarter's tip turns, the others turn back.

    Raises InputError where "chord" has neither a surface `base` nor another fixed one to begin at.
    """

    def __init__(self, problem: Problem, space: Space) -> None:
        self.kind = problem.angle
        self.previous = 0.0
        self.known = "tip" in space.surfaces
        if not self.known:
            return
        points = space.points
        tip_weight = corner_areas(space, "tip")
        self.tip_nodes = np.flatnonzero(tip_weight)
        self.tip_weight = tip_weight[self.tip_nodes] / tip_weight.sum()
        tip = self.tip_weight @ points[self.tip_nodes]
        facing = area_vector(space, "tip")
        facing /= np.linalg.norm(facing)
        begin = ["base"] if "base" in space.surfaces else list(problem.fixed)
        if begin:
            base_weight = sum((corner_areas(space, name) for name in begin), np.zeros(space.n_nodes))
            self.base_nodes = np.flatnonzero(base_weight)
            self.base_weight = base_weight[self.base_nodes] / base_weight.sum()
            along = tip - self.base_weight @ points[self.base_nodes]
        elif self.kind == "chord":
            raise InputError(
                'given angle = "chord": it begins at the surface `base`, which the mesh does not have; '
                'name it, or take "tip-face"'
            )
        else:
            along = facing * float(np.ptp(points @ facing))
        # the whole actuator's axis lies in the planes that cut the tip; its centroid does, too
        self.planes: dict[int, float] = {}
        self.axis: np.ndarray | None = None
        for name, axis in problem.symmetry.items():
            i = AXES[axis]
            if abs(facing[i]) < 0.5:
                self.planes[i] = float(points[space.surfaces[name][:, :3], i].mean())
                along[i] = 0.0
                if self.axis is None:
                    self.axis = np.eye(3)[i]
        length = float(np.linalg.norm(along))
        self.along = along / length
        if self.kind == "tangent":
            weight = np.zeros(space.n_nodes)
            np.add.at(weight, space.tets[:, :4], np.repeat(space.weight.sum(axis=1)[:, None], 4, axis=1))
            ahead = (points - tip) @ self.along > -0.1 * length
            self.nodes = np.flatnonzero(ahead & (weight > 0))
            self.weight = weight[self.nodes] / weight[self.nodes].sum()
        else:
            self.nodes, self.weight = self.tip_nodes, self.tip_weight
        self.points = points
        self.reference: np.ndarray | None = None

    def begin_path(self, displacement: np.ndarray) -> None:
        """The shape under the dead loads: from here the load path turns the tip."""
        self.reference = displacement.copy()

    def memory(self) -> dict[str, Any]:
        """What the next angle depends on, besides the shape."""
        if not self.known:
            return {}
        return {"previous": self.previous, "axis": self.axis, "reference": self.reference}

    def recall(self, memory: Mapping[str, Any]) -> None:
        """Go on from what `memory` gave."""
        for name, value in memory.items():
            setattr(self, name, value)

    def tip(self, displacement: np.ndarray) -> np.ndarray:
        """(3,) m, centroid of the tip face of the whole actuator."""
        if not self.known:
            return np.full(3, np.nan)
        tip = self.tip_weight @ (self.points[self.tip_nodes] + displacement[self.tip_nodes])
        for i, level in self.planes.items():
            tip[i] = level
        return tip

    def _marks(self, displacement: np.ndarray) -> np.ndarray:
        """(n, 3) m: what turns, about its mean; for the chord the one line from base to tip."""
        if self.kind != "chord":
            marks = self.points[self.nodes] + displacement[self.nodes]
            return marks - self.weight @ marks
        line = self.tip(displacement) - self.base_weight @ (self.points + displacement)[self.base_nodes]
        for i in self.planes:
            line[i] = 0.0
        return line[None]

    def __call__(self, displacement: np.ndarray) -> float:
        """rad; nan where the mesh has no tip. displacement : (n_nodes, 3) m"""
        if not self.known:
            return float("nan")
        if len(self.planes) > 1:
            return 0.0  # two planes of symmetry hold the axis: the actuator stays straight
        weight = np.ones(1) if self.kind == "chord" else self.weight
        rest, moved = self._marks(np.zeros_like(displacement)), self._marks(displacement)
        axis = self.axis
        if axis is None:
            before = rest if self.reference is None else self._marks(self.reference)
            axis, turned = rotation_axis(weight, before, moved)
            if turned < _NOISE:
                axis, turned = rotation_axis(weight, rest, moved)
                if turned < _NOISE:
                    return 0.0
            elif turned > _CLEAR and self.reference is not None:
                self.axis = axis
        cross = weight @ np.cross(rest, moved)
        in_plane = np.sum(rest * moved, axis=1) - (rest @ axis) * (moved @ axis)
        angle = float(np.arctan2(cross @ axis, weight @ in_plane))
        angle += 2 * np.pi * round((self.previous - angle) / (2 * np.pi))
        self.previous = angle
        return angle


def rotation_axis(weight: np.ndarray, rest: np.ndarray, moved: np.ndarray) -> tuple[np.ndarray, float]:
    """Axis of the best-fitting rotation of points (n, 3) about their mean (Kabsch) and the sine of its angle.

    Of unit length, its largest component positive. One point is a vector: the shortest rotation.
    """
    if len(rest) == 1:
        twist = np.cross(rest[0], moved[0])
        return _unit(twist), float(np.linalg.norm(twist) / np.linalg.norm(rest) / np.linalg.norm(moved))
    rotation = _kabsch((weight[:, None] * rest).T @ moved)
    skew = rotation - rotation.T
    twist = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    return _unit(twist), 0.5 * float(np.linalg.norm(twist))


def best_rotation(
    weight: np.ndarray, rest: np.ndarray, moved: np.ndarray, planes: Sequence[tuple[int, float]] = ()
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Best-fitting rotation (3, 3) of weighted points, and their means at rest and after, each (3,) m.

    Parameters
    ----------
    weight : (n,), any positive sum;  rest, moved : (n, 3) m
    planes : axis number and coordinate (m) of planes of symmetry: the points' mirror images count, too
    """
    weight = weight / weight.sum()
    before, after = weight @ rest, weight @ moved
    for i, level in planes:
        before[i] = after[i] = level
    moment = (weight[:, None] * (rest - before)).T @ (moved - after)
    for i, _ in planes:
        own = moment[i, i]
        moment[i, :] = moment[:, i] = 0.0
        moment[i, i] = own
    return _kabsch(moment), before, after


def _kabsch(moment: np.ndarray) -> np.ndarray:
    """The rotation that fits best: of sum w rest (x) moved, by its singular values (Kabsch 1976)."""
    u, _, vt = np.linalg.svd(moment)
    return vt.T @ np.diag([1.0, 1.0, np.linalg.det(vt.T @ u.T)]) @ u.T


def _unit(twist: np.ndarray) -> np.ndarray:
    size = max(float(np.linalg.norm(twist)), 1e-300)
    return twist / size * np.sign(twist[np.argmax(np.abs(twist))])


def corner_areas(space: Space, surface: str) -> np.ndarray:
    """(n_nodes,) m^2: a third of every (corner) triangle's area to each of its corners."""
    corners = space.surfaces[surface][:, :3]
    X = space.points[corners]
    area = 0.5 * np.linalg.norm(np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]), axis=1)
    weight = np.zeros(space.n_nodes)
    np.add.at(weight, corners, np.repeat(area[:, None] / 3, 3, axis=1))
    return weight


def area_vector(space: Space, surface: str) -> np.ndarray:
    """(3,) m^2, integral of the outward normal over the (corner) triangles."""
    X = space.points[space.surfaces[surface][:, :3]]
    return 0.5 * np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]).sum(axis=0)
