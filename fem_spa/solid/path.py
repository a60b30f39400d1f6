"""Step control: walks a problem's load path, from rest through dead loads to its last load point."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from fem_spa.errors import InputError
from fem_spa.solid.approach import first_touch, not_through, touches
from fem_spa.solid.cards import CardWatch
from fem_spa.solid.contact import contact_of
from fem_spa.solid.linear import make_solver
from fem_spa.solid.newton import Constraint, Equilibrium, Factors, solve_equilibrium
from fem_spa.solid.observables import Angle
from fem_spa.solid.observe import Observer
from fem_spa.solid.predictor import Predictor
from fem_spa.solid.problem import Problem, Result, Row, State, StepControl
from fem_spa.solid.space import Space, build_space
from fem_spa.solid.stability import Stability
from fem_spa.solid.stop import Stop, give_up
from fem_spa.solid.system import System, cavity_values
from fem_spa.solid.walk_memory import Memory, Told, Way, recall, remember, row_memory, state_of
from fem_spa.solid.walls import WallWatch

SINGLE = "The linear solver kept its factors in single precision, since memory is short"
STEPS_OF_A_PATH = 20  # largest automatic step: this part of the whole path
_GROWTH = 2.0
_TOUCH_STEPS = 80  # a step in which walls first touch is no larger than the path's length over this
_FIRMER = 6  # times that contact is made stiffer for one step
_EASY = 2.5  # a step that cost no more than this many full Newton iterations may grow
_WAIT = 2  # steps without growth after one that had to be cut while walls touch
_EASY_TOUCHING = 5.0  # likewise while walls touch: where they touch changes with every step


def solve(
    problem: Problem,
    steps: StepControl | None = None,
    observers: Sequence[Observer] = (),
    space: Space | None = None,
    keep: Callable[[Memory], None] | None = None,
    memory: Mapping[str, Any] | None = None,
) -> Result:
    """Walk the load path of a problem.

    Parameters
    ----------
    problem : what is to be solved
    steps : how the path is walked; the answer does not depend on it
    observers : told of every iteration and converged state
    space : the space of the problem's mesh, if it is at hand
    keep : given the walk's memory after every converged step, to go on from later
    memory : of an earlier walk of the same problem with the same steps: the walk goes on from there

    Returns
    -------
    Result; its `states` holds the last converged state only (observe.KeepStates keeps all). A run that does
    not reach its end returns what it reached, with the reason in `status` and `message`.

    Raises
    ------
    InputError
        The problem cannot be set up (a surface or density is missing, an element is inverted, ...).
    """
    space = space or build_space(problem.mesh)
    return Walk(problem, steps or StepControl(), observers, space, keep).run(memory)


class Walk:
    """One walk along a load path; `solve` is the way in, walk_memory.py knows what it is made of."""

    def __init__(
        self,
        problem: Problem,
        steps: StepControl,
        observers: Sequence[Observer],
        space: Space,
        keep: Callable[[Memory], None] | None = None,
    ) -> None:
        self.started = time.perf_counter()
        self.keep_memory = keep
        self.way: Way | None = None
        self.problem, self.steps, self.observers, self.space = problem, steps, observers, space
        loads = problem.loads
        self.dead = any(loads.gravity) or any(loads.tip_force) or loads.tip_displacement is not None
        self.setup(hold_tip=loads.tip_displacement is not None)
        self.angle = Angle(problem, space)
        self.walls: WallWatch | None = None if problem.contact else WallWatch(space, problem.symmetry)
        self.cards = CardWatch(problem)
        self.stability = Stability()
        n = len(self.system.cavities)
        self.x, self.pressure = self.system.rest(), np.zeros(n)
        self.rest_volume = self.system.evaluate(self.x, self.pressure, 0.0).volume
        self.rows: list[Row] = []
        self.told = Told()
        self.state: State | None = None
        self.iterations = 0
        self.warnings: list[str] = []
        if self.walls is not None and self.walls.cross(space.points) is not None:
            self.walls = None
            self.warnings.append(
                "The mesh's boundary passes through itself at rest, so walls are not watched; "
                "mend the mesh there."
            )
        self.touch: dict[str, float] | None = None
        self.fraction = 0.0

    def setup(self, hold_tip: bool) -> None:
        self.seconds = getattr(self, "seconds", {"assembly": 0.0, "linear": 0.0, "contact": 0.0})
        self.factorizations = getattr(self, "factorizations", 0)
        self.system = System(self.problem, self.space, hold_tip)
        self.factors = Factors(make_solver(self.system.pattern, factors=self.steps.factors))
        if self.problem.contact or self.problem.obstacles:
            self.system.contact = contact_of(
                self.problem,
                self.space,
                self.steps.contact_distance,
                self.system.length_unit,
                self.system.stress_unit,
            )

    def run(self, memory: Mapping[str, Any] | None = None) -> Result:
        for observer in self.observers:
            observer.start(self.problem, self.space)
        status, message = "done", "reached the end of the load path"
        try:
            if memory is not None:
                recall(self, memory)
            if self.way is None or self.way.dead:
                self.dead_loads()
                self.way = None
            self.load_path()
        except Stop as stop:
            status, message = stop.status, str(stop)
        except KeyboardInterrupt:
            status, message = (
                "interrupted",
                "interrupted by the user; everything up to the last converged step is here",
            )
        self.account()
        self.seconds["total"] = time.perf_counter() - self.started
        result = Result(
            status=status,
            message=message,
            rows=self.rows,
            states=[replace(self.state, displacement=self.system.seen(self.x))] if self.state else [],
            dofs=self.system.pattern.n_free,
            elements=len(self.space.tets),
            newton_iterations=self.iterations,
            factorizations=self.factorizations,
            seconds=self.seconds,
            warnings=self.warnings,
            touch_pressure=self.touch,
            unstable_step=self.stability.step,
        )
        for observer in self.observers:
            observer.finished(result)
        return result

    def account(self) -> None:
        for name in ("assembly", "contact"):
            self.seconds[name] += self.system.seconds[name]
        self.seconds["linear"] += self.factors.seconds
        self.factorizations += self.factors.solver.factorizations
        if self.factors.solver.single and not any(SINGLE in line for line in self.warnings):
            self.warnings.append(f"{SINGLE} or solver.factors says so: the same curve.")
        self.factors.solver.free()

    # -- the two stages --------------------------------------------------------------------------

    def dead_loads(self) -> None:
        """Gravity, tip force and prescribed tip, with the cavities open (pressure zero)."""
        zero = np.zeros(len(self.pressure))
        constraint = Constraint("pressure", zero, self.rest_volume, self.problem.loads.atmosphere)
        if self.dead:
            n = self.steps.imposed_steps or 1
            points = [np.array([(k + 1) / n]) for k in range(n)]
            if self.way is None:
                self.way = Way(True, np.zeros(1), Predictor())
            self.stretch(self.way, points, lambda _: constraint)
        else:
            rest = self.system.evaluate(self.x, self.pressure, 0.0)
            self.equilibrium = Equilibrium(self.x, self.pressure, rest, 0, True)
        self.keep(self.equilibrium, is_point=True)
        self.angle.begin_path(self.system.seen(self.x))
        if self.problem.blocked and self.problem.loads.tip_displacement is None:
            self.account()
            self.setup(hold_tip=True)
            if self.system.contact is not None:
                self.system.contact.accept(self.space.points + self.system.displacement(self.x))
            self.equilibrium.evaluation = self.system.evaluate(self.x, self.pressure, 1.0)

    def load_path(self) -> None:
        loads = self.problem.loads
        points = [cavity_values(self.system, point) for point in loads.points]
        if not points or not self.system.cavities:
            return
        if loads.control not in ("pressure", "volume", "gas-mass"):
            raise InputError(
                f'control \'{loads.control}\' is not known; use "pressure", "volume" or "gas-mass"'
            )
        if loads.control == "volume":
            points = [p / self.system.multiplicity for p in points]
        if self.way is None:
            self.way = Way(False, self.beginning(), Predictor())

        def constraint(target: np.ndarray) -> Constraint:
            return Constraint(loads.control, target, self.rest_volume, loads.atmosphere)

        self.stretch(self.way, points, constraint)

    def beginning(self) -> np.ndarray:
        """(n_cavities,) what is prescribed, under the dead loads alone: Pa, m^3 or ratio of gas mass."""
        loads, volume = self.problem.loads, self.equilibrium.evaluation.volume
        if loads.control == "pressure":
            return np.zeros(len(self.pressure))
        if loads.control == "volume":
            return volume
        return (self.pressure + loads.atmosphere) * volume / (loads.atmosphere * self.rest_volume)

    # -- one sequence of load points -------------------------------------------------------------

    def stretch(self, way: Way, points, constraint) -> None:
        """Walk straight lines from `way.start` through `points` (arrays of prescribed values)."""
        dead, predictor = way.dead, way.predictor
        corners = [way.start, *points]
        scale = np.maximum(np.max(np.abs(np.array(corners) - way.start), axis=0), 1e-300)
        lengths = [float(np.max(np.abs(b - a) / scale)) for a, b in pairwise(corners)]
        total = sum(lengths)
        if total == 0:
            return
        longest = total if dead else total / STEPS_OF_A_PATH
        imposed = self.steps.imposed_steps if not dead else None
        if not predictor.known:
            way.size = 0.25 * longest if self.approaching and not dead else longest
            predictor.add(0.0, self.x, self.pressure)
            self.save()
        direction = None
        for k, ((a, b), length) in enumerate(zip(pairwise(corners), lengths, strict=True)):
            if length == 0 or k < way.segment:
                continue
            new_direction = (b - a) / length
            if k > way.segment:
                if direction is not None and np.max(np.abs(new_direction - direction) / scale) > 1e-9:
                    predictor.corner()
                way.segment, way.done = k, 0.0
            direction = new_direction
            while way.done < length * (1 - 1e-12):
                step = length / imposed if imposed else way.size
                left = length - way.done
                if step > 0.75 * left or (imposed and step > left * (1 - 1e-9)):
                    step = left
                equilibrium, step = self.advance(way, step, length, total, a, b, constraint)
                touching = self.system.touching is not None and self.system.touching.highest > 0
                if self.approaching and touching and not dead:
                    part = first_touch(self.system, predictor, way.walked, step)
                    now = equilibrium.pressure
                    self.touched(self.pressure + part * (now - self.pressure))
                way.done = length if step == left else way.done + step
                way.walked += step
                self.x, self.pressure = equilibrium.x, equilibrium.pressure
                self.equilibrium = equilibrium
                if self.system.contact is not None:
                    self.system.contact.accept(self.space.points + self.system.displacement(self.x))
                predictor.add(way.walked, self.x, self.pressure)
                if not dead:
                    self.fraction = way.walked / total
                    self.keep(equilibrium, is_point=way.done == length)
                if touching and equilibrium.cuts:
                    way.size, way.wait = step, _WAIT
                elif way.wait > 0:
                    way.wait -= 1
                elif equilibrium.cost <= (_EASY_TOUCHING if touching else _EASY):
                    way.size = min(longest, max(way.size, step) * _GROWTH)
                else:
                    way.size = max(step, 0.5 * way.size) if step < way.size else way.size
                if not dead or way.walked < total * (1 - 1e-12):  # the end of the dead loads is kept below
                    self.save()

    def save(self) -> None:
        """Between two steps: here a walk can be left, and taken up again."""
        if self.keep_memory is not None:
            self.keep_memory(remember(self))

    def advance(self, way, step, length, total, a, b, constraint):
        """One converged step of at most `step`; smaller ones are tried where it fails."""
        predictor, walked, done, dead = way.predictor, way.walked, way.done, way.dead
        smallest = self.steps.min_fraction * length
        cuts = 0
        while True:
            target = a + (b - a) * ((done + step) / length)
            if step == length - done:
                target = b
            x, pressure = predictor.predict(walked + step)
            factor = float(target[0]) if dead else 1.0
            if not dead and self.approaching and step > total / _TOUCH_STEPS and touches(self.system, x):
                step *= 0.5
                continue
            x = not_through(self.system, self.x, x)
            self.system.prescribe(x, factor)
            equilibrium = self.attempt(x, pressure, constraint(target), factor)
            if equilibrium.converged and self.system.contact is not None:
                equilibrium = self.firm(equilibrium, constraint(target), factor)
            if equilibrium.converged:
                return replace(equilibrium, cuts=cuts), step
            cuts += 1
            predictor.lower()
            self.system.settle_layers(self.x)
            step *= 0.5
            if step < smallest:
                raise give_up(self.system, self.x, self.pressure, equilibrium, dead, self.rows)

    def attempt(
        self, x: np.ndarray, pressure: np.ndarray, constraint: Constraint, dead_factor: float
    ) -> Equilibrium:
        step = len(self.rows)
        named = dict(zip(self.system.cavities, pressure, strict=True))

        def notice(iteration: int, error: float) -> None:
            for observer in self.observers:
                observer.iteration(step, named, iteration, error)

        equilibrium = solve_equilibrium(
            self.system,
            self.factors,
            x,
            pressure,
            constraint,
            dead_factor,
            self.steps.tolerance,
            self.steps.max_iterations,
            self.steps.renew_always,
            notice,
        )
        self.iterations += equilibrium.iterations
        return equilibrium

    def firm(self, found: Equilibrium, constraint: Constraint, dead_factor: float) -> Equilibrium:
        """The equilibrium with contact stiff enough, at points enough, that nothing is inside anything."""
        contact = self.system.contact
        assert contact is not None
        for _ in range(_FIRMER):
            touching = self.system.touching
            assert touching is not None
            if contact.too_soft(touching):
                contact.stiffness = 2.0 * touching.highest
            elif not contact.close(self.space.points + self.system.displacement(found.x)):
                return found
            again = self.attempt(found.x, found.pressure, constraint, dead_factor)
            if not again.converged:
                return again
            found = replace(again, iterations=found.iterations + again.iterations, cost=again.cost)
        return replace(found, converged=False, why="walls pass through one another however stiff contact is")

    # -- what is kept of a converged state -------------------------------------------------------

    def keep(self, equilibrium: Equilibrium, is_point: bool) -> None:
        system = self.system
        self.x, self.pressure = equilibrium.x, equilibrium.pressure
        displacement, seen = system.displacement(self.x), system.seen(self.x)
        stretch, _ = system.max_stretch()
        volume = equilibrium.evaluation.volume * system.multiplicity
        named = dict(zip(system.cavities, self.pressure.tolist(), strict=True))
        force = force_vector = None
        if self.problem.blocked or self.problem.loads.tip_displacement is not None:
            force_vector = system.tip_reaction() if system.holds_tip else np.zeros(3)
            force = float(np.linalg.norm(force_vector))
        row = Row(
            step=len(self.rows),
            pressure=named,
            angle=self.angle(seen),
            tip=self.angle.tip(seen),
            volume=float(volume.sum()),
            max_stretch=stretch,
            force=force,
            iterations=equilibrium.iterations,
            is_point=is_point,
            force_vector=force_vector,
        )
        row = replace(row, **self.contact_row(displacement, row))
        volumes = dict(zip(system.cavities, volume.tolist(), strict=True))
        points = system.contact.added if system.contact is not None else ()
        state = state_of(self.space, self.x, named, row.step, volumes, points)
        self.watch_walls(displacement, named)
        self.warnings += self.cards.look(system, named)
        self.rows.append(row)
        self.told.append(row_memory(row))
        self.state = state
        self.watch_stability(equilibrium, closely=self.fraction > 1.0 - 1e-9)
        for observer in self.observers:
            observer.converged(replace(state, displacement=seen), row, self.fraction)

    @property
    def approaching(self) -> bool:
        """Contact is on, and nothing has touched yet."""
        return self.system.contact is not None and self.touch is None

    def touched(self, pressure: np.ndarray) -> None:
        """Note the cavities' pressures (Pa) at first touch."""
        self.touch = dict(zip(self.system.cavities, pressure.tolist(), strict=True))

    def contact_row(self, displacement: np.ndarray, row: Row) -> dict[str, Any]:
        """Gap and forces on obstacles of the state last evaluated; notes where things first touch."""
        system = self.system
        if system.contact is None or system.touching is None:
            return {}
        gap = system.contact.gap(self.space.points + displacement)
        if self.touch is None and not self.rows and system.touching.highest > 0:
            self.touched(self.pressure)
        return {"gap": gap, "obstacle_force": system.obstacle_force()}

    def watch_stability(self, found: Equilibrium, closely: bool) -> None:
        """Whether the state that was last evaluated stays by itself, under what is prescribed there."""
        loads = self.problem.loads
        control = "pressure" if self.way is None or self.way.dead else loads.control
        constraint = Constraint(control, found.pressure, self.rest_volume, loads.atmosphere)
        started = time.perf_counter()
        self.warnings += self.stability.look(
            self.system, self.factors, found, constraint, self.rows[-2:], closely
        )
        self.factors.seconds += time.perf_counter() - started

    def watch_walls(self, displacement: np.ndarray, pressure: dict[str, float]) -> None:
        if self.walls is None:
            return
        started = time.perf_counter()
        position = self.space.points + displacement
        place = self.walls.cross(position)
        if place is not None:
            before = self.state.displacement if self.state else np.zeros_like(displacement)
            last = self.rows[-1].pressure if self.rows else {name: 0.0 for name in pressure}
            part = self.walls.first_crossing(self.space.points + before, position)
            crossing = {name: last[name] + part * (pressure[name] - last[name]) for name in pressure}
            self.touch = self.touch or crossing  # an obstacle may have been touched before
            at = ", ".join(f"{name} {1e-3 * p:.3g} kPa" for name, p in crossing.items())
            where = ", ".join(f"{1e3 * c:.0f}" for c in place)
            if self.steps.stop_at_touch and not self.rows:
                raise Stop("limit", f"walls touch under the dead loads alone, near ({where}) mm")
            if self.steps.stop_at_touch:
                raise Stop("done", f"walls touch at {at}, near ({where}) mm; as asked, the path ends there")
            self.warnings.append(
                f"Walls touch at {at}, near ({where}) mm. Contact is not modelled, so beyond that pressure "
                "they pass through one another and the curve is not to be trusted."
            )
            self.walls = None
        self.seconds["contact"] += time.perf_counter() - started
