"""Write cases, run `fem-spa diagnose` on each in a process of its own, append a row a case; resumable."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.loop.cases import Case, draw_case
from benchmarks.loop.files import write_case
from benchmarks.loop.score import COLUMNS, score
from benchmarks.loop.tables import add_row, rows_of
from fem_spa.engine import open_engine

LIMIT = 1800.0
"""s, after which a case is given up."""


def ended(words: Sequence[str], limit: float) -> tuple[int, str]:
    """Exit status and messages of Python on one thread; -9 after `limit` s."""
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    command = [sys.executable, *words]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=limit, check=False, env={**os.environ, **threads}
        )
    except subprocess.TimeoutExpired:
        return -9, f"not done after {limit:g} s"
    return done.returncode, done.stderr


def run_cases(
    out: Path,
    tier: str,
    numbers: Sequence[int],
    seed: int,
    *,
    protocol: str | None = None,
    jobs: int = 1,
    rate: float | None = None,
    without: Sequence[str] = (),
    keep: bool = True,
) -> None:
    """Run the cases that `out`/results.csv lacks; `without`: effects kept from the program."""
    out.mkdir(parents=True, exist_ok=True)
    table = out / "results.csv"
    done = {row["name"] for row in rows_of(table)}
    left = [n for n in numbers if draw_case(tier, n, seed, protocol, without).name not in done]
    with open_engine(workers=jobs, most=max(1, len(left))) as engine:
        tasks = [(out, (tier, number, seed, protocol, tuple(without)), rate, keep) for number in left]
        for ended in engine.run(_one, tasks):
            if ended.error is not None:
                print(f"{tier} {left[ended.number]}", f"not run: {ended.error}", sep=" | ", flush=True)
                continue
            _tell(table, ended.value)


def _one(task: tuple[Path, tuple[Any, ...], float | None, bool]) -> dict[str, object]:
    """Draw a case and run it: in a process of its own, as a drawn case does not travel."""
    out, drawn, rate, keep = task
    case = draw_case(*drawn)
    return run_case(out, replace(case, rate=rate) if rate else case, drawn[-1], keep)


def _tell(table: Path, row: dict[str, object]) -> None:
    """Append a row, and say it."""
    add_row(table, COLUMNS, row)
    words = [row[k] for k in ("name", "protocol", "visible", "truth", "verdict", "effects", "rivals")]
    print(*words, f"{row['seconds']} s", row["reduction"], row["problems"], sep=" | ", flush=True)


def run_case(out: Path, case: Case, without: Sequence[str] = (), keep: bool = True) -> dict[str, object]:
    """Write one case, diagnose it, score it."""
    folder, result = out / "cases" / case.name, out / "results" / case.name
    truth = write_case(case, folder)
    truth["folder"] = str(folder)
    shutil.rmtree(result, ignore_errors=True)
    trained = [r for r in truth["records"] if r not in truth["holdout"]]
    words = ["diagnose", str(folder / "model.toml"), *(str(folder / r) for r in trained)]
    if truth["holdout"]:
        words += ["--holdout", *(str(folder / r) for r in truth["holdout"])]
    words += ["--seed", str(case.seed), "--out", str(result)]
    begin = time.perf_counter()
    status, said = ended(["-c", program(without), *words], LIMIT)
    try:
        row = score(truth, result, status, time.perf_counter() - begin, said)
    except (KeyError, TypeError, ValueError) as error:
        row = score(truth, out / "nowhere", status, time.perf_counter() - begin, "")
        row["problems"] = f"report cannot be read: {type(error).__name__} {error}"
    if not keep:
        shutil.rmtree(folder)
        for heavy in ("predictions", "report.html"):
            shutil.rmtree(result / heavy, ignore_errors=True)
    return row


def program(without: Sequence[str]) -> str:
    """`fem-spa`, some effects taken out of its library first; its largest memory (MB) is told last."""
    lines = ["import resource, sys", "from fem_spa.cli import main"]
    if without:
        lines += [
            "from fem_spa.loop.effects.registry import EFFECTS",
            f"[EFFECTS.pop(name, None) for name in {json.dumps(list(without))}]",
        ]
    peak = "resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10"
    lines += ["status = main()", f"print('PEAK_MB', {peak}, file=sys.stderr)", "sys.exit(status)"]
    return "\n".join(lines)
