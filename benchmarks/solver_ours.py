"""The case by fem_spa, and what its parts cost. Started by solver_speed.py in a process of its own.

python solver_ours.py DECK.toml RESULT.json --repeats 3 --parts
"""

from __future__ import annotations

import argparse
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from solver_case import EVIDENCE, Case, peak_mb, report, tip_angle

from fem_spa.deck import read_deck
from fem_spa.prepare import prepare
from fem_spa.solid import path
from fem_spa.solid.linear import Pardiso, SuperLU, make_solver
from fem_spa.solid.newton import FACTOR_COST
from fem_spa.solid.observe import KeepStates
from fem_spa.solid.problem import Problem, Result
from fem_spa.solid.space import build_space
from fem_spa.solid.system import System


class Watch(KeepStates):
    """Keeps each state and row."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[Any] = []

    def converged(self, state, row, fraction) -> None:
        super().converged(state, row, fraction)
        self.rows.append(row)

    def start(self, problem, space) -> None:
        self.space = space

    def angles(self) -> list[float]:
        """deg at the load points, by the measure that the peers are compared with."""
        tip = np.unique(self.space.surfaces["tip"][:, :3])
        rest = self.space.points[tip]
        return [
            tip_angle(rest, rest + state.displacement[tip])
            for state, row in zip(self.states[1:], self.rows[1:], strict=True)
            if row.is_point
        ]


def curve(problem: Problem, steps) -> dict[str, Any]:
    """One curve, everything from the mesh on."""
    watch = Watch()
    started = time.perf_counter()
    result: Result = path.solve(problem, steps, [watch])
    seconds = time.perf_counter() - started
    if result.status != "done":
        raise SystemExit(f"fem_spa: {result.status}: {result.message}")
    return {
        "seconds": seconds,
        "iterations": [row.iterations for row in watch.rows[1:]],
        "factorizations": result.factorizations,
        "angles": watch.angles(),
        "parts": result.seconds,
        "dofs": result.dofs,
        "elements": result.elements,
    }


def tally(problem: Problem, steps) -> dict[str, Any]:
    """The same curve with a clock at every part: part -> (times called, seconds)."""
    calls: dict[str, list[float]] = defaultdict(list)
    kept: list[tuple[Any, str, Any]] = []

    def watch(owner: Any, name: str, label: str) -> None:
        inner = getattr(owner, name)

        def timed(*args, **kwargs):
            started = time.perf_counter()
            try:
                return inner(*args, **kwargs)
            finally:
                calls[label].append(time.perf_counter() - started)

        kept.append((owner, name, inner))
        setattr(owner, name, timed)

    linear = type(make_solver_of(problem))
    watch(path, "build_space", "space")
    watch(System, "__init__", "system (pattern, scatter map)")
    watch(System, "tangent", "tangent")
    watch(System, "evaluate", "residual")
    watch(linear, "factorize", "factorization")
    watch(linear, "solve", "back-substitution")
    watch(path.Walls, "cross", "walls: do they cross")
    watch(path.Predictor, "add", "predictor: add")
    watch(path.Predictor, "predict", "predictor: predict")
    try:
        started = time.perf_counter()
        path.solve(problem, steps)
        total = time.perf_counter() - started
    finally:
        for owner, name, inner in kept:
            setattr(owner, name, inner)
    parts = {name: (len(times), sum(times)) for name, times in calls.items()}
    parts["all else"] = (1, total - sum(seconds for _, seconds in parts.values()))
    return {"total": total, "parts": parts}


def make_solver_of(problem: Problem) -> Pardiso | SuperLU:
    """The linear solver that this machine gives."""
    system = System(problem, build_space(problem.mesh))
    return make_solver(system.pattern)  # type: ignore[return-value]


def median_seconds(work: Callable[[], Any], repeats: int) -> float:
    """Of one call, after one that is not counted."""
    work()
    times = []
    for _ in range(repeats):
        started = time.perf_counter()
        work()
        times.append(time.perf_counter() - started)
    return float(np.median(times))


def units(problem: Problem, steps, repeats: int = 15) -> dict[str, float]:
    """Seconds of each part once, at the state in the middle of the path."""
    watch = Watch()
    path.solve(problem, steps, [watch])
    state = watch.states[len(watch.states) // 2]
    space_seconds = median_seconds(lambda: build_space(problem.mesh), 3)
    space = build_space(problem.mesh)
    system_seconds = median_seconds(lambda: System(problem, space), 3)
    system = System(problem, space)
    x = np.concatenate([state.displacement.ravel(), state.pressure_field])
    pressure = np.array([state.cavity_pressure[name] for name in system.cavities])
    data = system.tangent(x, pressure)
    solver = make_solver(system.pattern)
    solver.factorize(data)
    b = np.random.default_rng(0).standard_normal(system.pattern.n_free)
    out = {
        "space": space_seconds,
        "system (pattern, scatter map)": system_seconds,
        "tangent": median_seconds(lambda: system.tangent(x, pressure), repeats),
        "residual": median_seconds(lambda: system.evaluate(x, pressure, 1.0), repeats),
        "factorization": median_seconds(lambda: solver.factorize(data), repeats),
        "back-substitution": median_seconds(lambda: solver.solve(b), repeats),
    }

    def analysed() -> None:
        fresh = make_solver(system.pattern)
        fresh.factorize(data)
        fresh.free()

    out["analysis"] = median_seconds(analysed, 3) - out["factorization"]
    solver.free()
    return out


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("deck")
    parser.add_argument("result")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--parts", action="store_true", help="also what each part costs")
    parser.add_argument("--case", type=Path, help="write the mesh here, for the peers")
    options = parser.parse_args()
    started = time.perf_counter()
    setup = prepare(read_deck(options.deck))
    if options.case:
        mesh = setup.problem.mesh
        region = np.zeros(len(mesh.tets), dtype=int)
        for i, part in enumerate(mesh.volumes.values()):
            region[part] = i
        surfaces = {name: faces[:, :3] for name, faces in mesh.surfaces.items()}
        Case(1e3 * mesh.points, mesh.tets[:, :4], region, tuple(mesh.volumes), surfaces).save(options.case)
    first = curve(setup.problem, setup.steps)
    warm = time.perf_counter() - started
    curves = [curve(setup.problem, setup.steps) for _ in range(options.repeats)]
    peak = peak_mb()
    try:
        import numba

        threads = numba.get_num_threads()
    except ImportError:
        threads = 1
    result = {
        "settings": f"{type(make_solver_of(setup.problem)).__name__.upper()} LDL^T, {threads} threads, "
        "14 quadrature points, kept factors, predictor of its own",
        "curves": curves,
        "warm": warm,
        "first": first["seconds"],
        "peak_mb": peak,
        "factor_cost": FACTOR_COST,
        "shape": setup.problem.mesh.source,
    }
    loads = replace(
        setup.problem.loads,
        points=[dict.fromkeys(setup.problem.mesh.cavities, 1e3 * p) for p in EVIDENCE],
    )
    result["evidence"] = curve(replace(setup.problem, loads=loads), setup.steps)["angles"]
    if options.parts:
        result["tally"] = tally(setup.problem, setup.steps)
        result["units"] = units(setup.problem, setup.steps)
    report(options.result, result)


if __name__ == "__main__":
    main()
