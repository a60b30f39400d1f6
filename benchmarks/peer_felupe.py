"""The case by FElupe. Started by solver_speed.py in a process of its own.

    python peer_felupe.py CASE.npz RESULT.json --repeats 1 --order 2

Tetra10 with P1 pressure (two mixed fields), the same law as a material of FElupe's own kind, its pressure
load on the cavity, both threads (`parallel=True`), its Newton-Raphson, PARDISO (MKL) through pypardiso.
FElupe has no boundary of tets: the faces' region is put together here from its own classes.
"""

from __future__ import annotations

import argparse
import os
import time

import felupe as fem
import numpy as np
from felupe.math import cdya_ik, cdya_il, det, dya, inv, transpose
from felupe.mechanics import SolidBody, SolidBodyPressure
from felupe.quadrature import Scheme
from solver_case import C10, C20, CURVE, EVIDENCE, FLOOR, TOLERANCE, Case, peak_mb, report, tip_angle, walk

MOST = 10
"""Newton iterations after which a step is halved."""


class Rubber(fem.ConstitutiveMaterial):
    """C10 (I1bar - 3) + C20 (I1bar - 3)^2 + p (J - 1); the state variables carry C10 and C20 (MPa)."""

    def __init__(self) -> None:
        self.x = [np.eye(3), np.zeros(1), np.zeros(2)]
        self.parallel = True

    def _terms(self, x):
        F, p, constants = x[0], x[1][0], x[-1]
        J = det(F)
        H = transpose(inv(F, determinant=J))
        m = J ** (-2 / 3)
        trace = np.einsum("ij...,ij...->...", F, F)
        A = 2 * m * (F - trace / 3 * H)
        W1 = constants[0] + 2 * constants[1] * (m * trace - 3)
        return F, p, J, H, m, trace, A, W1, 2 * constants[1]

    def _gradient(self, x):
        _, p, J, H, _, _, A, W1, _ = self._terms(x)
        return [W1 * A + p * J * H, (J - 1)[None], x[-1]]

    def _hessian(self, x):
        F, p, J, H, m, trace, A, W1, W11 = self._terms(x)
        eye = np.eye(3).reshape(3, 3, 1, 1)
        FH = dya(F, H)
        HH = dya(H, H)
        HlHk = cdya_il(H, H)
        c = 2 * m * W1
        out = W11 * dya(A, A)
        out += c * cdya_ik(eye, eye)
        out -= c * 2 / 3 * (FH + np.einsum("ijkl...->klij...", FH))
        out += (c * 2 / 9 * trace + p * J) * HH
        out += (c * trace / 3 - p * J) * HlHk
        return [out, J * H, None]


def face_region(mesh: fem.Mesh, case: Case, surface: str) -> fem.Region:
    """The faces of a surface as a region of FElupe's kind: tets turned so that the face is t = 0."""
    corners = case.tets
    face_of = {tuple(sorted(face)): face for face in case.surfaces[surface].tolist()}
    cells = []
    for tet in corners.tolist():
        for opposite in range(4):
            key = tuple(sorted(tet[:opposite] + tet[opposite + 1 :]))
            if key in face_of:
                cells.append([*face_of[key][::-1], tet[opposite]])  # inward from t = 0: positive volume
    number = {tuple(pair): i for i, pair in enumerate(case.edges()[0].tolist())}
    n = len(case.points)
    order = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
    full = [[*cell, *(n + number[tuple(sorted((cell[i], cell[j])))] for i, j in order)] for cell in cells]
    # six points of degree 4 on the triangle
    a, b = 0.445948490915965, 0.091576213509771
    wa, wb = 0.223381589678011 / 2, 0.109951743655322 / 2
    plane = [(a, a), (1 - 2 * a, a), (a, 1 - 2 * a), (b, b), (1 - 2 * b, b), (b, 1 - 2 * b)]
    rule = Scheme(np.array([[r, s, 0.0] for r, s in plane]), np.array([wa] * 3 + [wb] * 3))
    region = fem.Region(fem.Mesh(mesh.points, np.array(full), "tetra10"), fem.QuadraticTetra(), rule)
    area = -np.cross(region.dXdr[:, 0], region.dXdr[:, 1], axis=0) * rule.weights.reshape(-1, 1)
    region.dV = np.linalg.norm(area, axis=0)
    region.normals = area / region.dV
    return region


class Body:
    """Fields, items and FElupe's Newton-Raphson; the load is in MPa."""

    def __init__(self, case: Case, order: int, linear: str) -> None:
        self.case, self.order = case, order
        pairs, edges = case.edges()
        points = np.vstack([case.points, case.points[pairs].mean(axis=1)])
        n = len(case.points)
        mesh = fem.Mesh(points, np.hstack([case.tets, n + edges]), "tetra10")
        region = fem.RegionQuadraticTetra(mesh, quadrature=fem.TetrahedronQuadrature(order=5))
        dual = fem.Mesh(case.points, case.tets, "tetra")
        pressure = fem.Field(fem.RegionTetra(dual, quadrature=region.quadrature, grad=False))
        self.field = fem.FieldContainer([fem.Field(region, dim=3), pressure])
        names = np.array(case.names)[case.region]
        constants = np.array([[C10[name] for name in names], [C20[name] for name in names]])
        constants = np.repeat(constants[:, None, :], len(region.quadrature.weights), axis=1)
        self.solid = SolidBody(Rubber(), self.field, statevars=constants)
        self.on_faces = fem.FieldContainer([fem.Field(face_region(mesh, case, "cavity main"), dim=3)])
        self.load = SolidBodyPressure(self.on_faces, pressure=0.0)

        def nodes(surface: str) -> np.ndarray:
            corner = np.zeros(len(points), dtype=bool)
            for face in case.surfaces[surface]:
                corner[face] = True
            faces = case.surfaces[surface]
            sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
            number = {tuple(pair): i for i, pair in enumerate(pairs.tolist())}
            corner[[n + number[tuple(side)] for side in sides.tolist()]] = True
            return np.flatnonzero(corner)

        held = np.zeros(3 * len(points) + n, dtype=bool)
        for axis in range(3):
            held[3 * nodes("base") + axis] = True
        held[3 * nodes("symmetry") + 1] = True
        self.dof0, self.dof1 = np.flatnonzero(held), np.flatnonzero(~held)
        self.n_u = 3 * len(points)
        self.volume_norm = float(
            np.linalg.norm(np.bincount(case.tets.ravel(), np.repeat(region.dV.sum(axis=0) / 4, 4), n))
        )
        self.tip = np.unique(case.surfaces["tip"])
        self.seconds = {"linear": 0.0}
        self.solver = self.timed(make_solver(linear))
        self.iterations = 0
        self.points = points

    def timed(self, solver):
        def solve(A, b):
            started = time.perf_counter()
            x = solver(A, b)
            self.seconds["linear"] += time.perf_counter() - started
            self.iterations += 1
            return x

        return solve

    def check(self, dx, x, f, xtol, ftol, dof1=None, dof0=None, items=None):
        """FElupe's test of convergence with fem_spa's measure."""
        force = self.solid.results.force
        internal = np.asarray(force.toarray()).ravel()[: self.n_u]
        free = f.ravel().copy()
        free[self.dof0] = 0.0
        u = np.linalg.norm(free[: self.n_u]) / max(np.linalg.norm(internal), FLOOR)
        error = max(u, np.linalg.norm(free[self.n_u :]) / self.volume_norm)
        return np.linalg.norm(dx), error, bool(error <= TOLERANCE)

    def vector(self) -> np.ndarray:
        return np.concatenate([field.values.ravel() for field in self.field.fields])

    def equilibrium(self, load: float, guess: np.ndarray) -> tuple[np.ndarray | None, int]:
        """FElupe's Newton-Raphson under `load` (kPa)."""
        self.field[0].values[:] = guess[: self.n_u].reshape(-1, 3)
        self.field[1].values[:] = guess[self.n_u :].reshape(-1, 1)
        self.load.update(1e-3 * load)
        before = self.iterations
        try:
            with np.errstate(invalid="ignore", over="ignore"):
                result = fem.newtonraphson(
                    x0=self.field,
                    items=[self.solid, self.load],
                    dof0=self.dof0,
                    dof1=self.dof1,
                    ext0=np.zeros(len(self.dof0)),
                    solver=self.solver,
                    check=self.check,
                    maxiter=MOST,
                    kwargs={"parallel": True},
                    verbose=0,
                )
        except (fem.tools.NewtonConvergenceError, ArithmeticError, ValueError):
            return None, self.iterations - before
        self.field = result.x
        return self.vector(), self.iterations - before

    def angle(self) -> float:
        rest = self.points[self.tip]
        return tip_angle(rest, rest + self.field[0].values[self.tip])

    def curve(self, points: list[float]) -> dict:
        """Angles (deg) at the points (kPa), from rest."""
        self.seconds = dict.fromkeys(self.seconds, 0.0)
        angles: list[float] = []
        started = time.perf_counter()
        rest = np.zeros(self.n_u + len(self.case.points))
        iterations = walk(points, rest, self.order, self.equilibrium, lambda: angles.append(self.angle()))
        return {
            "seconds": time.perf_counter() - started,
            "iterations": iterations,
            "factorizations": sum(iterations),
            "angles": angles,
            "parts": dict(self.seconds),
        }


def make_solver(kind: str):
    """`pypardiso`: as FElupe's manual has it (LU). `symmetric`: LDL^T of the upper triangle."""
    import pypardiso
    from scipy.sparse import triu

    if kind == "pypardiso":
        return pypardiso.spsolve
    ldl = pypardiso.PyPardisoSolver(mtype=-2)
    ldl.set_iparm(1, 1)
    for number, value in {2: 2, 10: 8, 11: 0, 13: 0, 21: 1, 24: 1}.items():
        ldl.set_iparm(number, value)

    kept: list[np.ndarray] = []

    def solve(A, b):
        upper = triu(A, format="csr")
        upper.setdiag(upper.diagonal())  # a stored zero where a pressure has none
        upper.sort_indices()
        pattern = np.concatenate([upper.indptr, upper.indices])
        same = bool(kept) and np.array_equal(kept[0], pattern)
        if kept and not same:
            ldl.free_memory(everything=True)
        kept[:] = [pattern]
        ldl.set_phase(23 if same else 13)  # the analysis is kept with the pattern
        return ldl._call_pardiso(upper, np.asfortranarray(b))

    return solve


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("case")
    parser.add_argument("result")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--order", type=int, default=3, help="of the predictor")
    parser.add_argument("--solver", default="symmetric", choices=["pypardiso", "symmetric"])
    options = parser.parse_args()
    started = time.perf_counter()
    body = Body(Case.load(options.case), options.order, options.solver)
    warm = time.perf_counter() - started
    curves = [body.curve(CURVE) for _ in range(options.repeats)]
    peak = peak_mb()
    evidence = body.curve(EVIDENCE)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    kind = {"symmetric": "PARDISO LDL^T", "pypardiso": "pypardiso.spsolve (PARDISO LU)"}[options.solver]
    report(
        options.result,
        {
            "settings": f"{kind}, parallel, {cores} threads, 14 quadrature points, "
            f"predictor of order {options.order}",
            "version": fem.__version__,
            "curves": curves,
            "evidence": evidence["angles"],
            "warm": warm,
            "peak_mb": peak,
        },
    )


if __name__ == "__main__":
    main()
