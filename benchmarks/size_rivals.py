"""What could take over where the factors do not fit in memory: the rivals on one tangent.

    pip install pyamg
    python benchmarks/size_rivals.py --sizes 3 1.5       # elements of 3 and 1.5 mm
    python benchmarks/size_rivals.py --write             # and the table into docs/reliability.md

The tangent is that of `size.py`'s case at 10 kPa, the right-hand side the cavity's dV/dx, solved to 1e-8.
Every rival has a process of its own with one thread; times are of the processor.

- double, single: PARDISO as `fem_spa.solid.linear` has it, its factors in double or single precision.
- multigrid: GMRES with a block-triangular preconditioner (Elman, Silvester and Wathen, Finite Elements and
  Fast Iterative Solvers, 2014, ch. 4): displacements by smoothed aggregation (PyAMG) with the six rigid
  motions of the deformed body as near null space, pressures by the mass matrix over the shear modulus.
- two levels: the same, displacements by Gauss-Seidel on all nodes and an exact solution on corner nodes.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, triu
from size import DECK, say, table, write
from solver_case import peak_mb

RIVALS = ("double", "single", "multigrid", "two levels")
TOLERANCE = 1e-8
MOST = 300
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
Apply = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Case:
    """system and unknowns at 10 kPa;  data : the tangent;  b : right-hand side (n_free,)"""

    system: Any
    x: np.ndarray
    data: np.ndarray
    b: np.ndarray

    def product(self, v: np.ndarray) -> np.ndarray:
        """The tangent times v."""
        from fem_spa.solid.pattern import symmetric_product

        out = np.empty_like(v)
        pattern = self.system.pattern
        symmetric_product(pattern.indptr, pattern.indices, self.data, v, out)
        return out


def make_case(size: float) -> Case:
    """The tangent at 10 kPa, reached in two steps."""
    from fem_spa.deck import read_deck
    from fem_spa.prepare import prepare
    from fem_spa.solid.path import solve
    from fem_spa.solid.space import build_space
    from fem_spa.solid.system import System

    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder) / "deck.toml"
        deck.write_text(DECK.format(size=size, factors="double", steps=2), encoding="utf-8")
        setup = prepare(read_deck(deck))
    cavity = setup.problem.mesh.cavities[0]
    problem = replace(setup.problem, loads=replace(setup.problem.loads, points=[{cavity: 1e4}]))
    state = solve(problem, setup.steps).states[-1]
    system = System(problem, build_space(problem.mesh))
    x = np.concatenate([state.displacement.ravel(), state.pressure_field])
    system.settle_layers(x)
    pressure = np.array([state.cavity_pressure[cavity]])
    data = system.tangent(x, pressure)
    return Case(system, x, data, system.evaluate(x, pressure, 1.0).gradient[0])


def pardiso(case: Case, factors: str) -> tuple[Apply, float]:
    """Solutions by the program's own solver, and the size of its factors."""
    from fem_spa.solid.linear import Pardiso

    solver = Pardiso(case.system.pattern, factors)
    solver.factorize(case.data)
    return solver.solve, solver._factor_bytes


def blocks(case: Case, levels: str) -> Apply:
    """The block-triangular preconditioner; `levels` is how displacements are solved for."""
    system = case.system
    pattern, space = system.pattern, system.space
    n = pattern.n_free
    upper = csr_matrix((case.data, pattern.indices, pattern.indptr), shape=(n, n))
    full = (upper + triu(upper, 1).T).tocsr()
    n_u = int((pattern.free < system.n_u).sum())
    stiffness, coupling = full[:n_u, :n_u].tocsr(), full[:n_u, n_u:].tocsr()
    node, axis = np.divmod(pattern.free[:n_u], 3)
    solve = aggregation(system, case.x, stiffness, node, axis) if levels == "multigrid" else None
    solve = solve or two_levels(space, pattern, stiffness, node, axis)

    shape = space.pressure_shape
    local = np.einsum("eq,qa,qb->eab", space.weight, shape, shape) / system.length_unit**3
    rows, columns = np.repeat(space.tets[:, :4], 4, axis=1), np.tile(space.tets[:, :4], (1, 4))
    mass = coo_matrix((local.ravel(), (rows.ravel(), columns.ravel())), shape=(space.n_vertices,) * 2).tocsr()
    inverse_diagonal = 1.0 / mass.diagonal()

    def precondition(v: np.ndarray) -> np.ndarray:
        p = np.zeros(n - n_u)
        for _ in range(10):  # the diagonal leaves the mass matrix well conditioned: Richardson is enough
            p -= 0.7 * inverse_diagonal * (mass @ p + v[n_u:])
        return np.concatenate([solve(v[:n_u] - coupling @ p), p])

    return precondition


def aggregation(
    system: Any, x: np.ndarray, stiffness: csr_matrix, node: np.ndarray, axis: np.ndarray
) -> Apply:
    """A V-cycle of smoothed aggregation with the rigid motions of the deformed body."""
    import pyamg

    points = (system.space.points + system.displacement(x))[node] / system.length_unit
    points = points - points.mean(axis=0)
    motions = np.zeros((len(node), 6))
    motions[np.arange(len(node)), axis] = 1.0
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        motions[axis == i, 3 + k] = -points[axis == i, j]
        motions[axis == j, 3 + k] = points[axis == j, i]
    sweeps = ("gauss_seidel", {"sweep": "symmetric"})
    hierarchy = pyamg.smoothed_aggregation_solver(
        stiffness, B=motions, symmetry="symmetric", max_coarse=500, presmoother=sweeps, postsmoother=sweeps
    )
    cycle = hierarchy.aspreconditioner("V")
    return lambda v: cycle @ v


def two_levels(space: Any, pattern: Any, stiffness: csr_matrix, node: np.ndarray, axis: np.ndarray) -> Apply:
    """Gauss-Seidel, exact on the linear elements' unknowns, Gauss-Seidel."""
    from pyamg.relaxation.relaxation import gauss_seidel
    from scipy.sparse.linalg import splu

    ends = np.repeat(np.arange(space.n_nodes)[:, None], 2, axis=1)
    for middle in range(4, 10):
        at = space.points[space.tets[:, middle]]
        a, b = min(
            EDGES,
            key=lambda e: float(
                np.abs(
                    0.5 * (space.points[space.tets[:, e[0]]] + space.points[space.tets[:, e[1]]]) - at
                ).sum()
            ),
        )
        ends[space.tets[:, middle]] = space.tets[:, [a, b]]
    columns = pattern.number[3 * ends[node] + axis[:, None]].ravel()
    rows = np.repeat(np.arange(len(node)), 2)
    use = columns >= 0
    weights = np.full(int(use.sum()), 0.5)
    lift = coo_matrix((weights, (rows[use], columns[use])), shape=stiffness.shape).tocsr()
    lift = lift[:, np.unique(lift.indices)]
    coarse = splu((lift.T @ stiffness @ lift).tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01)

    def solve(v: np.ndarray) -> np.ndarray:
        y = np.zeros_like(v)
        gauss_seidel(stiffness, y, v, iterations=2, sweep="symmetric")
        y += lift @ coarse.solve(lift.T @ (v - stiffness @ y))
        gauss_seidel(stiffness, y, v, iterations=2, sweep="symmetric")
        return y

    return solve


def measure(size: float, rival: str) -> dict[str, Any]:
    """Set up and solve once, in this process."""
    from fem_spa.solid.gmres import gmres

    case = make_case(size)
    before, begun = peak_mb(), time.process_time()
    kept = float("nan")
    if rival in ("double", "single"):
        apply, kept = pardiso(case, rival)
    else:
        apply = blocks(case, rival)
    ready = time.process_time()
    if rival in ("double", "single"):
        x, iterations = apply(case.b), 1
    else:
        x, iterations, _ = gmres(case.product, apply, case.b, TOLERANCE, MOST)
    done = time.process_time()
    residual = float(np.linalg.norm(case.product(x) - case.b) / np.linalg.norm(case.b))
    return {
        "unknowns": case.system.pattern.n_free,
        "rival": rival,
        "setup": ready - begun,
        "solve": done - ready,
        "iterations": iterations,
        "residual": residual,
        "factors": kept,
        "more": peak_mb() - before,
    }


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sizes", type=float, nargs="+", default=(3.0, 1.5))
    parser.add_argument("--write", action="store_true", help="the table into docs/reliability.md")
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure(float(options.one[0]), options.one[1])))
        return
    names = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    rows = []
    for size in options.sizes:
        for rival in RIVALS:
            say(f"{size} mm, {rival}")
            done = subprocess.run(
                [sys.executable, __file__, "--one", str(size), rival],
                env={**os.environ, **dict.fromkeys(names, "1")},
                stdout=subprocess.PIPE,
                text=True,
                check=True,
            )
            run = json.loads(done.stdout.splitlines()[-1])
            kept = "" if np.isnan(run["factors"]) else f"{1e-6 * run['factors']:.0f}"
            rows.append(
                [f"{run['unknowns']:,}".replace(",", " "), rival, f"{run['setup']:.1f}",
                 f"{run['solve']:.2f}",
                 str(run["iterations"]), f"{run['residual']:.0e}", kept]
            )  # fmt: skip
    text = table(
        ["unknowns", "rival", "set-up [s]", "one solution [s]", "iterations", "residual", "factors [MB]"],
        rows,
    )
    print(text)
    if options.write:
        write(text, "rivals")


if __name__ == "__main__":
    main()
