"""A sweep of 24 designs: how much faster on all cores than one after another, and what a repeated call costs.

    python benchmarks/sweep.py [--out DIR] [--workers N]

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


def main() -> None:
    """Run the three ways, print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, help="folder that is kept (default: one that goes)")
    parser.add_argument("--workers", type=int, default=cores())
    given = parser.parse_args()
    out = given.out or Path(tempfile.mkdtemp(prefix="fem_spa_sweep_"))
    out.mkdir(parents=True, exist_ok=True)
    deck = out / "finger.toml"
    deck.write_text(DECK, encoding="utf-8")
    for name in ("warm", "calls", "one", "sweep"):
        shutil.rmtree(out / name, ignore_errors=True)
    print(f"{platform.processor() or platform.machine()}, {cores()} cores, load {os.getloadavg()[0]:.1f}")
    call("solve", str(deck), "--out", str(out / "warm"))
    sweep = ("sweep", str(deck), "--vary", *VARY)

    told: dict[str, tuple[float, float]] = {}
    told["sweep"] = call(*sweep, "--workers", str(given.workers), "--out", str(out / "sweep"))
    told["one"] = call(*sweep, "--workers", "1", "--out", str(out / "one"))
    found = rows(out / "sweep")
    seconds = used = 0.0
    titles = [name for name in found[0] if "." in name]
    for row in found:
        keys = [
            f"{name.partition(' [')[0]}={row[name]} {name.partition('[')[2].rstrip(']')}".strip()
            for name in titles
        ]
        each = call(
            "solve",
            str(deck),
            *(w for k in keys for w in ("--set", k)),
            "--out",
            str(out / "calls" / row["case"]),
        )
        seconds, used = seconds + each[0], used + each[1]
    told["calls"] = seconds, used
    again = call(*sweep, "--workers", str(given.workers), "--out", str(out / "sweep"))

    print(
        f"{len(found)} designs, {sum(row['status'] == 'done' for row in found)} done, "
        f"{min(float(r['dofs']) for r in found):.0f} to {max(float(r['dofs']) for r in found):.0f} unknowns"
    )
    print(f"load {os.getloadavg()[0]:.1f} at the end\n")
    print("| way | s | core seconds | times as fast |\n|---|---|---|---|")
    words = {
        "calls": "`fem-spa solve`, one call after another",
        "one": "the sweep, one process with all cores",
        "sweep": f"the sweep, {given.workers} processes",
    }
    for name, text in words.items():
        wall, cpu = told[name]
        print(f"| {text} | {wall:.1f} | {cpu:.1f} | {told['calls'][0] / wall:.2f} |")
    print(f"| the same call again | {again[0]:.1f} | {again[1]:.1f} | |")
    print(f"\nsweep over one process: {told['one'][0] / told['sweep'][0]:.2f} times as fast")
    difference = max(
        max(
            abs(last_angle(out / "sweep" / r["folder"]) - last_angle(out / "one" / r["folder"]))
            for r in found
        ),
        max(
            abs(last_angle(out / "sweep" / r["folder"]) - last_angle(out / "calls" / r["case"]))
            for r in found
        ),
    )
    print(f"largest difference of an angle between the three: {difference:.2g} deg")
    if given.out is None:
        shutil.rmtree(out)


if __name__ == "__main__":
    main()
