"""The case by NGSolve. Started by solver_speed.py in a process of its own.

    python peer_ngsolve.py CASE.npz RESULT.json --repeats 1 --order 2

P2 displacement, P1 pressure (Taylor-Hood), the same energies by symbolic variation, the cavity's pressure as
the potential -p V whose two derivatives NGSolve forms itself. TaskManager on all cores, SIMD, expressions
compiled to machine code (`realcompile`) where a compiler is there, symmetric storage and assembly, LDL^T
analysed once. What was tried besides is in docs/speed.md.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import time
from pathlib import Path

import numpy as np

os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"  # for ngscxx

import ngsolve as ng
import ngsolve.config.config as ng_config
from netgen.meshing import Element2D, Element3D, FaceDescriptor, MeshPoint, Pnt
from netgen.meshing import Mesh as NetgenMesh
from solver_case import C10, C20, CURVE, EVIDENCE, FLOOR, TOLERANCE, Case, peak_mb, report, tip_angle, walk

MOST = 10
"""Newton iterations after which a step is halved."""


def netgen_mesh(case: Case) -> NetgenMesh:
    """The case's tets and surfaces in NGSolve's mesh, nodes in the same order."""
    mesh = NetgenMesh(dim=3)
    ids = [mesh.Add(MeshPoint(Pnt(*map(float, p)))) for p in case.points]
    for i, name in enumerate(case.names):
        mesh.SetMaterial(i + 1, name)
    for i, (name, faces) in enumerate(case.surfaces.items()):
        mesh.Add(FaceDescriptor(surfnr=i + 1, domin=1, domout=0, bc=i + 1))
        mesh.SetBCName(i, name)
        for face in faces.tolist():
            mesh.Add(Element2D(i + 1, [ids[n] for n in face]))
    for tet, region in zip(case.tets.tolist(), case.region.tolist(), strict=True):
        mesh.Add(Element3D(region + 1, [ids[n] for n in tet]))
    return mesh


class Body:
    """Spaces, forms and Newton's method; the load is in MPa."""

    def __init__(self, case: Case, compiled: str, inverse: str, order: int) -> None:
        self.case, self.order, self.inverse = case, order, inverse
        mesh = ng.Mesh(netgen_mesh(case))
        displacement = ng.VectorH1(mesh, order=2, dirichlet="base", dirichlety="symmetry")
        self.fes = displacement * ng.H1(mesh, order=1)
        u, p = self.fes.TrialFunction()
        c10, c20 = mesh.MaterialCF(C10), mesh.MaterialCF(C20)
        F = ng.Id(3) + ng.Grad(u)
        J = ng.Det(F)
        I1 = ng.InnerProduct(F, F) * J ** (-2 / 3)
        solid = c10 * (I1 - 3) + c20 * (I1 - 3) ** 2 + p * (J - 1)
        self.load = ng.Parameter(0.0)
        normal = ng.specialcf.normal(3)
        X = ng.CoefficientFunction((ng.x, ng.y, ng.z))
        surface = self.load / 3 * ng.InnerProduct(X + u, ng.Cof(ng.Id(3) + ng.Grad(u).Trace()) * normal)

        started = time.perf_counter()
        if compiled == "real":
            solid = solid.Compile(realcompile=True, wait=True)
            surface = surface.Compile(realcompile=True, wait=True)
        elif compiled == "interpreted":
            solid, surface = solid.Compile(), surface.Compile()
        self.rule = ng.IntegrationRule(ng.TET, 5)
        solid = ng.Variation(solid * ng.dx(intrules={ng.TET: self.rule}))
        surface = ng.Variation(surface * ng.ds("cavity main"))
        self.tangent = ng.BilinearForm(self.fes, symmetric=True)
        self.tangent += solid
        self.tangent += surface
        self.solid = ng.BilinearForm(self.fes, symmetric=True)
        self.solid += solid
        self.surface = ng.BilinearForm(self.fes, symmetric=True)
        self.surface += surface

        self.x = ng.GridFunction(self.fes)
        self.u_part = self.fes.Range(0)
        self.free = np.array([bool(b) for b in self.fes.FreeDofs()])
        volumes = ng.LinearForm(self.fes)
        volumes += self.fes.TestFunction()[1] * ng.dx
        volumes.Assemble()
        self.volume_norm = float(np.linalg.norm(volumes.vec.FV().NumPy()))
        self.tip = np.unique(case.surfaces["tip"])
        self.residual, self.other, self.step = (self.x.vec.CreateVector() for _ in range(3))
        self.factors = None
        self.error()
        self.assemble()
        self.warm = time.perf_counter() - started  # with the compilation
        self.seconds = {"residual": 0.0, "assembly": 0.0, "factorization": 0.0, "solution": 0.0}

    def error(self) -> float:
        """The residual at x and its size, as fem_spa measures it."""
        self.solid.Apply(self.x.vec, self.residual)
        inner = self.residual.FV().NumPy()
        internal = float(np.linalg.norm(inner[self.u_part.start : self.u_part.stop]))
        self.surface.Apply(self.x.vec, self.other)
        self.residual.data += self.other
        free = np.where(self.free, inner, 0.0)
        cut = self.u_part.stop
        u = float(np.linalg.norm(free[:cut])) / max(internal, FLOOR)
        return max(u, float(np.linalg.norm(free[cut:])) / self.volume_norm)

    def assemble(self) -> None:
        self.tangent.AssembleLinearization(self.x.vec)

    def factorize(self, inverse: str | None = None) -> None:
        """LDL^T; the analysis is kept."""
        if self.factors is None:
            self.factors = self.tangent.mat.Inverse(self.fes.FreeDofs(), inverse=inverse or self.inverse)
        else:
            self.factors.Update()

    def try_solvers(self, solvers: list[str]) -> dict[str, float]:
        """Seconds of one factorization and solution by each linear solver that is there."""
        self.load.Set(1e-4)
        self.error()
        self.assemble()
        found = {}
        for name in solvers:
            try:
                self.factors = None
                self.factorize(name)
                times = []
                for _ in range(4):
                    started = time.perf_counter()
                    self.factorize(name)
                    self.step.data = self.factors * self.residual
                    times.append(time.perf_counter() - started)
                found[name] = float(np.median(times))
            except Exception as error:
                print(f"NGSolve: {name}: {error}", file=sys.stderr)
        return found

    def angle(self) -> float:
        values = self.x.components[0].vec.FV().NumPy().reshape(3, -1)
        rest = self.case.points[self.tip]
        return tip_angle(rest, rest + values[:, self.tip].T)

    def equilibrium(self, load: float, guess: np.ndarray) -> tuple[np.ndarray | None, int]:
        """Newton's method under `load` (kPa): the unknowns, None where it failed, and iterations."""
        clock = time.perf_counter
        self.load.Set(1e-3 * load)
        vector = self.x.vec.FV().NumPy()
        vector[:] = guess
        for iteration in range(MOST + 1):
            t = [clock()]
            error = self.error()
            t.append(clock())
            self.seconds["residual"] += t[1] - t[0]
            if error <= TOLERANCE:
                return vector, iteration
            if iteration == MOST or not error < 1e6:
                break
            self.assemble()
            t.append(clock())
            self.factorize()
            t.append(clock())
            self.step.data = self.factors * self.residual
            self.x.vec.data -= self.step
            t.append(clock())
            for name, before, after in zip(
                ("assembly", "factorization", "solution"), t[1:-1], t[2:], strict=True
            ):
                self.seconds[name] += after - before
        return None, iteration

    def curve(self, points: list[float]) -> dict:
        """Angles (deg) at the points (kPa), from rest."""
        self.seconds = dict.fromkeys(self.seconds, 0.0)
        self.factors = None
        angles: list[float] = []
        started = time.perf_counter()
        rest = np.zeros(self.fes.ndof)
        iterations = walk(points, rest, self.order, self.equilibrium, lambda: angles.append(self.angle()))
        return {
            "seconds": time.perf_counter() - started,
            "iterations": iterations,
            "factorizations": sum(iterations),
            "angles": angles,
            "parts": dict(self.seconds),
        }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("case")
    parser.add_argument("result")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--order", type=int, default=3, help="of the predictor")
    parser.add_argument("--solver", default="sparsecholesky", help="sparsecholesky, umfpack or pardiso")
    parser.add_argument("--probe", action="store_true", help="time the linear solvers only")
    parser.add_argument("--compiled", default="auto", choices=["auto", "real", "interpreted", "no"])
    options = parser.parse_args()
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    ng.SetNumThreads(cores)
    compiled = options.compiled
    if compiled == "auto":
        compiled = "real" if shutil.which("ngscxx") and shutil.which("g++") else "interpreted"
    with ng.TaskManager():
        try:
            body = Body(Case.load(options.case), compiled, options.solver, options.order)
        except Exception as error:
            if compiled != "real":
                raise
            print(f"NGSolve: its compiler failed ({error}); expressions are interpreted", file=sys.stderr)
            compiled = "interpreted"
            body = Body(Case.load(options.case), compiled, options.solver, options.order)
        if options.probe:
            report(options.result, {"solvers": body.try_solvers(["sparsecholesky", "umfpack", "pardiso"])})
            return
        curves = [body.curve(CURVE) for _ in range(options.repeats)]
        peak = peak_mb()
        evidence = body.curve(EVIDENCE)
    how = {"real": "compiled by g++", "interpreted": "compiled to its own steps", "no": "not compiled"}
    settings = (
        f"{body.inverse}, {cores} threads, expressions {how[compiled]}"
        f", {len(body.rule.weights)} quadrature points, predictor of order {options.order}"
    )
    report(
        options.result,
        {
            "settings": settings,
            "version": ng_config.NGSOLVE_VERSION_PYTHON,
            "curves": curves,
            "evidence": evidence["angles"],
            "warm": body.warm,
            "peak_mb": peak,
        },
    )


if __name__ == "__main__":
    main()
