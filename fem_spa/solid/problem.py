"""What is to be solved: mesh, materials, loads, supports. Data only; `solve` in path.py works on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fem_spa.solid.obstacles import Obstacle
from geometry.tagged import TaggedMesh
from materials.card import Card
from materials.laws import Law


@dataclass(frozen=True)
class Material:
    """A law with its numbers.

    Parameters
    ----------
    law : the energy W(I1, I2) and its derivatives
    parameters : name -> value in SI (Pa or dimensionless), every parameter of the law
    bulk : bulk modulus in Pa, positive; `inf` is exactly incompressible
    density : kg/m^3, needed where gravity acts
    card : where the numbers are from, if from a card; elements that leave its range are warned of
    """

    law: Law
    parameters: Mapping[str, float]
    bulk: float = float("inf")
    density: float | None = None
    card: Card | None = None


@dataclass(frozen=True)
class Layer:
    """An inextensible sheet as a membrane on an inner surface: in-plane stiffness, no bending.

    Parameters
    ----------
    modulus : Young's modulus, Pa
    thickness : m
    poisson : Poisson's ratio, in (-1, 0.5]
    """

    modulus: float
    thickness: float
    poisson: float = 0.3


@dataclass(frozen=True)
class Loads:
    """Load path.

    Parameters
    ----------
    points : load points in order, each cavity -> value; the last is the end of the path. Each is
        hit exactly. Values are Pa (`control` pressure), m^3 of the whole actuator's enclosed
        volume (`volume`), or the ratio of enclosed gas mass to that at rest (`gas-mass`).
    control : "pressure", "volume" or "gas-mass"
    gravity : m/s^2, applied before the first load point
    tip_force : dead force on the surface `tip`, N, applied with gravity; on the whole face where planes of
        symmetry cut it, and on each tip where one mirrors it to another end
    tip_displacement : prescribed displacement of every node of `tip`, m, applied with gravity
    atmosphere : absolute pressure outside, Pa (used by `gas-mass` only)
    """

    points: Sequence[Mapping[str, float]]
    control: str = "pressure"
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tip_force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tip_displacement: tuple[float, float, float] | None = None
    atmosphere: float = 101325.0


@dataclass(frozen=True)
class Problem:
    """Mesh + laws + loads + supports.

    Parameters
    ----------
    mesh : tagged mesh in metres
    materials : volume name -> material, one for every volume of the mesh
    layers : layer name (without the word `layer`) -> membrane
    loads : the load path
    fixed : surfaces whose nodes do not move
    symmetry : surface -> "x", "y" or "z": the normal of the plane in which its nodes stay
    angle : "tip-face", "chord" or "tangent"
    blocked : the tip is held where it is once gravity has acted; its reaction is observed
    contact : the boundary cannot pass through itself
    obstacles : rigid bodies that the boundary cannot enter, whatever `contact` says
    base_compliance : rad/(N m), by which the fixed surfaces turn as one under the moment of the dead loads
    linear : pictures and sentences tell the stroke, not the angle; nothing solved depends on it
    """

    mesh: TaggedMesh
    materials: Mapping[str, Material]
    loads: Loads
    layers: Mapping[str, Layer] = field(default_factory=dict)
    fixed: tuple[str, ...] = ("base",)
    symmetry: Mapping[str, str] = field(default_factory=dict)
    angle: str = "tip-face"
    blocked: bool = False
    contact: bool = False
    obstacles: tuple[Obstacle, ...] = ()
    linear: bool = False
    base_compliance: float = 0.0


@dataclass(frozen=True)
class StepControl:
    """How the load path is walked; the answer does not depend on it.

    Parameters
    ----------
    imposed_steps : this many equal increments a stretch between load points instead of automatic ones
    tolerance : dimensionless residual at which a step counts as converged
    max_iterations : Newton iterations after which a step is cut
    min_fraction : smallest increment, as a fraction of the stretch between two load points
    stop_at_touch : end the path before the step in which walls would pass through one another
    contact_distance : gap at which contact pressure begins, over the size of the smaller boundary faces
    renew_always : factorize at every iteration: full Newton, quadratic to the end, and slower
    factors : the linear solver's: "double", "single" precision, "auto" (single where double will not fit)
    """

    imposed_steps: int | None = None
    tolerance: float = 1e-8
    max_iterations: int = 15
    min_fraction: float = 1e-4
    stop_at_touch: bool = False
    contact_distance: float = 0.0133
    renew_always: bool = False
    factors: str = "auto"


@dataclass(frozen=True)
class State:
    """One converged equilibrium.

    displacement : (n_nodes, 3) m, at the nodes of the second-order mesh
    pressure_field : (n_vertices,) Pa, Lagrange multiplier p (positive in tension), at the corner nodes
    cavity_pressure : cavity -> Pa;  cavity_volume : cavity -> m^3 of the whole actuator
    contact_points : numbers of the watched points at which contact acts, too (contact_points.py)
    """

    step: int
    displacement: np.ndarray
    pressure_field: np.ndarray
    cavity_pressure: Mapping[str, float]
    cavity_volume: Mapping[str, float]
    contact_points: tuple[int, ...] = ()


@dataclass(frozen=True)
class Motion:
    """The tip face of one state against its rest; nan where the mesh does not tell.

    tip_face : rad, as the deck's `tip-face`;  chord : rad, as its `chord`
    tilt : rad, from 0 to pi, between the tip face's normal and its rest, about whatever axis
    direction : rad, where that normal leans to, across the actuator's axis: for an axis along z from +x to
        +y, along x from +y to +z, along y from +z to +x
    extension : m, of the tip's centroid along the actuator's axis;  chord_length : m, from base to tip
    """

    tip_face: float
    chord: float
    tilt: float
    direction: float
    extension: float
    chord_length: float


@dataclass(frozen=True)
class Row:
    """The history row of one converged load step, SI.

    angle : rad;  tip : (3,) m, mean position of the tip face;  volume : m^3, enclosed by all cavities
    force : N, reaction of the blocked or prescribed tip, else None;  force_vector : its components
    is_point : whether this row is a load point that the deck names
    gap : m, the smallest distance of the boundary to itself or to an obstacle, where contact is watched
    obstacle_force : (n_obstacles, 3) N, what the whole actuator exerts on each obstacle
    motion : how the tip moved, once an observer (motion.MotionWatch) has looked
    """

    step: int
    pressure: Mapping[str, float]
    angle: float
    tip: np.ndarray
    volume: float
    max_stretch: float
    force: float | None
    iterations: int
    is_point: bool
    force_vector: np.ndarray | None = None
    gap: float | None = None
    obstacle_force: np.ndarray | None = None
    motion: Motion | None = None


@dataclass
class Result:
    """How far the run came, and why it stopped.

    status : "done"; "limit" (the load cannot be borne); "diverged"; "interrupted"
    message : one or two plain sentences; names the worst element and where it is where one is at fault
    warnings : plain sentences that belong beside the curve (walls that pass through one another, ...)
    unstable_step : the first state found that does not stay by itself, or only as a volume is held
    seconds : "assembly", "linear", "contact", "total";  counts in words below
    """

    status: str
    message: str
    rows: list[Row]
    states: list[State]
    dofs: int
    elements: int
    newton_iterations: int
    factorizations: int
    seconds: dict[str, float]
    warnings: list[str] = field(default_factory=list)
    touch_pressure: Mapping[str, float] | None = None
    unstable_step: int | None = None
