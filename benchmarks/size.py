"""Time and memory of the solver from thirty thousand to six hundred thousand unknowns.

    python benchmarks/size.py                        # all sizes, in double and single precision; an hour
    python benchmarks/size.py --sizes 3 2 --steps 2  # elements of 3 and 2 mm, two load steps
    python benchmarks/size.py --write                # and the tables into docs/reliability.md

The case is the slow module of the composite finger with its paper layer, without contact, to 2 kPa in
`--steps` equal steps: a few Newton iterations, since each costs what the next does. Every run has a process
of its own with one thread; --keep FILE keeps what was measured, and what is in it is not measured again.
Times are of the processor, so that other work on the machine counts little; the wall time of all, which it
does change, stands beside them.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from solver_case import peak_mb

HERE = Path(__file__).resolve().parent
PAGE = HERE.parent / "docs" / "reliability.md"
SIZES = (3.0, 2.0, 1.5, 1.1, 0.85, 0.67)
"""mm: 35 000 to 600 000 unknowns."""
DECK = """[geometry]
shape = "pneunet"
fast_chambers = 0
size = "{size} mm"

[materials.body]
card = "dragon-skin-30"

[layers.paper]
modulus = "2 GPa"
thickness = "0.1 mm"

[loads]
pressure = "2 kPa"
contact = false

[solver]
imposed_steps = {steps}
factors = "{factors}"
"""
PARTS = ("space", "system", "tangent", "residual", "factorization", "back-substitution")
GIB = 2.0**30


def measure(size: float, factors: str, steps: int) -> dict[str, Any]:
    """One curve in this process, with a clock at every part."""
    from fem_spa.deck import read_deck
    from fem_spa.prepare import prepare
    from fem_spa.solid import path
    from fem_spa.solid.linear import Pardiso
    from fem_spa.solid.system import System

    spent: dict[str, list[float]] = defaultdict(list)
    sizes: list[tuple[float, float]] = []

    def watch(owner: Any, name: str, label: str) -> None:
        inner = getattr(owner, name)

        def timed(*args, **kwargs):
            begun = time.process_time()
            try:
                return inner(*args, **kwargs)
            finally:
                spent[label].append(time.process_time() - begun)
                if label == "analysis":
                    sizes.append((args[0]._factor_bytes, args[0]._needed_bytes))

        setattr(owner, name, timed)

    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder) / "deck.toml"
        deck.write_text(DECK.format(size=size, factors=factors, steps=steps), encoding="utf-8")
        setup = prepare(read_deck(deck))
    meshed = peak_mb()
    watch(path, "build_space", "space")
    watch(System, "__init__", "system")
    watch(System, "tangent", "tangent")
    watch(System, "evaluate", "residual")
    watch(Pardiso, "_analyse", "analysis")
    watch(Pardiso, "factorize", "factorization")
    watch(Pardiso, "solve", "back-substitution")
    begun, wall = time.process_time(), time.perf_counter()
    result = path.solve(setup.problem, setup.steps)
    total, wall = time.process_time() - begun, time.perf_counter() - wall
    if result.status != "done":
        raise SystemExit(f"{size} mm: {result.status}: {result.message}")
    spent["factorization"][0] -= spent["analysis"][0]  # the first one begins with it
    return {
        "size": size,
        "factors": factors,
        "steps": steps,
        "unknowns": result.dofs,
        "tets": result.elements,
        "iterations": result.newton_iterations,
        "factorizations": result.factorizations,
        "angle": float(np.degrees(result.rows[-1].angle)),
        "seconds": total,
        "wall": wall,
        "parts": {name: sum(times) for name, times in spent.items()},
        "once": {name: float(np.median(times)) for name, times in spent.items()},
        "factor_bytes": sizes[0][0],
        "needed_bytes": sizes[0][1],
        "peak_bytes": peak_mb() * 2**20,
        "meshing_peak_bytes": meshed * 2**20,
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan"),
    }


def in_a_process(size: float, factors: str, steps: int) -> dict[str, Any] | None:
    """`measure` in a new process with one thread; None where it failed."""
    one = dict.fromkeys(
        ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"
    )
    say(f"{size} mm, factors in {factors} precision")
    command = [sys.executable, __file__, "--one", str(size), factors, "--steps", str(steps)]
    done = subprocess.run(command, env={**os.environ, **one}, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        say(f"failed with status {done.returncode}")
        return None
    return json.loads(done.stdout.splitlines()[-1])


def say(text: str) -> None:
    print(f"[{time.strftime('%H:%M:%S')}] {text}", file=sys.stderr, flush=True)


def fit(runs: list[dict[str, Any]], value) -> tuple[float, float]:
    """(factor, exponent) of value = factor * unknowns^exponent, least squares of the logarithms."""
    n = np.log([run["unknowns"] for run in runs])
    exponent, intercept = np.polyfit(n, np.log([value(run) for run in runs]), 1)
    return float(np.exp(intercept)), float(exponent)


def tables(runs: list[dict[str, Any]]) -> str:
    """Markdown: every run, exponents, and where memory ends."""
    head = ["unknowns", "tetrahedra", "factors in", "factors [GB]", "peak of the process [GB]",
            "analysis [s]", "a factorization [s]", "a back-substitution [s]", "a tangent [s]",
            "a residual [s]",
            "share of factorization and analysis", "Newton iterations (factorizations)",
            "all [s] (wall)", "angle [deg]"]  # fmt: skip
    rows = []
    for run in sorted(runs, key=lambda r: (r["unknowns"], r["factors"] == "single")):
        once, parts = run["once"], run["parts"]
        share = (parts["factorization"] + parts["analysis"]) / run["seconds"]
        rows.append(
            [f"{run['unknowns']:,}".replace(",", " "), f"{run['tets']:,}".replace(",", " "), run["factors"],
             f"{run['factor_bytes'] / 1e9:.2f}", f"{run['peak_bytes'] / 1e9:.2f}", f"{once['analysis']:.1f}",
             f"{once['factorization']:.2f}", f"{once['back-substitution']:.2f}", f"{once['tangent']:.2f}",
             f"{once['residual']:.2f}", f"{share:.0%}", f"{run['iterations']} ({run['factorizations']})",
             f"{run['seconds']:.0f} ({run['wall']:.0f})", f"{run['angle']:.7f}"]
        )  # fmt: skip
    out = [table(head, rows), ""]
    kinds = {kind: [r for r in runs if r["factors"] == kind] for kind in ("double", "single")}
    values = {
        "a factorization": lambda r: r["once"]["factorization"],
        "a back-substitution": lambda r: r["once"]["back-substitution"],
        "analysis": lambda r: r["once"]["analysis"],
        "a tangent": lambda r: r["once"]["tangent"],
        "bytes of the factors": lambda r: r["factor_bytes"],
        "peak of the process": lambda r: r["peak_bytes"],
    }
    out.append(
        table(
            ["exponent of the unknowns in", *(f"factors in {kind} precision" for kind in kinds)],
            [
                [name, *(f"{fit(of, value)[1]:.2f}" if len(of) > 1 else "" for of in kinds.values())]
                for name, value in values.items()
            ],
        )
    )
    if len(kinds["double"]) > 2:
        out += ["", ends_of_memory(kinds["double"])]
    return "\n".join(out)


def ends_of_memory(runs: list[dict[str, Any]]) -> str:
    """How many unknowns fit into 80 % of a memory: factors by their power law, all else linear in them."""
    factor, exponent = fit(runs, lambda r: r["factor_bytes"])
    n = np.linspace(1e4, 1e8, 200_000)
    rest = [r["peak_bytes"] - r["factor_bytes"] for r in runs]
    slope, base = np.polyfit([r["unknowns"] for r in runs], rest, 1)
    rows = []
    for gibibytes in (4, 8, 16, 24, 32, 64):
        peaks = [base + slope * n + part * factor * n**exponent for part in (1.0, 0.5)]
        ends = [n[peak < 0.8 * gibibytes * GIB][-1] for peak in peaks]
        rows.append([f"{gibibytes}", *(f"{end / 1e6:.2g} million" for end in ends)])
    return table(["memory [GiB]", "double precision up to", "single precision up to"], rows)


def table(head: list[str], rows: list[list[str]]) -> str:
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])


def write(text: str, mark: str) -> None:
    """Put text between <!-- mark --> and <!-- /mark --> of the page."""
    page = PAGE.read_text(encoding="utf-8")
    first, last = f"<!-- {mark} -->", f"<!-- /{mark} -->"
    before, _, rest = page.partition(first)
    _, found, after = rest.partition(last)
    if not found:
        raise SystemExit(f"{PAGE.name} has no {first} ... {last}")
    PAGE.write_text(f"{before}{first}\n{text}\n{last}{after}", encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sizes", type=float, nargs="+", default=SIZES, help="mm, of the elements")
    parser.add_argument("--factors", nargs="+", choices=("double", "single"), default=("double", "single"))
    parser.add_argument("--steps", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="JSON of what was measured; added to")
    parser.add_argument("--write", action="store_true", help="the tables into docs/reliability.md")
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure(float(options.one[0]), options.one[1], options.steps)))
        return
    runs: list[dict[str, Any]] = []
    if options.keep and options.keep.is_file():
        runs = json.loads(options.keep.read_text(encoding="utf-8"))
    for size in options.sizes:
        for factors in options.factors:
            if any((r["size"], r["factors"], r["steps"]) == (size, factors, options.steps) for r in runs):
                continue
            run = in_a_process(size, factors, options.steps)
            if run:
                runs.append(run)
            if options.keep:
                options.keep.write_text(json.dumps(runs, indent=1), encoding="utf-8")
    text = tables(runs)
    print(text)
    if options.write:
        write(text, "size")


if __name__ == "__main__":
    main()
