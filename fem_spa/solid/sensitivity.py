"""Derivatives of what is observed to what is put in, at every converged state: one back-substitution each.

At an equilibrium R(x, q) = 0 of the free unknowns, a number q of the problem (a material parameter, a layer's
modulus, a cavity's pressure, a mode of the mesh) moves the state by

    dx/dq = - K^-1 dR/dq,      K = dR/dx, factorized once a state

and an observable O(x, q) by dO/dq + dO/dx . dx/dq. dR/dq is a central difference of the residual in q at
fixed x, with the relative step 1e-4: exact where the residual is linear in q (moduli, thickness, density),
else of relative error 1e-8. Where volume or gas mass is prescribed, the pressure answers too: the tangent is
bordered by dV/dx, as in newton.py. A blocked tip stays where gravity left it, which may itself depend on q.

Walls (the scale of all walls' thickness) are such a number as well: a mode of the mesh moves its nodes, and
the residual at the same x on the moved mesh gives dR/dq. A length of a built-in shape is not: another drawing
is another mesh; its effect is the difference of two runs (fem_spa/calibration/finite_elements.py). Contact,
where it is on, belongs to the residual and the tangent.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_spa.errors import InputError
from fem_spa.solid.contact import Contact, contact_of
from fem_spa.solid.knobs import Knob
from fem_spa.solid.linear import make_solver
from fem_spa.solid.newton import Constraint
from fem_spa.solid.observables import Angle
from fem_spa.solid.observe import Silent
from fem_spa.solid.problem import Problem, Row, State, StepControl
from fem_spa.solid.space import Space, build_space
from fem_spa.solid.system import Evaluation, System, cavity_values

STEP = 1e-4
"""Relative step of the central difference of the residual."""
_OF_TANGENT = ("_where", "_face_where", "_layer_where", "_entry_scale", "_blocks")
_SETTLED = 1e-5  # error of a residual that is one
_PROBE = 1e-4  # a state is probed along dx/dq by this part of the body's size


@dataclass(frozen=True)
class Derivatives:
    """Derivatives of one converged state's observables, one row a knob, then one a cavity's pressure.

    names : of the rows;  row : the state's history row
    angle : (n,) rad;  tip : (n, 3) m;  volume : (n,) m^3;  force : (n,) N or None;  each per unit of the knob
    pressure : (n, n_cavities) Pa, what the cavities' pressures answer where volume or gas mass is prescribed
    """

    names: tuple[str, ...]
    row: Row
    angle: np.ndarray
    tip: np.ndarray
    volume: np.ndarray
    force: np.ndarray | None
    pressure: np.ndarray

    def of(self, output: str) -> np.ndarray:
        """(n,) of one output as records name it: angle, force, x, y, z."""
        if output == "angle":
            return self.angle
        if output == "force" and self.force is not None:
            return self.force
        if output in ("x", "y", "z"):
            return self.tip[:, "xyz".index(output)]
        seen = ["angle", "x", "y", "z", *(["force"] if self.force is not None else [])]
        raise InputError(f"given output {output}: this run observes {', '.join(seen)}")


class Sensitivities(Silent):
    """Observer of `solve`: `found` holds the Derivatives of every load point (or of every converged state).

    Parameters
    ----------
    knobs : what is varied; the cavities' pressures come by themselves where pressure is prescribed
    every : at every converged state, not at load points only
    steps : the run's own, where they are not the default: they say how near walls begin to touch
    """

    def __init__(self, knobs: Sequence[Knob], every: bool = False, steps: StepControl | None = None) -> None:
        self.knobs = tuple(knobs)
        self.steps = steps or StepControl()
        self.every = every
        self.found: list[Derivatives] = []

    def start(self, problem: Problem, space: Space) -> None:
        """The problem is accepted: systems of it and of its neighbours, each knob a step up and down."""
        loads = problem.loads
        if problem.base_compliance:
            raise InputError("given supports.base_compliance: derivatives are of a fast base; leave it out")
        self.problem, self.space = problem, space
        self.moves_tip = loads.tip_displacement is not None
        self.free = _Probe(problem, space, self.steps, hold_tip=self.moves_tip)
        self.neighbours = [_Neighbours(k, problem, space, self.steps, self.moves_tip) for k in self.knobs]
        self.tip_drift = np.zeros((len(self.knobs), space.n_dofs))
        self.rest_volume = self.free.system.evaluate(self.free.system.rest(), self._no_pressure(), 0.0).volume
        self.angle = Angle(problem, space)
        self.size = float(np.ptp(space.points, axis=0).max())
        self.found = []

    def converged(self, state: State, row: Row, fraction: float) -> None:
        """Factorize at this state, and one back-substitution a knob."""
        self.angle(state.displacement)
        if row.step == 0:
            self.angle.begin_path(state.displacement)
        if row.step == 0 and self.problem.blocked and not self.moves_tip:
            derivatives, motions = self._at(self.free, self.neighbours, state, row)
            self.tip_drift = motions[: len(self.knobs)]
            self.free = _Probe(self.problem, self.space, self.steps, hold_tip=True)
            self.neighbours = [_Neighbours(k, self.problem, self.space, self.steps, True) for k in self.knobs]
            self.found.append(derivatives)
        elif self.every or row.is_point:
            self.found.append(self._at(self.free, self.neighbours, state, row)[0])

    def _no_pressure(self) -> np.ndarray:
        return np.zeros(len(self.problem.mesh.cavities))

    def _at(
        self, probe: _Probe, neighbours: list[_Neighbours], state: State, row: Row
    ) -> tuple[Derivatives, np.ndarray]:
        system = probe.system
        x = np.concatenate([state.displacement.ravel(), state.pressure_field])
        pressure = cavity_values(system, state.cavity_pressure)
        here = probe.look(x, pressure, state.contact_points)
        tangent = system.tangent(x, pressure)  # before the pattern is asked for: contact may widen it
        solver = make_solver(system.pattern)
        solver.factorize(tangent)
        n, free = len(self.knobs), system.pattern.free
        drifting = system.holds_tip and not self.moves_tip

        def motion(load: np.ndarray) -> np.ndarray:
            out = np.zeros(system.space.n_dofs)
            out[free] = -solver.solve(load) * system.scale
            return out

        # rows: knobs, then cavity pressures; dR/dP = - dV/dx
        forces = [pair.residual(x, pressure, system) for pair in neighbours]
        direct = np.array([pair.volume for pair in neighbours]).reshape(n, len(pressure))
        motions = []
        for k, force in enumerate(forces):
            if drifting and self.tip_drift[k].any():
                held = np.where(system.held, self.tip_drift[k], 0.0)
                push, _ = self._along(probe, x, pressure, held)
                motions.append(held + motion(force + push))
            else:
                motions.append(motion(force))
        by_pressure = [motion(-g / system.stress_unit) for g in here.gradient]
        moves = np.array([*motions, *by_pressure]).reshape(n + len(by_pressure), -1)
        unit = system.scale / system.length_unit**3
        slope = np.array([g / unit for g in here.gradient])
        change = moves[:, free] @ slope.T
        change[:n] += direct
        if drifting:
            for k in range(n):
                change[k] += self._volume_of_held(probe, x, pressure, np.where(system.held, moves[k], 0.0))
        answer = np.zeros((n + len(by_pressure), len(pressure)))
        answer[n:] = np.eye(len(pressure))
        if self.problem.loads.control != "pressure" and row.step > 0:
            loads = self.problem.loads
            target = np.zeros_like(pressure)
            constraint = Constraint(loads.control, target, self.rest_volume, loads.atmosphere)
            on_volume, on_pressure = constraint.derivatives(pressure, here.volume)
            matrix = on_volume[:, None] * change[n:].T + np.diag(on_pressure)
            answer[:n] = np.linalg.solve(matrix, -(on_volume[:, None] * change[:n].T)).T
            moves[:n] += answer[:n] @ moves[n:]
            change[:n] += answer[:n] @ change[n:]
        derivatives = self._observe(probe, neighbours, x, pressure, row, moves, answer, change)
        solver.free()
        return derivatives, moves

    def _observe(self, probe, neighbours, x, pressure, row, moves, answer, change) -> Derivatives:
        """Observables along dx/dq, and where a knob moves the mesh also directly."""
        system, n = probe.system, len(self.knobs)
        names = [k.name for k in self.knobs] + [f"pressure.{c}" for c in system.cavities]
        angle, tip, force = np.zeros(len(names)), np.zeros((len(names), 3)), np.zeros(len(names))
        u = system.displacement(x)
        for k, move in enumerate(moves):
            du = system.displacement(move)
            angle[k], tip[k] = _turning(self.angle, self.angle, u, du, self.size)
            if k < n and neighbours[k].shape is not None:
                up, down = neighbours[k].shape
                a, b = copy.copy(up), copy.copy(down)
                for probe_angle in (a, b):
                    probe_angle.previous, probe_angle.axis = self.angle.previous, self.angle.axis
                    probe_angle.reference = self.angle.reference
                angle[k] += (a(u) - b(u)) / neighbours[k].width
                tip[k] += (a.tip(u) - b.tip(u)) / neighbours[k].width
            if system.holds_tip and row.force_vector is not None and row.step > 0:
                force[k] = self._force(
                    probe, neighbours[k] if k < n else None, x, pressure, move, answer[k], row
                )
        keep = np.arange(len(names)) < (len(names) if self.problem.loads.control == "pressure" else n)
        return Derivatives(
            tuple(np.array(names)[keep].tolist()),
            row,
            angle[keep],
            tip[keep],
            change[keep].sum(axis=1) * system.multiplicity,
            force[keep] if row.force is not None else None,
            answer[keep],
        )

    def _along(self, probe: _Probe, x, pressure, direction) -> tuple[np.ndarray, np.ndarray]:
        """Dimensionless dR/dx . direction on the free unknowns, and d(tip reaction): central differences."""
        h = _PROBE * self.size / max(float(np.abs(direction[: probe.system.n_u]).max()), 1e-300)
        ends = []
        for sign in (1.0, -1.0):
            e = probe.system.evaluate(x + sign * h * direction, pressure, 1.0)
            ends.append((e.residual, probe.system.tip_reaction() if probe.system.holds_tip else np.zeros(3)))
        return (ends[0][0] - ends[1][0]) / (2 * h), (ends[0][1] - ends[1][1]) / (2 * h)

    def _volume_of_held(self, probe: _Probe, x, pressure, direction) -> np.ndarray:
        if not direction.any():
            return np.zeros(len(pressure))
        h = _PROBE * self.size / float(np.abs(direction).max())
        up, down = (probe.system.evaluate(x + s * h * direction, pressure, 1.0).volume for s in (1.0, -1.0))
        return (up - down) / (2 * h)

    def _force(self, probe, pair, x, pressure, move, answer, row) -> float:
        """d|reaction|: along the state's motion, by the pressures' answer, and directly."""
        _, change = self._along(probe, x, pressure, move)
        width = 2e-3 * max(float(np.abs(pressure).max()), 1.0)
        if answer.any():
            ends = []
            for sign in (0.5, -0.5):
                probe.system.evaluate(x, pressure + sign * width * answer / np.abs(answer).max(), 1.0)
                ends.append(probe.system.tip_reaction())
            change = change + (ends[0] - ends[1]) / width * np.abs(answer).max()
        if pair is not None:
            change = change + pair.reaction
        size = float(np.linalg.norm(row.force_vector))
        return float(change @ row.force_vector / size) if size > 0 else float(np.linalg.norm(change))


class _Probe:
    """A system of its own, contact included, so that the run's is not disturbed."""

    def __init__(self, problem: Problem, space: Space, steps: StepControl, hold_tip: bool) -> None:
        self.system = System(problem, space, hold_tip)
        self.system.contact = _contact(problem, space, self.system, steps)

    def look(self, x: np.ndarray, pressure: np.ndarray, points: tuple[int, ...]) -> Evaluation:
        """The evaluation at a converged state, with the watched `points` at which contact acts there.

        The path raises the contact's stiffness where something would be inside. What it was is told by the
        state: contact forces are proportional to it, and at it nothing is left of the residual.
        """
        contact = self.system.contact
        if contact is None:
            return self.system.evaluate(x, pressure, 1.0)
        if len(points) > len(contact.added):
            contact.add(np.array(points))
        contact.accept(self.system.space.points + self.system.displacement(x))
        here = self.system.evaluate(x, pressure, 1.0)
        if here.error > _SETTLED and self.system.touching is not None and self.system.touching.highest > 0:
            first = contact.stiffness
            contact.stiffness = 2.0 * first
            push = self.system.evaluate(x, pressure, 1.0).residual - here.residual
            size = float(push @ push)
            share = 1.0 - float(here.residual @ push) / size if size > 0 else 1.0
            contact.stiffness = first * (share if share > 0 else 1.0)
            here = self.system.evaluate(x, pressure, 1.0)
        return here


def _contact(problem: Problem, space: Space, system: System, steps: StepControl) -> Contact | None:
    """Contact of a system whose lengths and stresses are those of `system`."""
    if not problem.contact and not problem.obstacles:
        return None
    return contact_of(problem, space, steps.contact_distance, system.length_unit, system.stress_unit)


class _Neighbours:
    """The problem with one knob a step up and a step down: differences of the residual at one state.

    After `residual`: volume (n_cavities,) m^3 and reaction (3,) N, direct differences a unit of the knob.
    shape : the two rest shapes' angles where the knob moves the mesh, else None
    """

    def __init__(self, k: Knob, problem: Problem, space: Space, steps: StepControl, hold_tip: bool) -> None:
        self.steps = steps
        step = STEP * (abs(k.value) if k.value else 1.0)
        self.width = 2 * step
        ends = [k.turn(problem, k.value + step), k.turn(problem, k.value - step)]
        moved = ends[0].mesh is not problem.mesh
        spaces = [build_space(p.mesh) for p in ends] if moved else [space, space]
        self.systems = [System(p, s, hold_tip) for p, s in zip(ends, spaces, strict=True)]
        for system in self.systems:  # of a neighbour only residuals are asked for
            for name in _OF_TANGENT:
                vars(system).pop(name, None)
        self.moved = moved
        self.shape = (Angle(ends[0], spaces[0]), Angle(ends[1], spaces[1])) if moved else None
        self.volume = np.zeros(0)
        self.reaction = np.zeros(3)

    def residual(self, x: np.ndarray, pressure: np.ndarray, system: System) -> np.ndarray:
        """(n_free,) dR/dq, dimensionless in the units of `system`."""
        forces, volumes, reactions = [], [], []
        for neighbour in self.systems:
            self._touch(neighbour, x, system)
            e = neighbour.evaluate(x, pressure, 1.0)
            forces.append(e.residual * (neighbour.energy_unit / neighbour.scale))
            volumes.append(e.volume)
            reactions.append(neighbour.tip_reaction() if neighbour.holds_tip else np.zeros(3))
        self.volume = (volumes[0] - volumes[1]) / self.width
        self.reaction = (reactions[0] - reactions[1]) / self.width
        return (forces[0] - forces[1]) / self.width * (system.scale / system.energy_unit)

    def _touch(self, neighbour: System, x: np.ndarray, system: System) -> None:
        """The same contact as in `system`: of the moved mesh where there is one."""
        if system.contact is None:
            return
        if not self.moved:
            neighbour.contact = system.contact
            return
        if neighbour.contact is None:
            neighbour.contact = _contact(neighbour.problem, neighbour.space, system, self.steps)
        assert neighbour.contact is not None
        neighbour.contact.stiffness = system.contact.stiffness
        neighbour.contact.add(system.contact.added)
        neighbour.contact.accept(neighbour.space.points + neighbour.displacement(x))


def _turning(up: Angle, down: Angle, u: np.ndarray, du: np.ndarray, size: float) -> tuple[float, np.ndarray]:
    """d angle (rad) and d tip (3,) m along du, by central differences."""
    largest = float(np.abs(du).max())
    if largest == 0.0:
        return 0.0, np.zeros(3)
    h = _PROBE * size / largest
    a, b = copy.copy(up), copy.copy(down)
    angle = (a(u + h * du) - b(u - h * du)) / (2 * h)
    return (0.0 if np.isnan(angle) else float(angle)), (up.tip(u + h * du) - down.tip(u - h * du)) / (2 * h)
