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
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fem_spa.solid.linear import LinearSolver, SingularMatrix
from fem_spa.solid.system import Evaluation, System, inner

# A factorization with its assembly costs about as much as this many iterations with kept factors; measured
# by benchmarks/solver_speed.py, fixed here so that a run does not depend on the machine's mood.
FACTOR_COST = 9


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
    steps: list[np.ndarray] = field(default_factory=list)
    norms: list[float] = field(default_factory=list)
    fresh: bool = False
    seconds: float = 0.0

    @property
    def ready(self) -> bool:
        return self.solver.factorizations > 0

    def renew(self, system: System, x: np.ndarray, pressure: np.ndarray, constraint: Constraint, e: Evaluation) -> None:
        """Factorize the tangent at x."""
        data = system.tangent(x, pressure)
        started = time.perf_counter()
        self.solver.factorize(data)
        self.steps, self.norms, self.fresh = [], [], True
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

    def drop_border(self) -> None:
        self.border = self.gradient = self.schur = self.on_volume = None


@dataclass
class Equilibrium:
    """x (n_dofs,), cavity pressures (Pa), the evaluation there, iterations used; `why` it failed, if so.

    cost : iterations in units of full Newton iterations
    """

    x: np.ndarray
    pressure: np.ndarray
    evaluation: Evaluation
    iterations: int
    converged: bool
    why: str = ""
    cost: float = 0.0
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
    spent, iterations = 0.0, 0
    if not np.isfinite(error):
        return Equilibrium(x, pressure, e, 0, False, "an element turned inside out in the predicted state", history=history)
    best = error
    rising = 0
    if constraint.bordered and factors.border is None:
        renew = True
    else:
        renew = renew_always or not factors.ready
    factors.steps, factors.norms = [], []
    step: np.ndarray | None = None
    while error > tolerance:
        if spent >= max_iterations:
            return Equilibrium(x, pressure, e, iterations, False, "Newton's method did not converge", history=history)
        try:
            if renew:
                factors.renew(system, x, pressure, constraint, e)
                spent += 1.0
                step = factors.newton_step(e.residual, value)
            else:
                step = _broyden_step(factors, factors.newton_step(e.residual, value))
                spent += 1.0 / FACTOR_COST
        except SingularMatrix as exc:
            return Equilibrium(x, pressure, e, iterations, False, str(exc), history=history)
        factors.steps.append(step)
        factors.norms.append(inner(step, step))
        x[free] += step[:n] * system.scale
        if constraint.bordered:
            pressure += step[n:] * system.stress_unit
        iterations += 1
        previous = error
        e, value, error = evaluate()
        history.append(error)
        if notice:
            notice(iterations, error)
        if not np.isfinite(error):
            return Equilibrium(x, pressure, e, iterations, False, "an element turned inside out", history=history)
        if error > 1e4 * max(best, 1e-3):
            return Equilibrium(x, pressure, e, iterations, False, "the residual grew without bound", history=history)
        rising = rising + 1 if error > best else 0
        if rising >= 6:
            return Equilibrium(x, pressure, e, iterations, False, "the residual did not fall", history=history)
        best = min(best, error)
        renew = renew_always or _worth_renewing(error, previous, tolerance)
    return Equilibrium(x, pressure, e, iterations, True, cost=spent, history=history)


def _worth_renewing(error: float, previous: float, tolerance: float) -> bool:
    if error <= tolerance:
        return False
    if error >= previous:
        return True
    left = np.log(tolerance / error) / np.log(error / previous)
    return bool(left > FACTOR_COST)


def _broyden_step(factors: Factors, z: np.ndarray) -> np.ndarray:
    """Broyden's next step from z = -(kept inverse) residual and the steps since the factors were made."""
    steps, norms = factors.steps, factors.norms
    if not steps:
        return z
    for k in range(len(steps) - 1):
        z = z + steps[k + 1] * (inner(steps[k], z) / norms[k])
    denominator = 1.0 - inner(steps[-1], z) / norms[-1]
    if denominator < 0.1:  # the update would overshoot or turn round: take the unaccelerated step
        steps.clear()
        norms.clear()
        return z
    return z / denominator
