"""Closed forms and manufactured solutions against fem_spa.solid. tests/solid holds the same cases to bounds.

    python benchmarks/verification.py > docs/verification.md

SI inside; the table speaks per cent and degrees.
"""

from __future__ import annotations

import datetime
import importlib.metadata
import math
import os
import platform
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar
from skfem import ElementTetP1, ElementTetP2, MeshTet
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from fem_spa.solid.cavity import triangle_rule
from fem_spa.solid.linear import make_solver
from fem_spa.solid.newton import Constraint, Equilibrium, Factors, solve_equilibrium
from fem_spa.solid.observe import KeepStates
from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, Material, Problem, Result
from fem_spa.solid.space import Space, build_space
from fem_spa.solid.system import System
from geometry.second_order import to_second_order
from geometry.tagged import TaggedMesh
from geometry.topology import boundary, corner_keys, facets
from materials.registry import law, resolve
from materials.response import MODES, nominal_stress, principal_stretches

MM = 1e-3

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

# -- meshes ------------------------------------------------------------------------------------------

Corners = tuple[Sequence[float], Sequence[float]]
Place = Callable[[np.ndarray], np.ndarray]


def box(
    grid: Sequence[np.ndarray],
    voids: Mapping[str, Corners] | None = None,
    regions: Mapping[str, Place] | None = None,
    names: Mapping[str, str] | None = None,
    layers: Mapping[str, float] | None = None,
) -> TaggedMesh:
    """A block of structured ten-node tets, with voids.

    Parameters
    ----------
    grid : planes of the cells in x, y and z, m
    voids : cavity -> (low corner, high corner) on planes of the grid
    regions : volume -> whether a tet's centroid (n, 3) belongs to it; first match counts, the rest is `body`
    names : new names of the sides `x0`, `x1`, ... `z1` (lower and upper side)
    layers : layer -> its level z; the inner faces there
    """
    sk = MeshTet.init_tensor(*grid)
    points, tets = sk.p.T, sk.t.T
    edges = points[tets[:, 1:]] - points[tets[:, :1]]
    tets = np.where((np.linalg.det(edges) < 0)[:, None], tets[:, [1, 0, 2, 3]], tets)  # right-handed
    centre = points[tets].mean(axis=1)
    keep = np.ones(len(tets), dtype=bool)
    for low, high in (voids or {}).values():
        keep &= ~np.all((centre > low) & (centre < high), axis=1)
    used, tets = np.unique(tets[keep], return_inverse=True)
    points, tets, centre = points[used], tets.reshape(-1, 4), centre[keep]
    volume = np.full(len(tets), "body", dtype=object)
    for name, inside in reversed((regions or {}).items()):
        volume[inside(centre)] = name
    volumes = {str(name): np.flatnonzero(volume == name) for name in np.unique(volume.astype(str))}
    mesh = to_second_order(TaggedMesh(points, tets, volumes, {}))
    shell = boundary(mesh)
    where = mesh.points[shell[:, :3]].mean(axis=1)
    surfaces = {}
    size = max(g[-1] - g[0] for g in grid)
    for i, axis in enumerate("xyz"):
        for side, level in (("0", grid[i][0]), ("1", grid[i][-1])):
            on = np.abs(where[:, i] - level) < 1e-9 * size
            name = (names or {}).get(axis + side, axis + side)
            faces = shell[on]
            for cavity, (low, high) in (voids or {}).items():
                inside = np.all((where[on] > low) & (where[on] < high), axis=1)
                assert not inside.any(), f"cavity {cavity} lies in side {name}"
            surfaces[name] = faces
    slack = 1e-9 * size
    for cavity, (low, high) in (voids or {}).items():
        wall = np.all((where > np.array(low) - slack) & (where < np.array(high) + slack), axis=1)
        on_side = np.zeros(len(where), dtype=bool)
        for i in range(3):
            for level in (grid[i][0], grid[i][-1]):
                on_side |= np.abs(where[:, i] - level) < slack
        surfaces[f"cavity {cavity}"] = shell[wall & ~on_side]
    for layer, level in (layers or {}).items():
        every = facets(mesh.tets)
        flat = every[np.all(np.abs(mesh.points[every[:, :3], 2] - level) < slack, axis=1)]
        _, first = np.unique(corner_keys(flat, len(mesh.points)), return_index=True)
        surfaces[f"layer {layer}"] = flat[first]
    return replace(mesh, surfaces=surfaces, source="structured block")


def even(low: float, high: float, cells: int) -> np.ndarray:
    """cells + 1 planes between two levels."""
    return np.linspace(low, high, cells + 1)


def moved(mesh: TaggedMesh, to: Callable[[np.ndarray], np.ndarray]) -> TaggedMesh:
    """The same mesh with every node, middle ones included, at to(points (n, 3)): curved elements."""
    return replace(mesh, points=to(mesh.points))


# -- loads that no deck has, and equilibrium under them ----------------------------------------------


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


# -- cases -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Check:
    """case : what was solved;  measure : of what the error is;  error, bound : relative"""

    case: str
    measure: str
    error: float
    bound: float
    elements: int


def plane_energy(name: str) -> tuple[Place, Place]:
    """W and W' over the stretches l (any shape), of principal stretches (l, 1/l, 1)."""
    sample, numbers = law(name), resolve(law(name), SAMPLES[name])

    def energy(l: np.ndarray) -> np.ndarray:
        i = np.asarray(l**2 + l**-2 + 1.0)
        return sample.energy(i, i, **numbers)

    def slope(l: np.ndarray) -> np.ndarray:
        i = np.asarray(l**2 + l**-2 + 1.0)
        w1, w2, *_ = sample.derivatives(i, i, **numbers)
        return (w1 + w2) * (2 * l - 2 * l**-3)

    return energy, slope


def flexure(name: str, degrees: float, cells: tuple[int, int] = (4, 12), steps: int = 4) -> Check:
    """Rivlin's flexure of a block in plane strain: r^2 = 2 A X + B, theta = Y / A.

    R. S. Rivlin, Phil. Trans. R. Soc. A 242 (1949) 173. The end at Y = L carries the exact nominal traction
    sigma_theta / lambda along its rotated normal as a dead load; both curved sides are free. Steps of the
    angle start from the step before.
    """
    thick, long = 10 * MM, 40 * MM
    mesh = box([even(0, thick, cells[0]), even(0, long, cells[1]), even(0, thick / cells[0], 1)])
    space = build_space(mesh)
    problem = Problem(
        mesh,
        {"body": material(name)},
        Loads([]),
        fixed=(),
        symmetry={"y0": "y", "z0": "z", "z1": "z"},
    )
    edge = np.flatnonzero((np.abs(space.points[:, 0]) < 1e-9) & (np.abs(space.points[:, 1]) < 1e-9))
    system = HeldSystem(problem, space, also=3 * edge)
    energy, slope = plane_energy(name)
    x = system.rest()
    for angle in np.radians(degrees) * np.arange(1, steps + 1) / steps:
        A = long / angle
        inner = math.sqrt(math.sqrt(A**4 + (A * thick) ** 2) - A * thick)
        start = float(energy(inner / A))
        along = np.array([-math.sin(angle), math.cos(angle), 0.0])

        def load(X: np.ndarray, A=A, inner=inner, start=start, along=along) -> np.ndarray:
            stretch = np.sqrt(2 * A * X[..., 0] + inner**2) / A
            hoop = energy(stretch) - start + stretch * slope(stretch)
            return (hoop / stretch)[..., None] * along

        system.dead = traction(space, "y1", load)
        x = settle(system, x).x
    nodes = np.unique(space.surfaces["y1"][:, :3])
    rest = space.points[nodes, :2]
    turned = rotation(rest, rest + system.displacement(x)[nodes, :2])
    error = abs(turned / math.radians(degrees) - 1)
    return Check(f"Rivlin's flexure, {name}, {degrees:g} deg", "angle", error, 5e-3, len(mesh.tets))


def sphere_pressure(inner: float, outer: float, volume: float, modulus: float) -> float:
    """Pressure of a thick neo-Hookean sphere (C10 = modulus) that encloses `volume`: int W'/(l^3 - 1) dl."""
    la = (volume * 3 / 4 / math.pi) ** (1 / 3) / inner
    lb = (1 + (inner / outer) ** 3 * (la**3 - 1)) ** (1 / 3)
    return quad(lambda l: modulus * (4 * l - 4 * l**-5) / (l**3 - 1), lb, la, epsrel=1e-11)[0]


def sphere(size: float = 3 * MM, reach: float = 8.0) -> tuple[list[Check], Result]:
    """Thick neo-Hookean sphere, an eighth, by volume control through its limit point."""
    from geometry.ball import Ball

    inner, outer, modulus = 10 * MM, 13 * MM, 1e5
    mesh = Ball(inner_radius=inner, outer_radius=outer, share=8).mesh(size)
    rest = 4 / 3 * math.pi * inner**3
    problem = Problem(
        mesh,
        {"body": Material(law("neo-hooke"), {"C10": modulus})},
        Loads([{"main": reach * rest}], control="volume"),
        fixed=(),
        symmetry={f"symmetry {a}": a for a in "xyz"},
    )
    result = solve(problem)
    if result.status != "done":
        raise RuntimeError(result.message)
    rows = result.rows[1:]
    volume = np.array([row.volume for row in rows])
    pressure = np.array([row.pressure["main"] for row in rows])
    exact = np.array([sphere_pressure(inner, outer, v, modulus) for v in volume])
    top = int(np.argmax(pressure))
    if not 0 < top < len(rows) - 3:
        raise RuntimeError("the falling branch was not reached")
    around = slice(max(top - 1, 0), top + 2)
    c = np.polyfit(volume[around] / rest, pressure[around], 2)
    peak = c[2] - c[1] ** 2 / (4 * c[0])
    true = -minimize_scalar(
        lambda v: -sphere_pressure(inner, outer, v * rest, modulus), bounds=(1.05, reach), method="bounded"
    ).fun
    name = f"thick sphere 10/13 mm, neo-Hooke, volume x {reach:g}"
    n = len(mesh.tets)
    return [
        Check(name, "pressure over volume, worst row", float(np.max(np.abs(pressure / exact - 1))), 5e-3, n),
        Check(name, "peak pressure", float(abs(peak / true - 1)), 1e-2, n),
    ], result


def cylinder(name: str = "mooney-rivlin", swell: float = 1.5, cells: tuple[int, int] = (4, 6)) -> Check:
    """Thick tube in plane strain, inner radius grown by `swell`: P = int W'(l) / (l^2 - 1) dl.

    A quarter between two parallel planes of symmetry, curved elements, follower pressure.
    """
    inner, outer = 10 * MM, 20 * MM
    flat = box(
        [even(inner, outer, cells[0]), even(0, math.pi / 2, cells[1]), even(0, 2 * MM, 1)],
        names={"x0": "cavity main"},
    )
    mesh = moved(
        flat,
        lambda X: np.stack([X[:, 0] * np.cos(X[:, 1]), X[:, 0] * np.sin(X[:, 1]), X[:, 2]], axis=1),
    )
    space = build_space(mesh)
    problem = Problem(
        mesh,
        {"body": material(name)},
        Loads([]),
        fixed=(),
        symmetry={"y0": "y", "y1": "x", "z0": "z", "z1": "z"},
    )
    system = System(problem, space)
    _, slope = plane_energy(name)
    x = system.rest()
    for la in np.linspace(1, swell, 5)[1:]:
        lb = math.sqrt(1 + (inner / outer) ** 2 * (la**2 - 1))
        pressure = quad(lambda l: float(slope(l)) / (l**2 - 1), lb, la)[0]
        x = settle(system, x, np.array([pressure])).x
    nodes = np.unique(space.surfaces["cavity main"])
    grown = np.linalg.norm(space.points[nodes, :2] + system.displacement(x)[nodes, :2], axis=1) - inner
    error = float(np.max(np.abs(grown / ((swell - 1) * inner) - 1)))
    return Check(
        f"thick tube 10/20 mm in plane strain, {name}, inner radius x {swell:g}",
        "growth of the inner radius, worst node",
        error,
        5e-3,
        len(mesh.tets),
    )


def hanging_bar(cells: int = 24) -> Check:
    """A soft heavy bar whose top slides in its plane: 2 C10 (l - l^-2) = rho g (distance to the lower end).

    The one-dimensional solution is exact in the limit of a slender bar; length / half width is 100.
    """
    long, half, density, g, modulus = 0.3, 3 * MM, 1000.0, 9.81, 1500.0
    mesh = box([even(0, half, 1), even(0, half, 1), even(-long, 0, cells)])
    problem = Problem(
        mesh,
        {"body": Material(law("neo-hooke"), {"C10": modulus}, density=density)},
        Loads([], gravity=(0.0, 0.0, -g)),
        fixed=(),
        symmetry={"x0": "x", "y0": "y", "z1": "z"},
    )
    result = solve(problem)
    if result.status != "done":
        raise RuntimeError(result.message)
    space = build_space(mesh)
    lower = np.unique(space.surfaces["z0"])
    sag = -result.states[0].displacement[lower, 2].mean()

    def stretch(Z: float) -> float:
        return brentq(lambda l: 2 * modulus * (l - l**-2) - density * g * Z, 1.0, 10.0, xtol=1e-14)

    exact = quad(lambda Z: stretch(Z) - 1, 0, long)[0]
    return Check(
        f"heavy hanging bar, neo-Hooke, top stretch {stretch(long):.2f}",
        "lengthening",
        float(abs(sag / exact - 1)),
        1e-3,
        len(mesh.tets),
    )


def homogeneous(name: str, mode: str, stretch: float) -> Check:
    """A cube in a homogeneous mode under the closed form's nominal stress; planar: two sides slide."""
    side = 10 * MM
    mesh = box([even(0, side, 1)] * 3, names={"x1": "tip"})
    symmetry = {"x0": "x", "y0": "y", "z0": "z"} | ({"y1": "y"} if mode == "planar" else {})
    space = build_space(mesh)
    sample = material(name)
    quiet = Problem(mesh, {"body": sample}, Loads([]), fixed=(), symmetry=symmetry)
    system = System(quiet, space)
    x = system.rest()
    for l in 1 + (stretch - 1) * np.linspace(0, 1, 4)[1:]:
        stress = float(nominal_stress(sample.law, sample.parameters, mode, l)[0])
        if mode == "uniaxial":
            # the deck's way: a force on the whole tip, of which two planes leave a quarter
            force = (stress * (2 * side) ** 2, 0.0, 0.0)
            system.dead = System(replace(quiet, loads=Loads([], tip_force=force)), space).dead
        else:
            system.dead = traction(space, "tip", lambda X, s=stress: np.broadcast_to([s, 0.0, 0.0], X.shape))
            if mode == "equibiaxial":
                system.dead += traction(
                    space, "y1", lambda X, s=stress: np.broadcast_to([0.0, s, 0.0], X.shape)
                )
        x = settle(system, x, tolerance=1e-11).x
    exact = space.points * (principal_stretches(mode, stretch)[:, 0] - 1)
    error = float(np.max(np.abs(system.displacement(x) - exact))) / (abs(stretch - 1) * side)
    return Check(f"{mode}, {name}, stretch {stretch:g}", "displacement, worst node", error, 1e-7, 6)


# -- manufactured solutions --------------------------------------------------------------------------

SIDE = 10 * MM
_MU = 2 * SAMPLES["yeoh"]["C10"]


@dataclass(frozen=True)
class Manufactured:
    """A map, its pressure and the loads that make it an equilibrium of the Yeoh law.

    bulk : finite: the map also dilates and p = K (J - 1); infinite: det F = 1 and p is free to choose
    """

    bulk: float

    def position(self, X: np.ndarray) -> np.ndarray:
        """Two successive smooth shears, with finite bulk a smooth dilation along z after them."""
        X, Y, Z = np.moveaxis(np.asarray(X) / SIDE, -1, 0)
        x = X + 0.15 * np.sin(1.3 * Y + 0.4) * np.cos(0.9 * Z)
        z = Z + 0.2 * np.sin(1.1 * x + 0.2) * np.cos(0.7 * Y)
        if np.isfinite(self.bulk):
            z = z + 0.04 * np.sin(1.2 * z + 0.5 * Y)
        return SIDE * np.stack([x, Y, z], axis=-1)

    def gradient(self, X: np.ndarray) -> np.ndarray:
        """F, in closed form."""
        X, Y, Z = np.moveaxis(np.asarray(X) / SIDE, -1, 0)
        first = np.zeros((*X.shape, 3, 3))
        first[..., range(3), range(3)] = 1.0
        second, third = first.copy(), first.copy()
        first[..., 0, 1] = 0.15 * 1.3 * np.cos(1.3 * Y + 0.4) * np.cos(0.9 * Z)
        first[..., 0, 2] = -0.15 * 0.9 * np.sin(1.3 * Y + 0.4) * np.sin(0.9 * Z)
        x = X + 0.15 * np.sin(1.3 * Y + 0.4) * np.cos(0.9 * Z)
        second[..., 2, 0] = 0.2 * 1.1 * np.cos(1.1 * x + 0.2) * np.cos(0.7 * Y)
        second[..., 2, 1] = -0.2 * 0.7 * np.sin(1.1 * x + 0.2) * np.sin(0.7 * Y)
        if np.isfinite(self.bulk):
            z = Z + 0.2 * np.sin(1.1 * x + 0.2) * np.cos(0.7 * Y)
            third[..., 2, 1] = 0.04 * 0.5 * np.cos(1.2 * z + 0.5 * Y)
            third[..., 2, 2] += 0.04 * 1.2 * np.cos(1.2 * z + 0.5 * Y)
        return third @ second @ first

    def pressure(self, X: np.ndarray) -> np.ndarray:
        if np.isfinite(self.bulk):
            return self.bulk * (np.linalg.det(self.gradient(X)) - 1)
        a, b, c = np.moveaxis(np.asarray(X) / SIDE, -1, 0)
        return _MU * (0.15 * np.sin(2.0 * a + b) - 0.25 * np.cos(1.5 * c - 0.7 * b))

    def stress(self, X: np.ndarray) -> np.ndarray:
        """P = 2 W1 J^-2/3 (F - I1/3 F^-T) + p J F^-T, written anew, Pa."""
        F = self.gradient(X)
        J = np.linalg.det(F)[..., None, None]
        H = np.swapaxes(np.linalg.inv(F), -1, -2)
        I1 = np.sum(F * F, axis=(-1, -2))[..., None, None]
        numbers = SAMPLES["yeoh"]
        W1 = numbers["C10"] + 2 * numbers["C20"] * (J ** (-2 / 3) * I1 - 3)
        return 2 * W1 * J ** (-2 / 3) * (F - I1 / 3 * H) + self.pressure(X)[..., None, None] * J * H

    def force(self, X: np.ndarray) -> np.ndarray:
        """-Div P by central differences of eighth order."""
        h = 0.02 * SIDE
        out = np.zeros(X.shape)
        for j in range(3):
            for k, c in enumerate((4 / 5, -1 / 5, 4 / 105, -1 / 280), 1):
                step = np.zeros(3)
                step[j] = k * h
                out -= c / h * (self.stress(X + step)[..., j] - self.stress(X - step)[..., j])
        return out


def bulged(points: np.ndarray) -> np.ndarray:
    """A block's nodes moved so that its elements become curved; all of its sides bend."""
    X, Y, Z = points.T / SIDE
    return SIDE * np.stack(
        [X + 0.08 * np.sin(2.5 * Y) * np.cos(2 * Z), Y + 0.08 * np.sin(2.2 * Z), Z + 0.06 * np.sin(2.4 * X)],
        axis=1,
    )


def manufactured(cells: int, bulk: float, curved: bool) -> tuple[float, float]:
    """L2 errors of u (relative to its L2 norm) and of p (likewise) on a block of cells^3 cells of six tets.

    All of the boundary is held at the map; with infinite bulk the side x1 carries the exact traction instead,
    which fixes the pressure's mean.
    """
    exact = Manufactured(bulk)
    sides = ["x0", "x1", "y0", "y1", "z0", "z1"]
    mesh = box([even(0, SIDE, cells)] * 3)
    if curved:
        mesh = moved(mesh, bulged)
    space = build_space(mesh)
    if math.isinf(bulk):
        sides.remove("x1")
    problem = Problem(mesh, {"body": material("yeoh", bulk)}, Loads([]), fixed=tuple(sides))
    system = System(problem, space)
    system.dead = body_force(space, exact.force)
    if math.isinf(bulk):
        system.dead += surface_load(space, "x1", exact.stress)
    x = system.rest()
    rest = space.points
    # held values are exact; the rest starts a little off, so that nothing is given away
    x[: system.n_u] = (exact.position(rest) - rest).ravel()
    x[system.pattern.free[system.pattern.free < system.n_u]] *= 0.95
    x = settle(system, x, tolerance=1e-10).x
    return errors(space, system, x, exact)


def surface_load(space: Space, surface: str, stress: Place) -> np.ndarray:
    """(n_dofs,) nodal forces of the traction P(X) N dA."""
    faces = space.surfaces[surface]
    weight, value, d1, d2 = triangle_rule(8)
    corner = space.points[faces]
    area = np.cross(np.einsum("fai,qa->fqi", corner, d1), np.einsum("fai,qa->fqi", corner, d2))
    load = np.einsum("fqij,fqj->fqi", stress(np.einsum("fai,qa->fqi", corner, value)), area)
    out = np.zeros(space.n_dofs)
    np.add.at(out[: 3 * space.n_nodes].reshape(-1, 3), faces, np.einsum("q,fqi,qa->fai", weight, load, value))
    return out


def errors(space: Space, system: System, x: np.ndarray, exact: Manufactured) -> tuple[float, float]:
    """Relative L2 errors of u and p with a rule of order 8."""
    xi, w = get_quadrature(RefTet, 8)
    basis = [ElementTetP2().lbasis(xi, a) for a in range(10)]
    value = np.stack([b[0] for b in basis], axis=1)
    slope = np.stack([b[1] for b in basis], axis=-1)  # (3, q, a)
    linear = np.stack([ElementTetP1().lbasis(xi, a)[0] * np.ones(len(w)) for a in range(4)], axis=1)
    nodes = space.points[space.tets]
    place = np.einsum("qa,eai->eqi", value, nodes)
    volume = np.linalg.det(np.einsum("eai,jqa->eqij", nodes, slope)) * w
    u = np.einsum("qa,eai->eqi", value, system.displacement(x)[space.tets])
    p = np.einsum("qa,ea->eq", linear, x[system.n_u :][space.tets[:, :4]])
    true_u, true_p = exact.position(place) - place, exact.pressure(place)
    error_u = np.sum(volume * np.sum((u - true_u) ** 2, axis=-1)) / np.sum(
        volume * np.sum(true_u**2, axis=-1)
    )
    error_p = np.sum(volume * (p - true_p) ** 2) / np.sum(volume * true_p**2)
    return math.sqrt(error_u), math.sqrt(error_p)


def rates(cells: Sequence[int], bulk: float, curved: bool) -> list[tuple[int, float, float, float, float]]:
    """A row a mesh: cells along a side, error of u, its rate, error of p, its rate (nan on the first)."""
    rows: list[tuple[int, float, float, float, float]] = []
    for n in cells:
        u, p = manufactured(n, bulk, curved)
        ru = rp = math.nan
        if rows:
            m, u0, _, p0, _ = rows[-1]
            ru, rp = math.log(u0 / u) / math.log(n / m), math.log(p0 / p) / math.log(n / m)
        rows.append((n, u, ru, p, rp))
    return rows


# -- the six-chamber fast module of shared/meshes ----------------------------------------------------

EVIDENCE = {0.5e3: 1.996, 1.25e3: 4.724, 2.375e3: 8.394, 4.0625e3: 13.403, 20e3: 53.04}
"""Pa -> deg: another code's numbers on the same mesh, with the tip's corner nodes weighing the same."""


def evidence_mesh() -> Path:
    """Where fast_module_3mm.msh would be."""
    root = Path(__file__).resolve().parents[1]
    shared = os.environ.get("FEM_SPA_SHARED")
    return (Path(shared) if shared else root.parent / "shared") / "meshes" / "fast_module_3mm.msh"


def fast_module() -> list[tuple[float, float, float, float]]:
    """A row a pressure: Pa; in deg the other code's angle, ours by its measure, ours weighted with area."""
    from geometry.files import read_mesh

    mesh = read_mesh(evidence_mesh(), "mm")
    problem = Problem(
        mesh,
        {
            "body": material("yeoh"),
            "stiff": Material(law("neo-hooke"), {"C10": 2.2e6}),
        },
        Loads([{"main": p} for p in EVIDENCE]),
        symmetry={"symmetry": "y"},
    )
    space = build_space(mesh)
    keep = KeepStates()
    result = solve(problem, observers=[keep], space=space)
    if result.status != "done":
        raise RuntimeError(result.message)
    nodes = np.unique(space.surfaces["tip"][:, :3])
    plane = [2, 0]  # positive angles turn x towards -z, which is z towards x
    out = []
    points = [
        (s, r) for s, r in zip(keep.states, result.rows, strict=True) if r.is_point and r.pressure["main"] > 0
    ]
    for (pressure, other), (state, row) in zip(EVIDENCE.items(), points, strict=True):
        assert row.pressure["main"] == pressure
        rest = space.points[nodes][:, plane]
        turned = rotation(rest, rest + state.displacement[nodes][:, plane])
        out.append((pressure, other, math.degrees(turned), math.degrees(row.angle)))
    return out


# -- the page ----------------------------------------------------------------------------------------


def closed_forms() -> Iterator[Check]:
    """Every case of the table, in order."""
    for name in ("neo-hooke", "mooney-rivlin", "yeoh"):
        for degrees in (60.0, 90.0):
            yield flexure(name, degrees)
    yield from sphere()[0]
    for name in ("neo-hooke", "mooney-rivlin", "yeoh"):
        yield cylinder(name)
    yield hanging_bar()
    for mode in MODES:
        checks = [homogeneous(name, mode, l) for name in SAMPLES for l in (0.8, 1.5)]
        worst = max(checks, key=lambda c: c.error)
        yield replace(worst, case=f"{mode}, all {len(SAMPLES)} laws, stretches 0.8 and 1.5")


def line(*cells: object) -> str:
    return "| " + " | ".join(str(c) for c in cells) + " |"


def main() -> None:
    started = time.perf_counter()
    versions = ", ".join(
        f"{p} {importlib.metadata.version(p)}" for p in ("numpy", "scipy", "scikit-fem", "numba")
    )
    print("# Verification of the solver\n")
    print(
        "What `python benchmarks/verification.py > docs/verification.md` prints; tests/solid holds the same"
    )
    print("cases to the bounds given here.\n")
    print(
        f"{datetime.date.today()}, {platform.system()} {platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, {versions}, linear solver {backend()}.\n"
    )
    print("## Closed forms\n")
    print("Errors are relative. Incompressible; Taylor-Hood tets (P2 displacement, P1 pressure).\n")
    print(line("case", "error of", "tets", "error", "bound"))
    print(line("---", "---", "---:", "---:", "---:"))
    for check in closed_forms():
        print(line(check.case, check.measure, check.elements, f"{check.error:.1e}", f"{check.bound:g}"))
        sys.stdout.flush()
    print("\nThe tube lies between two parallel planes of symmetry; the bar is held to the")
    print("one-dimensional solution, exact for a slender bar. Block and tube: curved where the shape is.\n")
    print("## Manufactured solutions\n")
    print(
        "Two successive smooth shears (det F = 1) and a smooth pressure, Yeoh's law; with finite bulk modulus"
    )
    print("(20 mu) a dilation after them and p = K (J - 1). Relative L2 errors; orders 3 and 2 are ideal.\n")
    for title, bulk, curved, cells in (
        ("Incompressible, straight tets, one side under traction", math.inf, False, (3, 6, 9, 12)),
        ("Incompressible, curved tets, one side under traction", math.inf, True, (3, 6, 9, 12)),
        (
            "Bulk modulus 20 mu, straight tets, displacement given on all sides",
            20 * _MU,
            False,
            (3, 6, 9, 12),
        ),
    ):
        print(f"{title}:\n")
        print(line("cells a side", "error of u", "order", "error of p", "order"))
        print(line("---:", "---:", "---:", "---:", "---:"))
        for n, u, ru, p, rp in rates(cells, bulk, curved):
            order = ("", "") if math.isnan(ru) else (f"{ru:.2f}", f"{rp:.2f}")
            print(line(n, f"{u:.2e}", order[0], f"{p:.2e}", order[1]))
        print()
        sys.stdout.flush()
    print("## Another code on the same mesh\n")
    if evidence_mesh().exists():
        print("Six-chamber fast module, half, h = 3 mm, straight tets, no contact; body Yeoh 0.11/0.02 MPa,")
        print("lowest millimetre neo-Hooke 2.2 MPa. Angle of the tip in degrees: the other code's; ours with")
        print(
            "the tip's corner nodes weighing the same, as there; the product's `angle`: each by its area.\n"
        )
        print(line("kPa", "other code", "ours", "difference", "`angle`"))
        print(line("---:", "---:", "---:", "---:", "---:"))
        for pressure, other, same, own in fast_module():
            print(
                line(
                    f"{pressure / 1e3:g}",
                    f"{other:g}",
                    f"{same:.3f}",
                    f"{100 * (same / other - 1):+.3f} %",
                    f"{own:.3f}",
                )
            )
    else:
        print(f"Left out: {evidence_mesh().name} is not here (FEM_SPA_SHARED names its folder's parent).")
    print(f"\nAll of this took {time.perf_counter() - started:.0f} s.")


def backend() -> str:
    """Name of the linear solver in use."""
    mesh = box([even(0, SIDE, 1)] * 3)
    system = System(Problem(mesh, {"body": material("yeoh")}, Loads([]), fixed=("x0",)), build_space(mesh))
    return make_solver(system.pattern).name


if __name__ == "__main__":
    main()
