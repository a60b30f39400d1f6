"""Under which vacuum the bellow of studies/bellow.toml loses stability, its neck solid or hollow.

    python benchmarks/bellow_stability.py

Counts the negative pivots of the tangent at every converged state, less the incompressible body's pressure
unknowns: each of the rest is a way in which the shape gives way by itself (inertia of a saddle-point matrix).
Newton's method walks on along such a path without noticing. Contact is left out: folds meet below -48 kPa
only. Half the bellow is solved, so that any number of lobes can show. Needs PARDISO.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fem_spa.deck import read_deck
from fem_spa.prepare import prepare
from fem_spa.solid.linear import Pardiso
from fem_spa.solid.observe import Silent
from fem_spa.solid.path import solve
from fem_spa.solid.problem import Problem, Row, State
from fem_spa.solid.space import Space
from fem_spa.solid.system import System

DECK = Path(__file__).parents[1] / "studies" / "bellow.toml"
COMMON = ["geometry.share=2", "loads.contact=false", "loads.points=8"]
CASES = {
    "neck and collar solid": ["loads.pressure='-48 kPa'"],
    "both hollow, wall 0.8 mm": [
        "loads.pressure='-16 kPa'",
        "geometry.floor='1 mm'",
        "geometry.top='0.8 mm'",
    ],
}


class Inertia(Silent):
    """The observer that counts unstable modes; `rows` are (kPa, mm of the tip, modes)."""

    def __init__(self) -> None:
        self.rows: list[tuple[float, float, int]] = []

    def start(self, problem: Problem, space: Space) -> None:
        self.system = System(problem, space)
        free = self.system.pattern.free
        self.constraints = int((free >= self.system.n_u).sum())

    def converged(self, state: State, row: Row, fraction: float) -> None:
        x = np.concatenate([state.displacement.ravel(), state.pressure_field])
        pressure = np.array(list(state.cavity_pressure.values()))
        self.system.evaluate(x, pressure, 1.0)
        solver = Pardiso(self.system.pattern)
        solver.factorize(self.system.tangent(x, pressure))
        negative = int(solver._iparm[22])  # MKL's manual: number of negative pivots
        solver.free()
        self.rows.append((pressure[0] / 1e3, 1e3 * row.tip[2], negative - self.constraints))


def tube_collapse(modulus: float, radius: float, wall: float, long: float) -> tuple[float, int]:
    """Outer pressure (Pa) at which a tube with round ends buckles, and its lobes.

    R. von Mises, 1929, for pressure on walls and ends, incompressible; modulus : Young's, Pa; sizes in m.
    """
    rate = (np.pi * radius / long) ** 2
    found = []
    for n in range(2, 8):
        skin = 1.0 / (n**2 / rate + 1.0) ** 2
        bend = wall**2 / (12.0 * radius**2 * 0.75) * (n**2 - 1.0 + rate) ** 2
        found.append((modulus * wall / radius / (n**2 - 1.0 + 0.5 * rate) * (skin + bend), n))
    return min(found)


def main() -> None:
    """Print the formula's answer for the hollow neck, and a table a case."""
    pressure, lobes = tube_collapse(6 * 0.41e6, 4.6e-3, 0.8e-3, 14.2e-3)
    print(f"A tube like the neck by von Mises' formula: -{pressure / 1e3:.1f} kPa, {lobes} lobes")
    for name, changes in CASES.items():
        setup = prepare(read_deck(DECK, [*COMMON, *changes]))
        inertia = Inertia()
        result = solve(setup.problem, setup.steps, [inertia])
        print(f"\n{name}: {result.elements} elements, {result.status}\n\n| kPa | top [mm] | unstable modes |")
        print("| ---: | ---: | ---: |")
        for pressure, tip, modes in inertia.rows:
            print(f"| {pressure:.1f} | {tip - inertia.rows[0][1]:.2f} | {modes} |")


if __name__ == "__main__":
    main()
