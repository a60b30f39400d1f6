"""From FE directly: curvature, stretch and stiffness of a short piece of an actuator, against pressure.

A short piece of the actuator is solved with its tip free: a few pitches, the ends clamped to base and plate.
What is read is not the tip but the motion of one section against another, both away from the ends, so that
their stiffening has died out (Saint-Venant): the gauge. A cell of one pitch whose end faces stay plane would
be shorter; the solver has no such support, and between thin walls faces do not stay plane.

Sections move rigidly on average: the best-fitting rotation of what lies about them, weighted by volume. With
R the rotation of the far one against the near one over the rest distance L, its rotation vector over L is the
curvature, and the arc through both, |d| (phi / 2) / sin(phi / 2), gives the stretch.

Bending and axial stiffness come from two runs without pressure: a small dead force on the tip, across and
along. M at the middle of the gauge is force times distance to the tip; a pull beside the line bends, too, and
what the line lengthens by that is taken off.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_spa.errors import InputError
from fem_spa.reduced.rod_law import RodLaw
from fem_spa.reduced.segments import Segments, segments
from fem_spa.solid.observables import Angle, best_rotation
from fem_spa.solid.observe import Observer, Silent
from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, Problem, Row, State, StepControl
from fem_spa.solid.space import Space

POINTS = 10
_SMALL = 1e-3  # bending strain that the stiffness runs aim at


@dataclass(frozen=True)
class SegmentLaw:
    """One chamber of a piece, unloaded. All SI.

    pressure : (m,) Pa, from 0;  curvature : (m,) 1/m, away from the chamber
    stretch : (m,) axial strain of the line through the axis of the drawing
    bending_stiffness, axial_stiffness : N m^2 and N of the whole section at rest; None: it keeps its length
    moment : (m,) N m, what would hold the piece straight: bending stiffness times curvature
    gauge : m, length over which it was read;  source : in words;  status : of the FE run
    """

    pressure: np.ndarray
    curvature: np.ndarray
    stretch: np.ndarray
    bending_stiffness: float
    axial_stiffness: float | None
    gauge: float
    source: str
    status: str = "done"

    @property
    def moment(self) -> np.ndarray:
        """(m,) N m."""
        return self.bending_stiffness * self.curvature

    def segments(self, count: int, pitch: float, mass: float = 0.0) -> Segments:
        """A row of `count` such pieces as the reduced model of kind "segments".

        pitch : m, of one of them;  mass : kg of one
        """
        turn = self.curvature * pitch
        stiff = self.bending_stiffness / pitch
        return segments(self.pressure, turn, self.stretch, stiff, count, pitch, mass, self.source)

    def rod_law(self) -> RodLaw:
        """The law of a rod's chamber: superposes with the other chambers."""
        return RodLaw(
            self.pressure,
            self.curvature,
            self.stretch,
            self.bending_stiffness,
            self.axial_stiffness,
            self.source,
        )


class Gauge(Silent):
    """The observer that keeps the motion of one section against another.

    Parameters
    ----------
    near, far : m from the base along the axis, at rest
    reach : m, half the thickness of what counts as a section
    axis : (2, 3) m, a point of the line whose stretch is read, and its direction; None: from the base's
        centroid to the tip's

    Attributes
    ----------
    places : of the two sections' middles, m from the base
    rotation : a state each, (3,) rotation vector of the far section against the near one, rad
    length : a state each, m, of the arc between them;  rows : the states' history rows
    """

    def __init__(self, near: float, far: float, reach: float, axis: np.ndarray | None = None) -> None:
        if not 0 <= near < far:
            raise InputError(
                f"given a gauge from {1e3 * near:g} to {1e3 * far:g} mm: give the near section first"
            )
        self.near, self.far, self.reach, self.given = near, far, reach, axis
        self.rotation: list[np.ndarray] = []
        self.length: list[float] = []
        self.rows: list[Row] = []

    def start(self, problem: Problem, space: Space) -> None:
        """Find the sections."""
        angle = Angle(replace(problem, angle="tip-face"), space)
        rest = np.zeros_like(space.points)
        tip = angle.tip(rest)
        base = angle.base_weight @ space.points[angle.base_nodes]
        for i, level in angle.planes.items():
            base[i] = level
        self.along = (tip - base) / np.linalg.norm(tip - base)
        self.total = float(np.linalg.norm(tip - base))
        if self.given is not None:
            base, self.along = self.given[0], self.given[1] / np.linalg.norm(self.given[1])
        if self.far > self.total:
            raise InputError(
                f"given a gauge to {1e3 * self.far:g} mm: the piece is {1e3 * self.total:g} mm long"
            )
        self.points = space.points
        self.planes = list(angle.planes.items())
        volume = np.zeros(space.n_nodes)
        np.add.at(volume, space.tets[:, :4], np.repeat(space.weight.sum(axis=1)[:, None] / 4, 4, axis=1))
        place = (space.points - base) @ self.along
        self.sections, self.places = [], []
        for s in (self.near, self.far):
            weight = volume * (np.abs(place - s) <= self.reach)
            nodes = np.flatnonzero(weight)
            if len(nodes) < 4:
                raise InputError(
                    f"the section at {1e3 * s:g} mm has {len(nodes)} nodes within {1e3 * self.reach:g} mm: "
                    "mesh finer, or give a longer reach"
                )
            middle = float(weight[nodes] @ place[nodes] / weight[nodes].sum())
            self.sections.append((nodes, weight[nodes], base + middle * self.along))
            self.places.append(middle)
        self.rotation, self.length, self.rows = [], [], []

    def converged(self, state: State, row: Row, fraction: float = 0.0) -> None:
        """Read the two sections."""
        frames = []
        for nodes, weight, point in self.sections:
            rest = self.points[nodes]
            moved = rest + state.displacement[nodes]
            R, before, after = best_rotation(weight, rest, moved, self.planes)
            frames.append((R, after + R @ (point - before)))
        (R1, c1), (R2, c2) = frames
        turn = rotation_vector(R1.T @ R2)
        phi = float(np.linalg.norm(turn))
        chord = float(np.linalg.norm(c2 - c1))
        self.rotation.append(turn)
        self.length.append(chord / float(np.sinc(phi / (2 * math.pi))))
        self.rows.append(row)

    @property
    def rest_length(self) -> float:
        """m, between the middles of the sections' nodes."""
        return self.places[1] - self.places[0]


def rotation_vector(R: np.ndarray) -> np.ndarray:
    """(3,) rad: axis times angle of a rotation matrix (3, 3), for angles below half a turn."""
    skew = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = float(np.linalg.norm(skew))
    angle = math.atan2(sine, 0.5 * (float(np.trace(R)) - 1.0))
    return skew * (angle / sine if sine > 1e-300 else 1.0)


def chamber_law(
    problem: Problem,
    cavity: str,
    top: float,
    near: float,
    far: float,
    reach: float,
    axis: np.ndarray | None = None,
    steps: StepControl | None = None,
    observers: Sequence[Observer] = (),
    source: str = "",
) -> SegmentLaw:
    """The law of one chamber of a piece.

    Parameters
    ----------
    problem : the piece; its loads are replaced
    cavity : the pressurised one;  top : Pa, largest pressure (below zero: suction)
    near, far, reach, axis : of the `Gauge`

    Raises
    ------
    InputError
        No such cavity, a gauge that is not in the piece, a chamber on the axis, or a first step that fails.
    """
    cavities = problem.mesh.cavities
    if cavity not in cavities:
        raise InputError(f"given cavity {cavity}: the piece has {', '.join(cavities)}")
    points = [{c: top * k / POINTS if c == cavity else 0.0 for c in cavities} for k in range(1, POINTS + 1)]
    gauge = Gauge(near, far, reach, axis)
    free = replace(problem, loads=Loads(points), blocked=False, angle="tip-face")
    result = solve(free, steps, [gauge, *observers])
    if result.status == "interrupted":
        raise KeyboardInterrupt
    away = -_towards(problem, cavity, gauge)
    length = gauge.rest_length
    p = np.array([row.pressure[cavity] for row in gauge.rows])
    bent = np.array([np.cross(turn, gauge.along) @ away for turn in gauge.rotation]) / length
    stretch = np.array(gauge.length) / length - 1.0
    order = np.argsort(p)
    if len(p) < 2:
        raise InputError(f"the piece finds no equilibrium under the first pressure: {result.message}")
    bending, axial = stiffness(problem, near, far, reach, axis, steps, away)
    return SegmentLaw(
        p[order],
        bent[order],
        stretch[order],
        bending,
        axial,
        length,
        source or f"FE of {problem.mesh.source}, chamber {cavity}",
        result.status,
    )


def stiffness(
    problem: Problem,
    near: float,
    far: float,
    reach: float,
    axis: np.ndarray | None = None,
    steps: StepControl | None = None,
    across: np.ndarray | None = None,
) -> tuple[float, float | None]:
    """Bending (N m^2) and axial (N) stiffness at rest between the sections, in the plane of `across` (3,).

    Axial None: the line hardly lengthens at all (it runs along a stiff layer).
    """
    gauge = Gauge(near, far, reach, axis)
    mu = max(m.law.shear_modulus(**m.parameters) for m in problem.materials.values())
    zero = {c: 0.0 for c in problem.mesh.cavities}

    def turned(force: np.ndarray) -> tuple[np.ndarray, float]:
        loads = Loads([zero], tip_force=tuple(map(float, force)))  # type: ignore[arg-type]
        result = solve(replace(problem, loads=loads, blocked=False), steps, [gauge])
        if result.status == "interrupted":
            raise KeyboardInterrupt
        if not gauge.rotation:
            raise InputError(f"the piece bears no small force on its tip: {result.message}")
        return gauge.rotation[0] / gauge.rest_length, gauge.length[0] / gauge.rest_length - 1.0

    # a force that a bar of the body's mean section would bear with a small strain
    extent = np.ptp(problem.mesh.points, axis=0)
    guess = _SMALL * mu * float(np.sort(extent)[0]) ** 2
    gauge.start(problem, _space(problem))
    along = gauge.along
    side = across if across is not None else _side(problem, along)
    about = np.cross(along, side)
    # compliances: curvature and strain of a moment, then strain of a force on the line alone
    push = 0.1 * guess
    curvature, strain = turned(push * side)
    moment = push * (gauge.total - 0.5 * sum(gauge.places))
    bending, cross = moment / float(curvature @ about), strain / moment
    _, strain = turned(guess * along)
    tip = Angle(replace(problem, angle="tip-face"), _space(problem)).tip(np.zeros_like(gauge.points))
    eccentric = guess * float(np.cross(tip - gauge.sections[0][2], along) @ about)
    own = strain - cross * eccentric
    # along an inextensible layer what is left is the sections' warping
    return float(bending), float(guess / own) if own > 0.1 * abs(cross * eccentric) else None


def _space(problem: Problem) -> Space:
    from fem_spa.solid.space import build_space

    return build_space(problem.mesh)


def _side(problem: Problem, along: np.ndarray) -> np.ndarray:
    """A direction across the axis that lies in the planes of symmetry."""
    for i in range(3):
        e = np.eye(3)[i]
        if abs(along[i]) < 0.5 and "xyz"[i] not in problem.symmetry.values():
            return e - (e @ along) * along
    raise InputError("the piece has no direction across its axis that its planes of symmetry allow")


def _towards(problem: Problem, cavity: str, gauge: Gauge) -> np.ndarray:
    """(3,) unit vector across the axis from the middle of the body to the chamber."""
    mesh = problem.mesh
    X = mesh.points[mesh.surfaces[f"cavity {cavity}"][:, :3]]
    area = np.linalg.norm(np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]), axis=1)
    chamber = area @ X.mean(axis=1) / area.sum()
    tets = mesh.points[mesh.tets[:, :4]]
    volume = np.abs(np.linalg.det(tets[:, 1:] - tets[:, :1]))
    body = volume @ tets.mean(axis=1) / volume.sum()
    if gauge.given is not None:
        body = gauge.given[0]
    off = chamber - body
    for axis in problem.symmetry.values():
        off["xyz".index(axis)] = 0.0
    off -= (off @ gauge.along) * gauge.along
    size = float(np.linalg.norm(off))
    if size < 1e-6:
        raise InputError(f"the chamber {cavity} lies on the axis: it stretches the piece without bending it")
    return off / size
