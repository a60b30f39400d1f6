"""How far the composite finger at its default mesh is from a twice finer one; prints a Markdown table.

    python benchmarks/mesh_error.py [--sizes "3 mm" "2 mm" "1.5 mm"]

Each size runs in a process of its own, so that its memory is its own. The load path is the egg example of
studies/composite_finger.toml (20 and 13.9 kPa).
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

DECK = Path(__file__).parents[1] / "studies" / "composite_finger.toml"
EGG = 'loads.pressure={ slow = "20 kPa", fast = "13.9 kPa" }'


def one(size: str) -> None:
    """Solve at one size and print its numbers."""
    from fem_spa.deck import read_deck
    from fem_spa.prepare import prepare
    from fem_spa.solid.path import solve

    begun = time.perf_counter()
    setup = prepare(read_deck(DECK, [EGG, "loads.path=[]", "loads.contact=false", f"geometry.size={size}"]))
    result = solve(setup.problem, setup.steps)
    seconds = time.perf_counter() - begun
    last = result.rows[-1]
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        size.replace(" ", "_"), result.status, result.elements, result.dofs, np.degrees(last.angle),
        1e9 * last.volume, result.newton_iterations, result.factorizations, seconds, memory,
    )  # fmt: skip


def main() -> None:
    """Run all sizes, finest last, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sizes", nargs="+", default=["3 mm", "2 mm", "1.5 mm"])
    parser.add_argument("--one", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        one(arguments.one)
        return
    rows = []
    for size in arguments.sizes:
        done = subprocess.run(
            [sys.executable, __file__, "--one", size], capture_output=True, text=True, check=True
        )
        rows.append(done.stdout.split())
        print(f"{size} done in {float(rows[-1][8]):.0f} s", file=sys.stderr)
    finest = float(rows[-1][4]), float(rows[-1][5])
    print("| size | elements | unknowns | angle [deg] | against the finest | enclosed volume | s | MB |")
    print("|---|---|---|---|---|---|---|---|")
    for size, status, elements, dofs, angle, volume, _, _, seconds, memory in rows:
        name = size.replace("_", " ") + ("" if status == "done" else f" ({status})")
        off = [100 * (float(mine) / ref - 1) for mine, ref in zip((angle, volume), finest, strict=True)]
        print(
            f"| {name} | {elements} | {dofs} | {float(angle):.2f} | {off[0]:+.2f} % | {off[1]:+.2f} % "
            f"| {float(seconds):.0f} | {float(memory):.0f} |"
        )


if __name__ == "__main__":
    main()
