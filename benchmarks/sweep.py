"""A sweep of 24 designs: how much faster on all cores than one after another, and what a repeated call costs.

    python benchmarks/sweep.py            # prints; --write puts the table into docs/reliability.md

Three ways over the same designs, each in a folder of its own, compiled kernels warm:
  calls      `fem-spa solve` 24 times, each a process of its own with all cores for its linear solver
  one        the sweep with one process, all cores for its linear solver
  sweep      the sweep with one process a core, the cores divided among them
Then the sweep again, with everything there. The curves of all three are compared to the last digit printed.
The load of the machine is printed beside the times: on a busy machine the ratio says little.
"""

from __future__ import annotations

import argparse
import csv
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from fem_spa.engine.cores import cores

PAGE = Path(__file__).parents[1] / "docs" / "reliability.md"
MARKS = ("<!-- sweep.py -->", "<!-- end of sweep.py -->")
DECK = """\
[geometry]
shape = "pneunet"
slow_chambers = 3
fast_chambers = 0
size = "5 mm"

[materials.body]
law = "yeoh"
C10 = "0.11 MPa"
C20 = "0.02 MPa"

[layers.paper]
modulus = "2 GPa"
thickness = "0.1 mm"

[loads]
pressure = "20 kPa"
"""
VARY = (
    "geometry.slow_chambers=3,4",
    "materials.body.C10=0.08MPa:0.14MPa:4",
    "loads.pressure=10kPa:30kPa:3",
)


def call(*words: str) -> tuple[float, float]:
    """Seconds of `fem-spa` with these words, and of its cores."""
    before, begun = os.times(), time.perf_counter()
    subprocess.run([sys.executable, "-m", "fem_spa.cli", *words], check=True, stdout=subprocess.DEVNULL)
    seconds, after = time.perf_counter() - begun, os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return seconds, used


def rows(folder: Path) -> list[dict[str, str]]:
    """The table of a sweep."""
    with (folder / "sweep.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def last_angle(folder: Path) -> float:
    """The end of a curve, deg."""
    with (folder / "curve.csv").open(encoding="utf-8", newline="") as file:
        return float(list(csv.DictReader(file))[-1]["angle [deg]"])


def solve_words(row: dict[str, str]) -> list[str]:
    """`--set` for every key of a row."""
    found = []
    for title in row:
        if "." in title:
            key, _, unit = title.partition(" [")
            found += ["--set", f"{key}={row[title]} {unit.rstrip(']')}".strip()]
    return found


def measure(out: Path, workers: int, vary: tuple[str, ...]) -> list[str]:
    """Run the three ways and the second call; the lines of the answer."""
    deck = out / "finger.toml"
    deck.write_text(DECK, encoding="utf-8")
    for name in ("warm", "calls", "one", "sweep"):
        shutil.rmtree(out / name, ignore_errors=True)
    begun = os.getloadavg()[0]
    call("solve", str(deck), "--out", str(out / "warm"))
    sweep = ("sweep", str(deck), "--vary", *vary)
    many = call(*sweep, "--workers", str(workers), "--out", str(out / "sweep"))
    one = call(*sweep, "--workers", "1", "--out", str(out / "one"))
    found = rows(out / "sweep")
    places = {row["case"]: str(out / "calls" / row["case"]) for row in found}
    each = [call("solve", str(deck), *solve_words(row), "--out", places[row["case"]]) for row in found]
    calls = sum(seconds for seconds, _ in each), sum(used for _, used in each)
    again = call(*sweep, "--workers", str(workers), "--out", str(out / "sweep"))
    apart = max(
        abs(last_angle(out / "sweep" / row["folder"]) - last_angle(folder))
        for row in found
        for folder in (out / "one" / row["folder"], Path(places[row["case"]]))
    )
    dofs = [float(row["dofs"]) for row in found]
    done = sum(row["status"] == "done" for row in found)
    lines = [
        f"{len(found)} designs, {done} done, {min(dofs):.0f} to {max(dofs):.0f} unknowns; {cores()} cores "
        f"({platform.machine()}), load of the machine {begun:.1f} before and {os.getloadavg()[0]:.1f} after.",
        "",
        "| way | s | core seconds | times as fast as the calls | as one process |",
        "|---|---|---|---|---|",
    ]
    for text, (wall, used) in (
        ("`fem-spa solve`, one call after another", calls),
        ("the sweep with one process, which has all cores", one),
        (f"the sweep with {workers} processes", many),
        ("the same call again: nothing to solve", again),
    ):
        lines.append(f"| {text} | {wall:.1f} | {used:.1f} | {calls[0] / wall:.2f} | {one[0] / wall:.2f} |")
    return [*lines, "", f"Largest difference of an angle between the three: {apart:.1g} deg."]


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, help="folder that is kept (default: one that goes)")
    parser.add_argument("--workers", type=int, default=cores())
    parser.add_argument("--few", action="store_true", help="two designs only, to see that it works")
    parser.add_argument("--write", action="store_true", help="put the table into docs/reliability.md")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="fem_spa_sweep_") as temporary:
        out = given.out or Path(temporary)
        out.mkdir(parents=True, exist_ok=True)
        text = "\n".join(measure(out, given.workers, VARY[:1] if given.few else VARY))
    print(text)
    if given.write:
        before, rest = PAGE.read_text(encoding="utf-8").split(MARKS[0])
        after = rest.split(MARKS[1], 1)[1]
        PAGE.write_text(f"{before}{MARKS[0]}\n{text}\n{MARKS[1]}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
