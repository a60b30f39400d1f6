"""Random decks, cards, test files, records, models, meshes and command lines, through the program's entry.

    python benchmarks/bad_input.py [--draws 2000] [--seed 0] [--only KIND ...] [--write]

Each draw is a good input that hypothesis has changed: values, keys, bytes, rows, nodes. It is refused (status
2, one line, nothing written), or the job ends early with a reason (1), or it succeeds with sensible results
(0). What it must not do: show a traceback or a fault of the program, take longer than a minute, take memory
without bound, write outside its folder, run code that no one named as a law, or succeed with nonsense.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import io
import json
import math
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from unittest import mock

from bad_input_draws import Draw, draws
from faults import put
from hypothesis import HealthCheck, Phase, given, seed, settings

from fem_spa.cli import main as program

LIMIT = 60
"""s: no draw may compute longer."""
MEMORY = 6e9
"""Bytes of addresses that the process may have beyond what it starts with."""
SHARES = {
    **{"deck": 0.2, "shape": 0.1, "card": 0.1, "mesh": 0.15, "test file": 0.12, "record": 0.04},
    **{"model": 0.08, "curve": 0.06, "command line": 0.15},
}
"""Of the draws; a record that is accepted costs a diagnosis."""
RANGES = {"volume [mm^3]": (0.0, 1e12), "max stretch": (1.0, 1e3)}


class Hang(BaseException):
    """A draw has taken too long."""


@contextlib.contextmanager
def alarm(seconds: int) -> Iterator[None]:
    """Raises Hang after so many seconds of computing, or ten times as many of waiting."""

    def ring(*_: object) -> None:
        raise Hang

    before = [signal.signal(number, ring) for number in (signal.SIGPROF, signal.SIGALRM)]
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.alarm(10 * seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.setitimer(signal.ITIMER_PROF, 0)
        for number, handler in zip((signal.SIGPROF, signal.SIGALRM), before, strict=True):
            signal.signal(number, handler)


def judge(draw: Draw, folder: Path) -> tuple[int | None, str | None]:
    """Exit status of a draw in an empty folder that is the current one, and what is wrong with that."""
    for name, content in draw.files.items():
        (folder / name).write_bytes(content)
    before = {path.name for path in folder.iterdir()}
    out, err = io.StringIO(), io.StringIO()
    status: int | None = None
    try:
        with (
            alarm(LIMIT),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("always")
            warnings.showwarning = lambda *a, **_: err.write(f"warning: {a[0]}\n")
            with mock.patch("fem_spa.run._pictures"), mock.patch("fem_spa.output.report.write_report"):
                status = program(list(draw.words))
    except Hang:
        return None, f"longer than {LIMIT} s"
    except BaseException:
        return None, "raised: " + traceback.format_exc().strip().splitlines()[-1]
    said = err.getvalue()
    lines = [line for line in said.splitlines() if line.strip()]
    after = {path.name for path in folder.iterdir()} - before
    if (folder / "harmed").exists():
        return status, None if "harm.py" in "".join(draw.words) else "ran harm.py"
    if "Traceback" in said or "a fault of the program" in said or list(folder.rglob("error.log")):
        return status, "a fault: " + (lines[-1] if lines else "error.log")
    if "not enough memory" in said:
        return status, "took all memory: " + lines[-1]
    if status not in (0, 1, 2):
        return status, f"status {status}"
    if status == 2 and (len(lines) != 1 or after):
        return status, f"{len(lines)} lines, wrote {sorted(after)}: {said[:300]!r}"
    if after - {"out"}:
        return status, f"wrote {sorted(after)}"
    return status, sense(draw, folder, status)


def sense(draw: Draw, folder: Path, status: int) -> str | None:
    """What is wrong with the results of a draw that was accepted."""
    for path in folder.rglob("out/**/curve.csv"):
        with path.open(encoding="utf-8", newline="") as file:
            table = list(csv.DictReader(file))
        result = json.loads((path.parent / "result.json").read_text(encoding="utf-8"))
        if (status == 0) != (result["status"] == "done"):
            return f"status {status}, but {result['status']} in result.json"
        for row in table:
            for name, cell in row.items():
                value = float(cell)
                if not math.isfinite(value) and not name.startswith(
                    ("angle", "tip", "chord", "ext", "min", "dir", "til")
                ):
                    return f"{name} is {cell}"
                if (name == "volume [mm^3]" and value < 0) or (
                    name == "max stretch" and not 1.0 <= value < 1e3
                ):
                    return f"{name} is {cell}"
    for path in folder.rglob("out/**/*.json"):
        json.loads(path.read_text(encoding="utf-8"), parse_constant=lambda word: 1 / 0)
    for path in folder.rglob("out/**/predictions/*.csv"):
        for line in path.read_text(encoding="utf-8").splitlines()[1:]:
            if not all(math.isfinite(float(cell)) for cell in line.split(",")):
                return f"{path.name} has {line}"
    return None


@contextlib.contextmanager
def place() -> Iterator[Path]:
    """An empty folder as the current one."""
    kept = Path.cwd()
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        try:
            yield Path(name)
        finally:
            os.chdir(kept)


def run(
    count: int, number: int, kinds: tuple[str, ...], tell: Callable[[str], None]
) -> list[tuple[Draw, str]]:
    """Draw and judge; a table goes to `tell`, what is wrong is returned."""
    wrong: list[tuple[Draw, str]] = []
    tally: Counter[tuple[str, int | None]] = Counter()
    slowest: dict[str, float] = {}

    def one(draw: Draw) -> None:
        begun = time.process_time()
        with place() as folder:
            status, why = judge(draw, folder)
        slowest[draw.kind] = max(slowest.get(draw.kind, 0.0), time.process_time() - begun)
        tally[draw.kind, status] += 1
        if why is not None:
            wrong.append((draw, why))
            tell(f"  {draw.kind}: {' '.join(draw.words)}: {why}")

    tell("| input | draws | refused (2) | ended early (1) | done (0) | slowest | wrong |")
    tell("|---|---|---|---|---|---|---|")
    for kind, strategy in draws().items():
        if kinds and kind not in kinds:
            continue
        share = 1.0 / len(kinds) if kinds else SHARES[kind]
        plan = settings(
            max_examples=max(1, round(count * share)),
            deadline=None,
            database=None,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        seed(number)(plan(given(strategy)(one)))()
        n = {status: tally[kind, status] for status in (2, 1, 0, None)}
        bad = sum(draw.kind == kind for draw, _ in wrong)
        tell(f"| {kind} | {sum(n.values())} | {n[2]} | {n[1]} | {n[0]} | {slowest[kind]:.1f} s | {bad} |")
    return wrong


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draws", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--write", action="store_true", help="put the table into docs/reliability.md")
    parser.add_argument("--keep", type=Path, help="folder for the inputs that went wrong")
    arguments = parser.parse_args()
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (int(MEMORY), resource.RLIM_INFINITY))
    lines: list[str] = []

    def tell(text: str) -> None:
        print(text, flush=True)
        lines.append(text)

    wrong = run(arguments.draws, arguments.seed, tuple(arguments.only), tell)
    if arguments.write:
        put("bad_input.py", lines)
    for number, (draw, why) in enumerate(wrong if arguments.keep else []):
        folder = arguments.keep / str(number)
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in draw.files.items():
            (folder / name).write_bytes(content)
        (folder / "why.txt").write_text(f"fem-spa {' '.join(draw.words)}\n{why}\n", encoding="utf-8")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
