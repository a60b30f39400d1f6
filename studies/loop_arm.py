"""The arm paper's ablation in reverse: leave a component out of the rod, and let the loop find which.

Alessi, Falotico, Lucantonio (IEEE Access 2023) switch off gravity, strain gains, damping and valve one
at a time and report how much worse the rod gets (Fig. 11, Table 4). Here the records come from the whole
rod, with other numerics (another clamp and number of elements), another modulus, and noise and an offset
of each record as on a bench. The base model lacks one component; the program is told nothing but the
model file. Each component is sought in records of all protocols together, then of one protocol alone.

Diagnoses that are in the folder are not done again: an interrupted study goes on where it was.
"""

from __future__ import annotations

import contextlib
import io
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.engine.interface import open_engine
from fem_spa.errors import InputError
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import read_model
from studies.loop_records import arm, errors, kept, said

SUMMARY = (
    "the arm paper's ablation in reverse: which component does a rod lack, from records of the whole rod?"
)
EXPECTED = {
    "gravity": {"gravity"},
    "strain_gains": {"chamber-gain"},
    "damping": {"viscous-lag"},
    "valve": {"dead-band", "pressure-lag"},
}
ALIKE = {
    "gravity": {"payload"},
    "strain_gains": {"cross-coupling"},
    "damping": {"pressure-lag", "sensor-lag"},
    "valve": {"delay", "viscous-lag", "sensor-lag"},
}
"""Names that one protocol alone may rightly leave beside the expected one: a set, but not first."""
PAPER = {"gravity": 1.88, "strain_gains": 1.18, "damping": 1.11, "valve": 0.27}
"""% of the arm's length that leaving it out adds to the mean error, Table 4."""
MARKS = {
    "right": "right",
    "and": "right with another beside it",
    "in the set": "in the set but not first",
    "its like": "its like",
    "wrong": "wrong",
    "missed": "missed",
    "hidden": "rightly nothing where it is hidden",
    "refused": "refused",
}
"""How a verdict on one protocol alone is marked -> in words."""
COMPONENTS = ("gravity", "strain_gains", "damping", "valve")
"""Those that `run` leaves out, one at a time."""
LENGTH = 190.0
SECONDS, RATE, TOP = 8.0, 50.0, 350.0
"""s a record, Hz, kPa, of all protocols together."""
SITTING, SLOWER = 10.0, 25.0
"""s a record and Hz, of one protocol alone."""
HELD = ("babble2", "level2")
NOISE = math.sqrt(3.0 * (arm.WHITE**2 + arm.SLOW**2))
"""mm RMS of the tip within a record: what shows less than that is hidden."""


@dataclass(frozen=True)
class Task:
    """One diagnosis: the component that is left out, the protocol or "all", and the files."""

    component: str
    protocol: str
    model: Path
    train: tuple[Path, ...]
    held: tuple[Path, ...]
    out: Path


Found = dict[tuple[str, str], dict[str, Any]]
"""Component and protocol -> report."""


def run(out: Path) -> int:
    """Records of the whole rod, then a report for each component left out; prints the tables."""
    files = write_records(out / "records", np.random.default_rng(2023))
    held = tuple(f for f in files if f.stem in HELD)
    train = tuple(f for f in files if f.stem not in HELD)
    rng = np.random.default_rng(2024)
    commands = arm.sittings(SITTING, SLOWER, rng)
    tasks = []
    sittings = {
        name: arm.write_sitting(out / "sittings", name, c, SLOWER, rng) for name, c in commands.items()
    }
    for component in COMPONENTS:
        model = out / f"without_{component}.toml"
        model.write_text(
            f'[model]\nkind = "rod"\npreset = "am-i-support"\n{component} = false\n', encoding="utf-8"
        )
        tasks.append(Task(component, "all", model, train, held, out / component))
        for name, (*first, last) in sittings.items():
            tasks.append(Task(component, name, model, tuple(first), (last,), out / f"{component}_{name}"))
    found = every(tasks)
    print(words([(component, found[component, "all"]) for component in COMPONENTS]))
    sizes = {(c, name): arm.shows(c, given, SLOWER) for name, given in commands.items() for c in COMPONENTS}
    alone = {name: arm.numerics(given, SLOWER) for name, given in commands.items()}
    print(table(found, sizes, alone))
    return 0


def every(tasks: Sequence[Task]) -> Found:
    """All reports, several made at a time; one line a report on stderr."""
    found: Found = {}
    with open_engine(most=len(tasks)) as engine:
        for ended in engine.run(told, tasks):
            if ended.error is not None:
                raise ended.error
            task = tasks[ended.number]
            found[task.component, task.protocol] = ended.value
            names = ", ".join(e["name"] for e in ended.value["effects"])
            line = f"without {task.component}, {task.protocol}: {ended.value['verdict']} {names}".rstrip()
            print(f"{len(found)} of {len(tasks)}  {line}", file=sys.stderr, flush=True)
    return found


def told(task: Task) -> dict[str, Any]:
    """The report of one task; its progress is not shown, as others run beside it."""
    with contextlib.redirect_stderr(io.StringIO()) as said_so:
        try:
            return kept(task.model, task.train, task.out, task.held)
        except InputError as reason:
            last = said_so.getvalue().strip().splitlines()[-1:]
            raise InputError(" ".join([str(reason), *last])) from None


def protocols(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Name -> (n, 3) command in kPa: stretching, bending, sinusoids, babbling; two for a level arm."""
    n = round(SECONDS * RATE)
    t = np.arange(n) / RATE
    stairs = TOP * np.minimum(np.floor(t) / 6, 1.0)
    wave = TOP * 0.5 * (1 - np.cos(2 * math.pi * 0.25 * t))

    def babble() -> np.ndarray:
        levels = rng.uniform(0, TOP, (int(SECONDS) + 1, 3))
        return levels[np.floor(t).astype(int)]

    return {
        "stretch": np.outer(stairs, [1, 1, 1]),
        "bend1": np.outer(stairs, [1, 0, 0]),
        "bend2": np.outer(stairs, [0, 1, 1]),
        "sine": np.column_stack([wave, np.roll(wave, n // 6), np.roll(wave, n // 3)]),
        "babble1": babble(),
        "babble2": babble(),
        "level1": np.outer(wave, [1, 0, 0]),
        "level2": np.outer(stairs, [0, 1, 0]),
    }


def write_records(folder: Path, rng: np.random.Generator) -> list[Path]:
    """Records of the whole rod; the last two with the arm held level."""
    truth = read_model(arm.WHOLE)
    files = []
    for name, command in protocols(rng).items():
        time = np.arange(len(command)) / RATE
        way = 90.0 if name.startswith("level") else 0.0
        tip = 1e3 * truth.simulate(Drive(time, 1e3 * command, orientation=math.radians(way)))
        files.append(arm.measured(folder / f"{name}.csv", time, command, tip, way, rng))
    return files


def by_protocol(report: dict[str, Any]) -> str:
    """Error of each protocol before and after; the held-out ones in brackets."""
    parts = []
    for record in report["error"]["records"]:
        text = f"{Path(record['file']).stem} {record['before']:.1f} to {record['after']:.1f}"
        parts.append(f"({text})" if record["role"] == "heldout" else text)
    return f"by protocol, mm: {', '.join(parts)}"


def words(rows: list[tuple[str, dict[str, Any]]]) -> str:
    """All protocols together, for the terminal."""
    lines = []
    for component, report in rows:
        names = {effect["name"] for effect in report["effects"]}
        expected = EXPECTED[component]
        found = (
            "found"
            if names == expected
            else "found in part"
            if names & expected
            else "among the rivals"
            if expected & set(report["candidates"])
            else "not found"
        )
        before, after = (report["error"]["heldout"][k] for k in ("before", "after"))
        lines.append(f"without {component}: {found} (expected {', '.join(sorted(expected))})")
        lines.append(f"  {said(report)}")
        lines.append(f"  {errors(report)}")
        lines.append(f"  {by_protocol(report)}")
        if before is not None:
            shares = f"{100 * before / LENGTH:.2f} before, {100 * after / LENGTH:.2f} after"
            cost = f"leaving it out cost the paper's rod {PAPER[component]:.2f} %"
            lines.append(f"  in % of the length: {shares}; {cost}")
    lines += [
        "The paper's figure is the mean error added over its own protocols against its bench; here modulus",
        "and offset are refitted without the component, which hides a part, and the protocols are others.",
    ]
    return "\n".join(lines)


def judged(component: str, report: dict[str, Any], shows: float) -> str:
    """Whether what is said of one protocol alone is right."""
    names = [effect["name"] for effect in report["effects"]]
    expected, alike, candidates = EXPECTED[component], ALIKE[component], {*report["candidates"]}
    hidden = shows < NOISE
    if report["verdict"] == "insufficient":
        return "refused"
    if not names:
        return "hidden" if hidden else "missed"
    others = [n for n in names if n not in expected]
    if not others:
        return "right"
    if {*names} & expected:
        return f"and {', '.join(others)}"
    if expected & candidates:
        return "in the set"
    return "its like" if {*names} <= alike else "wrong, hidden" if hidden else "wrong"


def _count(marks: Sequence[str], start: str) -> int:
    return sum(mark.startswith(start) for mark in marks)


def table(found: Found, sizes: dict[tuple[str, str], float], alone: dict[str, float]) -> str:
    """Components by protocols, one alone each."""
    lines = [
        "One protocol alone, three or four records, one of them held out",
        f"{'without':13s}{'protocol':10s}{'shows':>6s}  {'before':>6s} {'after':>6s} {'floor':>6s}  right?",
    ]
    unseen: dict[str, list[str]] = {}
    faint, far = [], []
    for (component, protocol), shows in sorted(sizes.items(), key=lambda item: COMPONENTS.index(item[0][0])):
        report = found[component, protocol]
        held = report["error"]["heldout"]
        figures = " ".join(
            f"{'-' if held[k] is None else format(held[k], '.2f'):>6s}" for k in ("before", "after", "floor")
        )
        effects = [
            e["name"] + (f" (or {', '.join(e['rivals'])})" if e["rivals"] else "") for e in report["effects"]
        ]
        mark = judged(component, report, shows)
        named = f"{report['verdict']}: {' and '.join(effects)}" if effects else report["verdict"]
        lines.append(f"{component:13s}{protocol:10s}{shows:6.2f}  {figures}  {mark}: {named}")
        if effects and held["after"] > 3 * math.hypot(alone[protocol], NOISE, math.sqrt(3) * arm.OFFSET):
            far.append(f"{component} in {protocol} {held['after']:.2f}")
        if shows < NOISE:
            unseen.setdefault(component, []).append(f"{protocol} {shows:.2f} mm")
        elif shows < 2 * NOISE:
            faint.append(f"{component} in {protocol} {shows:.2f} mm")
    marks = [judged(c, found[c, p], shows) for (c, p), shows in sizes.items()]
    left = ", ".join(f"{name} {size:.2f}" for name, size in alone.items())
    lines += [
        "Errors held out, mm. shows: what the component does to the tip, mm RMS, once modulus and offset are",
        f"refitted without it; noise within a record is {NOISE:.2f} mm, and below that it counts as hidden.",
        f"Other numerics of the arm alone leave, mm: {left}.",
        f"Of {len(marks)}: "
        + ", ".join(f"{words} {n}" for m, words in MARKS.items() if (n := _count(marks, m))),
        "Right is what was expected; for the valve one of its two parts, dead-band or pressure-lag, or both.",
        "Its like is what may rightly stand beside it as a set, in one mounting and one way of moving:",
        *(f"  {component}: {', '.join(sorted(names))}" for component, names in ALIKE.items()),
        *(f"Hidden: {component} in {', '.join(where)}." for component, where in unseen.items()),
        *([f"Named, but the number is far off, by what is left: {', '.join(far)} mm."] if far else []),
        *([f"Hardly more than noise: {', '.join(faint)}."] if faint else []),
        "Refused: without that component the base model is so far off that it is taken for another arm's.",
    ]
    return "\n".join(lines)
