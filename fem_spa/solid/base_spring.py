"""A clamp on a rotational spring: the held faces turn as one by a compliance times the dead loads' moment.

The unknowns of the system stay those of a body whose base is held fast. The clamp's turn theta (a rotation
vector about the centroid of the held faces) enters by the dead loads alone, which in the turned frame pull
the other way: f' = R(theta)^T f. The moment of all loads about the centre is that of the dead loads on the
body as it is bent: the pressure in closed cavities has none, nor have walls that touch one another. At every
iterate

    theta = c M,   M = sum over nodes of a x R(theta)^T f,   a from the centre in the turned frame

is solved for theta (M is the same in both frames, as it stands on the axis). Newton's tangent leaves out how
theta hangs on the nodes, which Broyden's updates make up for. What is told to the outside is turned.
"""

from __future__ import annotations

import math

import numpy as np

from fem_spa.errors import InputError
from fem_spa.solid.problem import Problem
from fem_spa.solid.space import Space

AXES = {"x": 0, "y": 1, "z": 2}
CLOSE = 1e-13
"""rad."""
MOST = 60


class BaseSpring:
    """The clamp of one problem.

    Parameters
    ----------
    dead : (n_dofs,) N of the meshed part, its dead loads whole;  copies : of it that make the whole actuator
    """

    def __init__(self, problem: Problem, space: Space, dead: np.ndarray, copies: int) -> None:
        self.compliance = problem.base_compliance
        self.points = space.points
        self.centre = _centroid(problem, space)
        self.dead = dead
        self.force = dead[: 3 * space.n_nodes].reshape(-1, 3)
        # of mirror images only what turns in every plane of symmetry adds up
        self.copies = np.full(3, float(copies))
        for axis in set(problem.symmetry.values()):
            self.copies[[i for i in range(3) if i != AXES[axis]]] = 0.0
        self.last = np.zeros(3)

    def turn(self, displacement: np.ndarray, factor: float = 1.0) -> np.ndarray:
        """(3,) rad about the centre of a body so displaced (n_nodes, 3) in the turned frame; not finite where
        none is found. factor : of the dead loads"""
        lever = self.points + displacement - self.centre
        T = factor * np.einsum("ki,kj->ij", lever, self.force)
        theta = self.last.copy()
        for _ in range(MOST):
            g = self._left(T, theta)
            if np.max(np.abs(g)) < CLOSE:
                self.last = theta
                return theta
            slope = np.stack(
                [(self._left(T, theta + h) - self._left(T, theta - h)) / 2e-6 for h in _STEPS], 1
            )
            step = np.linalg.solve(slope, -g)
            theta = theta + step * min(1.0, 0.5 / max(float(np.max(np.abs(step))), 1e-300))
        return np.full(3, math.nan)

    def _left(self, T: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """c M - theta."""
        B = T @ rotation(theta)
        M = np.array([B[1, 2] - B[2, 1], B[2, 0] - B[0, 2], B[0, 1] - B[1, 0]])
        return np.asarray(self.compliance * self.copies * M - theta)

    def turned(self, displacement: np.ndarray, factor: float) -> np.ndarray:
        """(n_dofs,) the dead loads in the turned frame; to be multiplied by `factor`."""
        if factor == 0.0:
            return self.dead
        out = self.dead.copy()
        out[: self.force.size] = (self.force @ rotation(self.turn(displacement, factor))).ravel()
        return out

    def seen(self, displacement: np.ndarray) -> np.ndarray:
        """(n_nodes, 3) m from the stand's frame."""
        lever = self.points + displacement - self.centre
        return np.asarray(lever @ rotation(self.turn(displacement)).T + self.centre - self.points)


_STEPS = 1e-6 * np.eye(3)


def spring_of(problem: Problem, space: Space, dead: np.ndarray, copies: int) -> BaseSpring | None:
    """The clamp's spring; None where the clamp is fast."""
    return BaseSpring(problem, space, dead, copies) if problem.base_compliance > 0.0 else None


def rotation(theta: np.ndarray) -> np.ndarray:
    """(3, 3) rotation by a vector (3,) rad."""
    size = float(np.linalg.norm(theta))
    K = np.array([[0.0, -theta[2], theta[1]], [theta[2], 0.0, -theta[0]], [-theta[1], theta[0], 0.0]])
    if not size > 1e-5:
        return np.asarray(np.eye(3) + K + 0.5 * K @ K)
    return np.asarray(np.eye(3) + math.sin(size) / size * K + (1.0 - math.cos(size)) / size**2 * K @ K)


def at_rest(problem: Problem, pull: float, tip: float) -> float:
    """N m about the base of the whole level body: its weight at `pull` m/s^2, a force of `tip` N on its end.

    InputError where it has weight and a material has no density.
    """
    from fem_spa.solid.space import build_space

    space = build_space(problem.mesh)
    centre = _centroid(problem, space)
    far = np.zeros(3)
    if pull:
        copies = 2 ** len(set(problem.symmetry.values()))
        points = np.einsum("qa,eai->eqi", space.shape, space.points[space.tets]) - centre
        for name in space.region_names:
            density, part = problem.materials[name].density, space.region_slices[name]
            if density is None:
                raise InputError(f"materials.{name}.density is missing: gravity acts on the base")
            far += pull * density * copies * np.einsum("eq,eqi->i", space.weight[part], points[part])
    length = float(np.linalg.norm(space.points - centre, axis=1).max())
    return float(np.linalg.norm(far)) + tip * length


def check_base(problem: Problem) -> list[str]:
    """Warnings of a compliant base.

    Raises
    ------
    InputError
        It goes with something that stands still beside the actuator, or there is nothing to turn about.
    """
    if problem.base_compliance == 0.0:
        return []
    beside = {
        "loads.obstacles": bool(problem.obstacles),
        "loads.tip_displacement": problem.loads.tip_displacement is not None,
        "observe.blocked": problem.blocked,
    }
    for key, there in beside.items():
        if there:
            raise InputError(
                f"given supports.base_compliance with {key}: a base that turns is solved for free actuators "
                "only; leave one of them out"
            )
    if not problem.fixed:
        raise InputError(
            "given supports.base_compliance with supports.fixed empty: there is no base to turn; name one"
        )
    if any(problem.loads.gravity) or any(problem.loads.tip_force):
        return []
    return [
        "supports.base_compliance does nothing here: without gravity or tip_force a free actuator leaves no "
        "moment at its base, whatever the pressure."
    ]


def _centroid(problem: Problem, space: Space) -> np.ndarray:
    """(3,) m, of the held faces."""
    from fem_spa.solid.observables import corner_areas

    weight = sum((corner_areas(space, name) for name in problem.fixed), np.zeros(space.n_nodes))
    return np.asarray(weight @ space.points / weight.sum())
