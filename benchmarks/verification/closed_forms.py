"""Closed forms against the solver: flexure, thick sphere and tube, a hanging bar, homogeneous modes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, Material, Problem, Result
from fem_spa.solid.space import build_space
from fem_spa.solid.system import System
from materials.registry import law, resolve
from materials.response import MODES, nominal_stress, principal_stretches
from verification.blocks import MM, Place, box, even, moved
from verification.equilibrium import SAMPLES, HeldSystem, material, rotation, settle, traction


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
