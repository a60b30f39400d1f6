"""One equilibrium: Newton's method with kept factors, corrected by Broyden's update.

The factorization is most of a Newton iteration's cost, so it is kept: an iteration with kept factors costs
one residual and one back-substitution, and Broyden's rank-one updates (limited to the iterations since the
factors were made; Kelley, Solving Nonlinear Equations with Newton's Method, SIAM 2003, ch. 4) restore
superlinear convergence. The factors are renewed when they would need more such iterations than a fresh
factorization is worth. With `renew_always` it is full Newton, quadratic to the end.

Where a cavity's volume or gas mass is prescribed, its pressure is one more unknown: the tangent is bordered
by dV/dx and solved by block elimination, so that limit points of the pressure are regular points here.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fem_spa.solid.linear import LinearSolver, SingularMatrix
from fem_spa.solid.system import Evaluation, System, inner, norm

# A factorization with its assembly costs about as much as this many iterations with kept factors; measured
# by benchmarks/solver_speed.py, fixed here so that a run does not depend on the machine's mood.
FACTOR_COST = 7
_MOST_UPDATES = 30
_HOPELESS = 0.3  # an error that is still that large after half the iterations will not fall
_NEAR = 1e-2  # one that is that small after all of them is given half as many again
_MOST_CUTS = 4  # halvings of one step that turns an element inside out, or walls far into one another


@dataclass(frozen=True)
class Constraint:
    """What is prescribed for the cavities: pressure, enclosed volume or gas mass.

    control : "pressure", "volume", "gas-mass";  target : (n_cavities,) Pa, m^3 or ratio of the rest mass
    rest_volume : (n_cavities,) m^3;  atmosphere : Pa. Volumes are of the meshed part.
    """

    control: str
    target: np.ndarray
    rest_volume: np.ndarray
    atmosphere: float

    @property
    def bordered(self) -> bool:
        return self.control != "pressure"

    def value(self, pressure: np.ndarray, volume: np.ndarray) -> np.ndarray:
        """(n_cavities,) zero where satisfied, relative to the rest volume."""
        if self.control == "volume":
            return (volume - self.target) / self.rest_volume
        mass = (pressure + self.atmosphere) * volume / (self.atmosphere * self.rest_volume)
        return mass - self.target

    def derivatives(self, pressure: np.ndarray, volume: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """d value / d volume (1/m^3) and d value / d pressure (1/Pa), each (n_cavities,)."""
        if self.control == "volume":
            return 1.0 / self.rest_volume, np.zeros_like(pressure)
        scale = self.atmosphere * self.rest_volume
        return (pressure + self.atmosphere) / scale, volume / scale


@dataclass
class Factors:
    """Kept factors of the bordered tangent and Broyden's steps since they were made."""

    solver: LinearSolver
    border: np.ndarray | None = None  # K^-1 dV/dx, (n_cavities, n_free)
    gradient: np.ndarray | None = None
    schur: np.ndarray | None = None
    on_volume: np.ndarray | None = None
    updates: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)
    distrust: int = 0  # solutions that shall begin with new factors, since kept ones were of no use
    patience: int = 4
    seconds: float = 0.0
    data: np.ndarray | None = None  # the tangent whose factors are kept

    @property
    def ready(self) -> bool:
        return self.solver.factorizations > 0

    def renew(
        self, system: System, x: np.ndarray, pressure: np.ndarray, constraint: Constraint, e: Evaluation
    ) -> None:
        """Factorize the tangent at x."""
        data = self.data = system.tangent(x, pressure)
        started = time.perf_counter()
        if self.solver.pattern is not system.pattern:
            self.solver = self.solver.on(system.pattern)
        self.solver.factorize(data)
        self.updates = []
        if constraint.bordered:
            self.gradient = e.gradient
            self.border = np.array([self.solver.solve(g) for g in e.gradient])
            length3 = system.length_unit**3
            on_volume, on_pressure = constraint.derivatives(pressure, e.volume)
            self.on_volume = on_volume * length3
            self.schur = self.on_volume[:, None] * (self.gradient @ self.border.T) + np.diag(
                on_pressure * system.stress_unit
            )
        self.seconds += time.perf_counter() - started

    def newton_step(self, residual: np.ndarray, value: np.ndarray) -> np.ndarray:
        """Minus the kept inverse times (residual, value): (n_free [+ n_cavities],), dimensionless."""
        started = time.perf_counter()
        y = self.solver.solve(-residual)
        if self.border is not None and self.schur is not None and self.gradient is not None:
            change = np.linalg.solve(self.schur, -value - self.on_volume * (self.gradient @ y))
            y = np.concatenate([y + change @ self.border, change])
        self.seconds += time.perf_counter() - started
        if not np.all(np.isfinite(y)):
            raise SingularMatrix("the tangent is singular")
        return y

    def memory(self) -> dict[str, Any]:
        """What the next steps depend on; arrays in it are never changed."""
        names = ("border", "gradient", "schur", "on_volume", "distrust", "patience", "data")
        updates = [list(pair) for pair in self.updates]
        kept = {name: getattr(self, name) for name in names}
        return {**kept, "updates": updates, "single": self.solver.single}

    def recall(self, memory: Mapping[str, Any], system: System) -> None:
        """Go on from what `memory` gave: the same matrix has the same factors."""
        for name in ("border", "gradient", "schur", "on_volume", "distrust", "patience", "data"):
            setattr(self, name, memory[name])
        self.updates = [(w, s) for w, s in memory["updates"]]
        if self.data is not None:
            self.solver = self.solver.on(system.pattern, memory.get("single", False))
            try:
                self.solver.factorize(self.data)
            except SingularMatrix:  # as it was then
                self.distrust = max(self.distrust, 1)

    def drop_border(self) -> None:
        if self.border is not None:
            self.updates = []
        self.border = self.gradient = self.schur = self.on_volume = None


@dataclass
class Equilibrium:
    """x (n_dofs,), cavity pressures (Pa), the evaluation there, iterations used; `why` it failed, if so.

    cost : iterations in units of full Newton iterations;  cuts : larger steps that failed before this one
    """

    x: np.ndarray
    pressure: np.ndarray
    evaluation: Evaluation
    iterations: int
    converged: bool
    why: str = ""
    cost: float = 0.0
    cuts: int = 0
    history: list[float] = field(default_factory=list)


def solve_equilibrium(
    system: System,
    factors: Factors,
    x: np.ndarray,
    pressure: np.ndarray,
    constraint: Constraint,
    dead_factor: float,
    tolerance: float = 1e-8,
    max_iterations: int = 15,
    renew_always: bool = False,
    notice: Callable[[int, float], None] | None = None,
) -> Equilibrium:
    """Equilibrium near x.

    Parameters
    ----------
    x, pressure : the predicted state; not changed
    max_iterations : counted in full Newton iterations; one with kept factors counts 1 / FACTOR_COST
    notice : called with (iteration, error) after each evaluation

    Returns
    -------
    Equilibrium, with `converged` False and the reason where J <= 0, nothing is finite, the error does not
    fall or the iterations are used up.
    """
    x, pressure = x.copy(), pressure.copy()
    if not constraint.bordered:
        pressure[:] = constraint.target
        factors.drop_border()
    free = system.pattern.free
    n = len(free)

    def evaluate() -> tuple[Evaluation, np.ndarray, float]:
        e = system.evaluate(x, pressure, dead_factor)
        value = constraint.value(pressure, e.volume) if constraint.bordered else np.zeros(0)
        return e, value, max(e.error, float(np.max(np.abs(value), initial=0.0)))

    e, value, error = evaluate()
    history = [error]
    if notice:
        notice(0, error)
    spent, iterations, rising = 0.0, 0, 0
    if not np.isfinite(error):
        return Equilibrium(
            x, pressure, e, 0, False, "an element turned inside out in the predicted state", history=history
        )
    renew = renew_always or not factors.ready or (constraint.bordered and factors.border is None)
    if factors.distrust > 0:
        factors.distrust -= 1
        renew = True
    last: np.ndarray | None = None

    def failed(why: str) -> Equilibrium:
        system.hold_faces(False)
        # what was learnt on the way is of no use elsewhere
        factors.updates.clear()
        factors.distrust = max(factors.distrust, 1)
        return Equilibrium(x, pressure, e, iterations, False, why, history=history)

    while error > tolerance:
        if spent >= max_iterations * (0.5 if error > _HOPELESS else 1.5 if error < _NEAR else 1.0):
            return failed("Newton's method did not converge")
        try:
            if not renew:
                step = _broyden_step(factors, factors.newton_step(e.residual, value), last)
                spent += 1.0 / FACTOR_COST
                if last is not None:
                    renew = _worth_renewing(norm(step) / norm(last), error, tolerance)
                    if renew and iterations == 1:
                        factors.distrust = factors.patience
                        factors.patience *= 2
            if renew:
                factors.renew(system, x, pressure, constraint, e)
                spent += 1.0
                step = factors.newton_step(e.residual, value)
                falls = len(history) > 1 and history[-1] < 0.7 * history[-2]
                if last is not None and norm(step) > 2.0 * norm(last) and not falls:
                    rising += 1
                    if rising > 1:
                        return failed("Newton's steps grew instead of shrinking")
        except SingularMatrix as exc:
            return failed(str(exc))
        deepest = max(2.0 * system.inside(), system.depth_allowed)
        increment = np.zeros_like(x)
        increment[free] = step[:n] * system.scale
        whole = system.whole_step(increment)
        if whole < 1.0:
            step = whole * step
            increment *= whole
        last = step
        system.settle_layers(x, increment)
        x += increment
        if constraint.bordered:
            pressure += step[n:] * system.stress_unit
        iterations += 1
        e, value, error = evaluate()
        cuts = 0
        while (not np.isfinite(error) or system.inside() > deepest) and cuts < _MOST_CUTS:
            # go back half of what was gone: stale factors and walls that meet anew overshoot
            cuts += 1
            x -= 0.5**cuts * increment
            if constraint.bordered:
                pressure -= 0.5**cuts * step[n:] * system.stress_unit
            e, value, error = evaluate()
        history.append(error)
        if notice:
            notice(iterations, error)
        if not np.isfinite(error):
            return failed("an element turned inside out")
        if cuts or whole < 1.0:
            last = None
            system.settle_layers(x)
        renew = renew_always or cuts > 0 or whole < 1.0
        if _to_and_fro(history):
            system.hold_faces(True)
    system.hold_faces(False)
    system.settle_layers(x)
    return Equilibrium(x, pressure, e, iterations, True, cost=spent, history=history)


def _to_and_fro(history: Sequence[float]) -> bool:
    """Has a small error hardly changed over two iterations?"""
    last = history[-3:]
    return len(last) == 3 and max(last) < _NEAR and min(last) > 0.5 * max(last)


def _worth_renewing(contraction: float, error: float, tolerance: float) -> bool:
    """Would more steps that shrink by `contraction` each cost more than new factors?"""
    if contraction >= 1.0:
        return True
    return bool(np.log(tolerance / error) / np.log(contraction) > FACTOR_COST)


def _broyden_step(factors: Factors, z: np.ndarray, last: np.ndarray | None) -> np.ndarray:
    """Broyden's step from z = -(kept inverse) residual.

    The inverse is a product (1 + w s^T / s.s) ... (kept inverse). It outlives the load step: what was learnt
    of the tangent's change there is still nearly true here.
    """
    for w, s in factors.updates:
        z = z + w * (inner(s, z) / inner(s, s))
    if last is None or len(factors.updates) >= _MOST_UPDATES:
        return z
    denominator = 1.0 - inner(last, z) / inner(last, last)
    if denominator < 0.1:  # the update would overshoot or turn round
        return z
    w = z / denominator
    factors.updates.append((w, last))
    return w
