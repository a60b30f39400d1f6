"""Does an equilibrium that was found stay by itself? The number of its tangent's negative pivots says so.

Newton's method walks along an unstable path as along a stable one. The tangent of displacements and pressures
(a saddle point) has as many negative pivots as there are pressure unknowns where the energy is at a minimum;
each one more is a way in which the shape gives way by itself (Gould, On practical conditions for the
existence and uniqueness of solutions to the general equality quadratic programming problem, Math. Program.
32, 1985). Where a volume or gas mass is prescribed its row borders the tangent K, with the gradient g of the
volume; of the ways counted in K those are left that the border does not stop: it stops as many as g K^-1 g^T
(with gas, and the gas' own compliance) has negative eigenvalues.

PARDISO counts pivots as it factorizes, so that nothing is spent on a stable path: factors that were made on
the way to a state are looked at, and only where they count too many the state's own tangent is factorized.
So the first unstable state may be noticed some steps late, and none is called unstable that is not. The end
of the path is always looked at, and where pressure falls while volume grows. A mode that breaks a plane of
symmetry is not seen where a part is meshed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fem_spa.solid.linear import SingularMatrix
from fem_spa.solid.newton import Constraint, Equilibrium, Factors
from fem_spa.solid.problem import Row
from fem_spa.solid.system import System

_HELD = {"volume": "enclosed volume", "gas-mass": "amount of gas"}


class Stability:
    """Watches a path's states.

    Attributes
    ----------
    held : step of the first state that the prescribed volume or gas mass alone holds, None where none is
    lost : step of the first state that gives way under what is prescribed
    """

    def __init__(self) -> None:
        self.held: int | None = None
        self.lost: int | None = None

    @property
    def step(self) -> int | None:
        """The first of the two."""
        return min((k for k in (self.held, self.lost) if k is not None), default=None)

    def memory(self) -> list[int | None]:
        """Both, for a run that is resumed."""
        return [self.held, self.lost]

    def recall(self, memory: Sequence[int | None]) -> None:
        """Go on from what `memory` gave."""
        self.held, self.lost = memory

    def look(
        self,
        system: System,
        factors: Factors,
        found: Equilibrium,
        constraint: Constraint,
        rows: Sequence[Row],
        closely: bool = False,
    ) -> list[str]:
        """Warnings about the state that `system` was last evaluated at.

        rows : the last before it and its own;  closely : factorize its tangent in any case
        Kept factors are as they were afterwards.
        """
        step, pressure = rows[-1].step, rows[-1].pressure
        if constraint.bordered and self.held is None and len(pressure) == 1:
            change = sum(pressure.values()) - sum(rows[0].pressure.values())
            closely |= change * (rows[-1].volume - rows[0].volume) < 0.0
        done = self.lost is not None or (self.held is not None and not closely)
        negative = factors.solver.negative
        expected = int((system.pattern.free >= system.n_u).sum())
        if done or negative is None or (negative <= expected and not closely):
            return []
        try:
            modes, stopped = _count(system, factors, found, constraint, expected)
            if factors.data is not None:
                factors.solver.factorize(factors.data)
        except SingularMatrix:
            return []
        at = ", ".join(f"{name} {1e-3 * p:.3g} kPa" for name, p in pressure.items())
        if modes > stopped:
            self.lost = step
            return [_lost(constraint.control, at, step, modes - stopped)]
        if modes > 0 and self.held is None:
            self.held = step
            return [
                f"From {at} on (step {step}) the prescribed {_HELD[constraint.control]} alone holds the "
                "equilibrium: with the pressure held instead, the actuator would snap."
            ]
        return []


def _count(
    system: System, factors: Factors, found: Equilibrium, constraint: Constraint, expected: int
) -> tuple[int, int]:
    """Unstable ways with the pressures held, and how many of them the constraint stops."""
    solver = factors.solver
    data = system.tangent(found.x, found.pressure)
    if system.pattern is not solver.pattern:  # it grew; the next state will tell
        return 0, 0
    solver.factorize(data)
    modes, stopped = (solver.negative or 0) - expected, 0
    if constraint.bordered and modes > 0:
        gradient = found.evaluation.gradient
        yielding = gradient @ np.array([solver.solve(g) for g in gradient]).T
        on_volume, on_pressure = constraint.derivatives(found.pressure, found.evaluation.volume)
        own = on_pressure * system.stress_unit / (on_volume * system.length_unit**3)
        stopped = int((np.linalg.eigvalsh(0.5 * (yielding + yielding.T) + np.diag(own)) < 0).sum())
    return modes, stopped


def _lost(control: str, at: str, step: int, ways: int) -> str:
    held = _HELD.get(control)
    count = "one way" if ways == 1 else f"{ways} ways"
    words = (
        f"The equilibrium is not stable from {at} on (step {step}): it gives way by itself in {count}, and "
        "the actuator may snap; the curve beyond is not what a bench shows."
    )
    return f"{words[:-1]}, even with the {held} held." if held else words
