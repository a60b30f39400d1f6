"""How fast is the solver, how near to its bound, and beside NGSolve and FElupe on the same mesh.

    pip install -e .[benchmarks]
    python benchmarks/solver_speed.py                 # all of it, some minutes
    python benchmarks/solver_speed.py --no-peers      # our own timings

The evidence mesh is looked for in --mesh, in the folder FEM_SPA_SHARED/meshes, in ../shared/meshes beside
the repository; without it the built-in fast module serves, for our own timings alone. Every run has a process
of its own; the programs take turns. Progress goes to stderr, the tables (Markdown) to stdout.
"""

from __future__ import annotations

import argparse
import datetime
import importlib.metadata
import importlib.util
import json
import os
import platform
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from solver_case import CURVE, EVIDENCE, KNOWN

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parent
MESH = "fast_module_3mm.msh"
LOADS = '[loads]\npressure = "20 kPa"\npoints = 20\ncontact = false\n'
EVIDENCE_DECK = """[geometry]
file = {file}
unit = "mm"

[materials.body]
card = "dragon-skin-30"

[materials.stiff]
law = "neo-hooke"
C10 = "2.2 MPa"

[supports]
symmetry = {{ symmetry = "y" }}

"""
BUILT_IN_DECK = """[geometry]
shape = "pneunet"
slow_chambers = 0
fast_chambers = 6
size = "3 mm"

[materials.body]
card = "dragon-skin-30"

"""
PACKAGES = ("fem-spa", "numpy", "scipy", "numba", "scikit-fem", "mkl", "pypardiso", "ngsolve", "felupe")


def find_mesh(given: Path | None) -> Path | None:
    """The evidence mesh, if it is here."""
    shared = Path(os.environ.get("FEM_SPA_SHARED", REPOSITORY.parent / "shared"))
    for path in [given] if given else [shared / "meshes" / MESH]:
        if path.is_file():
            return path.resolve()
    return None


def machine() -> list[str]:
    """Processor, cores, memory, load, versions."""
    model, memory = platform.processor() or platform.machine(), ""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        model = next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
        memory = f", {os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 1e9:.0f} GB"
    except (OSError, StopIteration, ValueError, AttributeError):
        pass
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    versions = [f"Python {platform.python_version()}"]
    for name in PACKAGES:
        try:
            versions.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            versions.append(f"{name} absent")
    today = datetime.date.today().isoformat()
    return [
        f"{model}, {cores} cores{memory}; {platform.system()}; {today}; load at the start {load}",
        ", ".join(versions),
    ]


class Runner:
    """Starts the workers; results come back as JSON."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.environment = dict(os.environ)
        libraries = list((Path(sys.prefix) / "lib").glob("libmkl_rt.so*"))
        if libraries:  # NGSolve looks for MKL's PARDISO under this name when it runs
            (folder / "libmkl_rt.so").symlink_to(libraries[0])
            places = [str(folder), str(libraries[0].parent), os.environ.get("LD_LIBRARY_PATH", "")]
            self.with_mkl = {**os.environ, "LD_LIBRARY_PATH": os.pathsep.join(filter(None, places))}
        else:
            self.with_mkl = self.environment

    def worker(self, script: str, *arguments: Any, mkl: bool = False) -> dict[str, Any] | None:
        """The result of a worker, None where it failed (its words are on stderr)."""
        say(f"{script} {' '.join(str(a) for a in arguments[1:])}")
        result = self.folder / "result.json"
        result.unlink(missing_ok=True)
        command = [sys.executable, str(HERE / script), str(arguments[0]), str(result)]
        command += [str(a) for a in arguments[1:]]
        done = subprocess.run(
            command, env=self.with_mkl if mkl else self.environment, stdout=sys.stderr, check=False
        )
        if done.returncode or not result.is_file():
            say(f"{script} failed with status {done.returncode}")
            return None
        return json.loads(result.read_text(encoding="utf-8"))


def say(text: str) -> None:
    print(f"[{time.strftime('%H:%M:%S')}] {text}", file=sys.stderr, flush=True)


def shell(deck: Path, out: Path, environment: dict[str, str]) -> dict[str, Any]:
    """`fem-spa solve` as a user starts it: wall seconds and peak memory of the child."""
    say("fem-spa solve")
    program = shutil.which("fem-spa", path=str(Path(sys.executable).parent)) or "fem-spa"
    started = time.perf_counter()
    child = subprocess.Popen(
        [program, "solve", str(deck), "--out", str(out)],
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    assert child.stderr
    words = child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    wall = time.perf_counter() - started
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"fem-spa solve ended with {child.returncode}: {words.decode(errors='replace')}")
    record = json.loads((out / "result.json").read_text(encoding="utf-8"))
    unit = 1e6 if sys.platform == "darwin" else 1024
    return {
        "wall": wall,
        "peak_mb": usage.ru_maxrss / unit,
        "cpu": usage.ru_utime + usage.ru_stime,
        "seconds": record["seconds"],
        "own_peak_mb": record["peak_rss_mb"],
    }


def middle(values: list[float]) -> float:
    return float(statistics.median(values))


def table(head: list[str], rows: list[list[str]]) -> str:
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])


def part_of_ours(runs: list[dict[str, Any]]) -> str:
    """(a) the warm curve and its parts."""
    curves = [c for run in runs for c in run["curves"]]
    seconds = sorted(c["seconds"] for c in curves)
    last = curves[-1]
    total, parts = middle(seconds), last["parts"]
    iterations = sum(last["iterations"])
    measured = next(run for run in runs if "units" in run)
    unit, tally = measured["units"], measured["tally"]
    factor, others = unit["factorization"], unit["residual"] + unit["back-substitution"]
    bound = last["factorizations"] * factor + unit["analysis"]
    share = {name: parts[name] / parts["total"] for name in ("assembly", "linear", "contact")}
    rest = 1 - sum(share.values())
    text = [
        f"{last['elements']} tets, {last['dofs']} free unknowns; {runs[0]['settings']}.",
        "",
        table(
            ["warm curve of 20 points to 20 kPa", ""],
            [
                ["seconds, median (least to most)", f"{total:.2f} ({seconds[0]:.2f} to {seconds[-1]:.2f}), "
                 f"{len(seconds)} curves in {len(runs)} processes"],
                ["first curve of a process", f"{middle([r['first'] for r in runs]):.2f} s"],
                ["Newton iterations", f"{iterations}, with {last['factorizations']} factorizations"],
                ["a Newton iteration", f"{1e3 * total / iterations:.0f} ms"],
                ["a load point", f"{1e3 * total / len(CURVE):.0f} ms"],
                ["share of assembly, linear algebra, watch on walls, rest",
                 f"{share['assembly']:.0%}, {share['linear']:.0%}, {share['contact']:.0%}, {rest:.0%}"],
                ["the bound: its factorizations and one analysis",
                 f"{bound:.2f} s, {bound / total:.0%} of the curve"],
                ["peak memory of the process", f"{max(r['peak_mb'] for r in runs):.0f} MB"],
            ],
        ),
        "",
        table(
            ["part", "once [ms]", "in a curve", "seconds", "share"],
            [
                [name, f"{1e3 * unit[name]:.1f}" if name in unit else "", str(n), f"{s:.2f}",
                 f"{s / tally['total']:.1%}"]
                for name, (n, s) in sorted(tally["parts"].items(), key=lambda item: -item[1][1])
            ]
            + [["(analysis, in the first factorization)", f"{1e3 * unit['analysis']:.1f}", "1", "", ""]],
        ),
        "",
        f"New factors with their tangent cost {(unit['tangent'] + factor) / others:.1f} iterations with "
        f"kept ones, (tangent + factorization) / (residual + back-substitution); "
        f"`newton.FACTOR_COST` is {runs[0]['factor_cost']}.",
    ]  # fmt: skip
    return "\n".join(text)


def part_of_shell(first: dict[str, Any], warm: list[dict[str, Any]]) -> str:
    """(b), (c) from the shell."""
    best = sorted(warm, key=lambda run: run["wall"])[len(warm) // 2]

    def row(name: str, run: dict[str, Any]) -> list[str]:
        s = run["seconds"]
        before = run["wall"] - s["total"]
        inner = ", ".join(
            f"{key} {s[key]:.2f}" for key in ("mesh", "assembly", "linear", "contact", "output")
        )
        return [
            name,
            f"{run['wall']:.2f}",
            f"{s['total']:.2f}",
            f"{before:.2f}",
            inner,
            f"{max(run['peak_mb'], run['own_peak_mb']):.0f}",
        ]

    return table(
        [
            "`fem-spa solve`",
            "wall [s]",
            "of that in the run [s]",
            "start and end [s]",
            "parts [s]",
            "peak memory [MB]",
        ],
        [row(f"median of {len(warm)}", best), row("first ever (compilation, fonts)", first)],
    )


def part_of_peers(results: dict[str, list[dict[str, Any]]], evidence_mesh: bool) -> str:
    """(d) side by side."""
    ours = results["fem_spa"]
    base = middle([c["seconds"] for run in ours for c in run["curves"]])
    angles = ours[0]["curves"][0]["angles"]
    rows = []
    for name, runs in results.items():
        if not runs:
            continue
        curves = [c for run in runs for c in run["curves"]]
        seconds = middle([c["seconds"] for c in curves])
        n = sum(curves[-1]["iterations"])
        worst = max(abs(a / b - 1) for a, b in zip(curves[-1]["angles"], angles, strict=True))
        rows.append(
            [
                name, f"{seconds:.1f}", f"{seconds / base:.1f}", str(n), str(curves[-1]["factorizations"]),
                f"{1e3 * seconds / n:.0f}", f"{max(r['peak_mb'] for r in runs):.0f}", f"{100 * worst:.3f} %",
                runs[0]["settings"],
            ]
        )  # fmt: skip
    out = [
        table(
            ["program", "curve [s]", "of fem_spa's time", "Newton iterations", "factorizations",
             "an iteration [ms]", "peak memory [MB]", "angles differ by at most", "settings"],
            rows,
        ),
        "",
    ]  # fmt: skip
    shown = [(i, p) for i, p in enumerate(EVIDENCE) if p in KNOWN]
    angle_rows = [
        [
            name,
            *(f"{runs[0]['evidence'][i]:.4f}" for i, _ in shown),
            f"{runs[0]['curves'][0]['angles'][-1]:.4f}",
        ]
        for name, runs in results.items()
        if runs
    ]
    if evidence_mesh:
        angle_rows.append(["the trial", *(f"{KNOWN[p]:.3f}" for _, p in shown), ""])
    out.append(table(["angle [deg] at kPa", *(f"{p:g}" for _, p in shown), "20"], angle_rows))
    return "\n".join(out)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--mesh", type=Path, help=f"path of {MESH}")
    parser.add_argument("--rounds", type=int, default=3, help="times that the programs take turns")
    parser.add_argument("--repeats", type=int, default=3, help="our warm curves a process")
    parser.add_argument("--no-peers", action="store_true")
    parser.add_argument("--no-shell", action="store_true")
    options = parser.parse_args()
    if options.mesh and not options.mesh.is_file():
        parser.error(f"--mesh {options.mesh}: there is no such file")
    mesh = find_mesh(options.mesh)
    if mesh is None:
        say(f"{MESH} is not here (see --mesh): our own timings on the built-in fast module")
    peers = [] if options.no_peers or mesh is None else ["ngsolve", "felupe"]
    for name in list(peers):
        if importlib.util.find_spec(name) is None:
            say(f"{name} is not installed (pip install -e .[benchmarks]): left out")
            peers.remove(name)
    lines = machine()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        deck = folder / "deck.toml"
        head = EVIDENCE_DECK.format(file=json.dumps(str(mesh))) if mesh else BUILT_IN_DECK
        deck.write_text(head + LOADS, encoding="utf-8")
        runner = Runner(folder)

        ours, ngsolve, felupe = [], [], []
        case = folder / "case.npz"
        solver, orders = "sparsecholesky", {"ngsolve": 3, "felupe": 3}
        tried: dict[str, float] = {}
        for number in range(options.rounds):
            extra = ["--parts", "--case", case] if number == 0 else []
            run = runner.worker("solver_ours.py", deck, "--repeats", options.repeats, *extra)
            if run is None:
                raise SystemExit("fem_spa's own run failed")
            ours.append(run)
            if "ngsolve" in peers:
                if number == 0:
                    probe = runner.worker("peer_ngsolve.py", case, "--probe", mkl=True)
                    tried = probe["solvers"] if probe else {}
                    solver = min(tried, key=lambda name: tried[name]) if tried else solver
                order = orders["ngsolve"]
                ngsolve.append(
                    runner.worker(
                        "peer_ngsolve.py", case, "--solver", solver, "--order", order, mkl=solver == "pardiso"
                    )
                )
            if "felupe" in peers:
                felupe.append(runner.worker("peer_felupe.py", case, "--order", orders["felupe"]))
        results = {
            "fem_spa": ours,
            "NGSolve": [run for run in ngsolve if run],
            "FElupe": [run for run in felupe if run],
        }

        first, warm = None, []
        if not options.no_shell:
            fresh = {
                **os.environ,
                "NUMBA_CACHE_DIR": str(folder / "numba"),
                "MPLCONFIGDIR": str(folder / "mpl"),
            }
            first = shell(deck, folder / "first", fresh)
            warm = [shell(deck, folder / f"warm{k}", dict(os.environ)) for k in range(options.rounds)]

    which = f"The evidence mesh {MESH}" if mesh else "The built-in fast module of six chambers, 3 mm"
    print(f"{lines[0]}\n\n{lines[1]}\n\n{which}.\n\n### fem_spa, warm\n\n{part_of_ours(ours)}")
    if first:
        print(f"\n### From the shell\n\n{part_of_shell(first, warm)}")
    if any(results[name] for name in ("NGSolve", "FElupe")):
        print(f"\n### Side by side\n\n{part_of_peers(results, mesh is not None)}")
        if tried:
            words = ", ".join(f"{name} {1e3 * s:.0f}" for name, s in tried.items())
            print(f"\nNGSolve's linear solvers, factorization and solution [ms]: {words}.")
            warm_up = middle([run["warm"] for run in results["NGSolve"]]) if results["NGSolve"] else 0.0
            print(f"Its compilation of the forms, not counted: {warm_up:.1f} s a process.")
    say(f"children's processor time {resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime:.0f} s")


if __name__ == "__main__":
    main()
