"""How the tip moved, read off every converged state: both angles, the way it leans, stroke and chord."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fem_spa.solid.observables import Angle, area_vector, best_rotation
from fem_spa.solid.observe import Silent
from fem_spa.solid.problem import Motion, Problem, Row, State
from fem_spa.solid.space import Space

_LEANS = 1e-5  # rad: less is no direction


class MotionWatch(Silent):
    """The observer that keeps the motion of every state; `motions` in the order of the steps."""

    def __init__(self) -> None:
        self.motions: list[Motion] = []

    def start(self, problem: Problem, space: Space) -> None:
        """Where base, tip and axis are at rest."""
        self.motions = []
        self.face = Angle(replace(problem, angle="tip-face"), space)
        self.line = Angle(replace(problem, angle="chord"), space) if has_base(problem, space) else None
        if not self.face.known:
            return
        zero = np.zeros_like(space.points)
        self.normal = area_vector(space, "tip")
        self.normal /= np.linalg.norm(self.normal)
        self.tip = self.face.tip(zero)
        self.frame = across(self.face.along)

    def memory(self) -> list[dict[str, Any] | None]:
        """What the next motion depends on, besides the shape."""
        if not self.face.known:
            return [None, None]
        return [self.face.memory(), None if self.line is None else self.line.memory()]

    def recall(self, motions: list[Motion], memory: Sequence[Mapping[str, Any] | None]) -> None:
        """Go on after these motions from what `memory` gave."""
        self.motions = motions
        for angle, told in zip((self.face, self.line), memory, strict=True):
            if angle is not None and told is not None:
                angle.recall(told)

    def converged(self, state: State, row: Row, fraction: float = 0.0) -> None:
        """Look at one state; the first is that under the dead loads."""
        self.motions.append(self.look(state.displacement))
        if len(self.motions) == 1 and self.face.known:
            for angle in (self.face, self.line):
                if angle is not None:
                    angle.begin_path(state.displacement)

    def look(self, displacement: np.ndarray) -> Motion:
        """The motion at a displacement ((n_nodes, 3) m)."""
        if not self.face.known:
            return Motion(*[math.nan] * 6)
        tip = self.face.tip(displacement)
        chord, length = math.nan, math.nan
        if self.line is not None:
            chord = self.line(displacement)
            length = float(np.linalg.norm(tip - base_centre(self.line, displacement)))
        tilt, direction = self._lean(displacement)
        return Motion(
            tip_face=self.face(displacement),
            chord=chord,
            tilt=tilt,
            direction=direction,
            extension=float((tip - self.tip) @ self.face.along),
            chord_length=length,
        )

    def _lean(self, displacement: np.ndarray) -> tuple[float, float]:
        """Angle between the tip's normal and its rest, and the direction of what it has across the axis."""
        nodes, weight, points = self.face.tip_nodes, self.face.tip_weight, self.face.points
        rest, moved = points[nodes], points[nodes] + displacement[nodes]
        planes = list(self.face.planes.items())
        normal = best_rotation(weight, rest, moved, planes)[0] @ self.normal
        sine = float(np.linalg.norm(np.cross(self.normal, normal)))
        tilt = math.atan2(sine, float(self.normal @ normal))
        first, second = self.frame
        direction = math.atan2(float(normal @ second), float(normal @ first)) if sine > _LEANS else math.nan
        return tilt, direction


def has_base(problem: Problem, space: Space) -> bool:
    """Whether there is a tip, and a base for the line to it."""
    return "tip" in space.surfaces and ("base" in space.surfaces or bool(problem.fixed))


def base_centre(angle: Angle, displacement: np.ndarray) -> np.ndarray:
    """(3,) m, centroid of the base of the whole actuator."""
    centre = angle.base_weight @ (angle.points + displacement)[angle.base_nodes]
    for i, level in angle.planes.items():
        centre[i] = level
    return centre


def across(along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors across a direction: the coordinate axes that follow its largest component, x y z x."""
    i = int(np.argmax(np.abs(along)))
    first = np.eye(3)[(i + 1) % 3]
    first = first - (first @ along) * along
    first /= np.linalg.norm(first)
    return first, np.cross(along, first) * float(np.sign(along[i]))
