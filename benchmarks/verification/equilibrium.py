"""Sample rubbers, loads that no deck has, and equilibrium under them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fem_spa.solid.cavity import triangle_rule
from fem_spa.solid.linear import make_solver
from fem_spa.solid.newton import Constraint, Equilibrium, Factors, solve_equilibrium
from fem_spa.solid.problem import Material, Problem
from fem_spa.solid.space import Space
from fem_spa.solid.system import System
from materials.registry import law, resolve
from verification.blocks import Place

SAMPLES: dict[str, dict[str, float]] = {
    "neo-hooke": {"C10": 1.1e5},
    "mooney-rivlin": {"C10": 1.1e5, "C01": 1e4},
    "yeoh": {"C10": 1.1e5, "C20": 2e4},
    "ogden": {"mu1": 0.63e6, "alpha1": 1.3, "mu2": 0.0012e6, "alpha2": 5.0, "mu3": -0.01e6, "alpha3": -2.0},
    "gent": {"mu": 2e5, "Jm": 30.0},
    "arruda-boyce": {"mu": 2e5, "N": 8.0},
    "extended-tube": {"Gc": 2e5, "delta": 0.1, "Ge": 1e5, "beta": 0.3},
    "linear": {"E": 6e5, "nu": 0.5},
}
"""One believable rubber a law, Pa."""


def traction(space: Space, surface: str, t: Place, order: int = 8) -> np.ndarray:
    """(n_dofs,) nodal forces of the nominal (dead) traction t(X (..., 3)) (..., 3), Pa."""
    faces = space.surfaces[surface]
    weight, value, d1, d2 = triangle_rule(order)
    corner = space.points[faces]
    normal = np.cross(np.einsum("fai,qa->fqi", corner, d1), np.einsum("fai,qa->fqi", corner, d2))
    area = np.linalg.norm(normal, axis=-1) * weight
    load = t(np.einsum("fai,qa->fqi", corner, value))
    out = np.zeros(space.n_dofs)
    force = out[: 3 * space.n_nodes].reshape(-1, 3)
    np.add.at(force, faces, np.einsum("fq,fqi,qa->fai", area, load, value))
    return out


def body_force(space: Space, b: Place) -> np.ndarray:
    """(n_dofs,) nodal forces of the dead force b(X) per rest volume, N/m^3."""
    place = np.einsum("qa,eai->eqi", space.shape, space.points[space.tets])
    out = np.zeros(space.n_dofs)
    force = out[: 3 * space.n_nodes].reshape(-1, 3)
    np.add.at(force, space.tets, np.einsum("eq,eqi,qa->eai", space.weight, b(place), space.shape))
    return out


class HeldSystem(System):
    """A system with single unknowns held besides those of the problem."""

    def __init__(self, problem: Problem, space: Space, also: Sequence[int] = ()) -> None:
        self._also = list(also)
        super().__init__(problem, space)

    def _held(self, hold_tip: bool) -> np.ndarray:
        held = super()._held(hold_tip)
        held[self._also] = True
        return held


def settle(
    system: System,
    x: np.ndarray,
    pressure: np.ndarray | None = None,
    tolerance: float = 1e-10,
    backend: str = "auto",
    **options: object,
) -> Equilibrium:
    """Equilibrium near x under the system's dead loads and given cavity pressures (Pa)."""
    target = np.zeros(len(system.cavities)) if pressure is None else np.asarray(pressure, dtype=float)
    factors = Factors(make_solver(system.pattern, backend))
    constraint = Constraint("pressure", target, np.ones_like(target), 101325.0)
    found = solve_equilibrium(system, factors, x, target, constraint, 1.0, tolerance, 40, **options)
    factors.solver.free()
    if not found.converged:
        raise RuntimeError(f"no equilibrium: {found.why}")
    return found


def material(name: str, bulk: float = math.inf, density: float | None = None) -> Material:
    """The sample of law `name`."""
    return Material(law(name), resolve(law(name), SAMPLES[name]), bulk, density)


def rotation(rest: np.ndarray, now: np.ndarray) -> float:
    """Angle of the best-fitting rotation between two equally weighted sets of points (n, 2), rad."""
    a, b = rest - rest.mean(axis=0), now - now.mean(axis=0)
    return math.atan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))
