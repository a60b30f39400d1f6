"""Manufactured solutions: rates of convergence of displacement and pressure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from skfem import ElementTetP1, ElementTetP2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from fem_spa.solid.cavity import triangle_rule
from fem_spa.solid.problem import Loads, Problem
from fem_spa.solid.space import Space, build_space
from fem_spa.solid.system import System
from verification.blocks import MM, Place, box, even, moved
from verification.equilibrium import SAMPLES, body_force, material, settle

SIDE = 10 * MM
MODULUS = 2 * SAMPLES["yeoh"]["C10"]


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
        return MODULUS * (0.15 * np.sin(2.0 * a + b) - 0.25 * np.cos(1.5 * c - 0.7 * b))

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
