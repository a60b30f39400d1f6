"""The rod's speed and its tip against PyElastica; writes the table of docs/rod.md between its marks.

    pip install -e .[benchmarks]
    python benchmarks/rod_speed.py            # prints; --write puts the table into docs/rod.md
    python benchmarks/rod_speed.py --no-peer  # fem_spa alone

One core. Kernels are compiled before the clock starts, in both programs. Medians of `--repeats` runs; ours
and the peer's take turns, so that a load on the machine slows both.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import math
import os
import platform
import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from fem_spa.reduced.model import Drive
from fem_spa.reduced.rod import GRID, SAFE, Rod, arm
from fem_spa.reduced.rod_protocols import PROTOCOLS
from fem_spa.reduced.rod_section import largest_step
from fem_spa.reduced.valve import valve_pressure

PAGE = Path(__file__).parents[1] / "docs" / "rod.md"
MARKS = ("<!-- rod_speed.py -->", "<!-- end -->")


def clock(run: Callable[[], object], repeats: int) -> float:
    """Median seconds of `run`, after one run that does not count."""
    run()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def babbling(seconds: float) -> Drive:
    """The paper's babbling at 20 Hz, its first seconds."""
    return next(p for p in PROTOCOLS if p.name == "Babbling 20 Hz").drive(seconds)


def strains(model: Rod, drive: Drive) -> np.ndarray:
    """Spontaneous strains every `GRID` s behind the valve."""
    grid = np.arange(round(drive.time[-1] / GRID) + 1) * GRID
    inside = valve_pressure(drive.time, drive.pressure, model.supply(), at=np.minimum(grid, drive.time[-1]))
    return model.strains(inside)


def against_peer(seconds: float, repeats: int) -> list[str]:
    """Rows: PyElastica and the rod's explicit loop on the same discretization, 10 s of motor babbling."""
    from rod_peer import peer_tip

    model = arm()
    n, dt = round(model.values()["elements"]), model.values()["time_step"]
    strain = strains(model, babbling(seconds))
    model.march(strain[:10], GRID, 0.0, 0.0)
    theirs, ours, tips = [], [], (np.empty(0), np.empty(0))
    for _ in range(repeats):
        peer, took = peer_tip(model, strain, GRID, dt)
        theirs.append(took)
        start = time.perf_counter()
        tip = model.march(strain, GRID, 0.0, 0.0)
        ours.append(time.perf_counter() - start)
        tips = (peer, tip)
    span = float(np.ptp(tips[0], axis=0).max())
    apart = 100 * float(np.linalg.norm(tips[0] - tips[1], axis=1).max()) / span
    a, b = statistics.median(theirs), statistics.median(ours)
    release = importlib.metadata.version("pyelastica")
    return [
        f"| PyElastica {release}, {seconds:g} s of babbling, n {n}, dt {dt:g} s | {a:.2f} s | |",
        f"| fem_spa, the same | {b:.3f} s | {a / b:.0f} times faster |",
        f"| largest distance of the tips | {apart:.3f} % of the motion of {1e3 * span:.0f} mm | aim 1 % |",
    ]


def alone(repeats: int) -> list[str]:
    """Rows of the rod's own times."""
    model = arm()
    rest = model.switched(damping=False)
    base = replace(model, clamp="base").with_values(elements=10, time_step=5e-4)
    record = babbling(300.0)
    rng = np.random.default_rng(0)
    states = rng.uniform(0, 3.5e5, (500, 3))
    single = clock(lambda: [model.settled(p) for p in states[:50]], repeats) / 50
    many = clock(lambda: model.settled(states), repeats) / len(states)
    fine = clock(lambda: model.with_values(elements=400).settled(states[:50]), repeats) / 50
    substeps = math.ceil(GRID / (SAFE * largest_step(base.discrete(), base.values())))
    step = GRID / max(2, substeps)
    whole = clock(lambda: rest.simulate(record), repeats)
    moving = clock(lambda: model.simulate(record), repeats)
    quick = clock(lambda: base.simulate(record), repeats)
    modal = replace(model, integration="modal")
    few = clock(lambda: modal.simulate(record), repeats)
    slow = model.simulate(record)
    apart = np.linalg.norm(modal.simulate(record) - slow, axis=1) / np.ptp(slow, axis=0).max() * 100
    words = f"off by {apart.mean():.2f} % of the motion in the mean, {apart.max():.2f} % at most"
    return [
        f"| 5 min of babbling at 20 Hz, moving, n 20, dt 2e-4 s, valve on | {moving:.2f} s | aim 10 s |",
        f'| the same, `integration = "modal"` | {few:.2f} s | {words} |',
        f'| the same, `clamp = "base"`, n 10, dt {step:.2g} s | {quick:.2f} s | |',
        f"| the same record, quasi-static, 30 000 states, n 20 | {whole:.2f} s | |",
        f"| one equilibrium, cold, n 20, from Python | {1e3 * single:.2f} ms | aim 5 ms |",
        f"| one of 500 random equilibria in one call, n 20 | {1e3 * many:.3f} ms | |",
        f"| one of 50 random equilibria in one call, n 400 | {1e3 * fine:.2f} ms | |",
    ]


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--no-peer", action="store_true")
    parser.add_argument("--write", action="store_true", help="put the table into docs/rod.md")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--repeats", type=int, default=3)
    given = parser.parse_args()
    rows = [] if given.no_peer else against_peer(given.seconds, given.repeats)
    rows += alone(given.repeats)
    load = f"load average {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    machine = f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}"
    machine += f", numpy {np.__version__}, numba {importlib.metadata.version('numba')}, {load}"
    text = "\n".join([machine + "", "", "| what | measured | |", "| --- | --- | --- |", *rows])
    print(text)
    if given.write:
        page = PAGE.read_text(encoding="utf-8")
        before, rest = page.split(MARKS[0])
        PAGE.write_text(f"{before}{MARKS[0]}\n{text}\n{MARKS[1]}{rest.split(MARKS[1])[1]}", encoding="utf-8")


if __name__ == "__main__":
    main()
