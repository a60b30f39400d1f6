"""From a plan to a folder: meshes, cases, the table as it grows, pictures and page."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from fem_spa.engine import Ended, Engine, EngineGone, WorkerLost, open_engine
from fem_spa.errors import InputError, Unfinished
from fem_spa.mesh_store import place
from fem_spa.output.claim import claimed, refuse_busy, refused
from fem_spa.output.files import write_whole
from fem_spa.sweep.case import ENDS, Line, Task, draw, read_line, solve
from fem_spa.sweep.cases import Case, make_plan
from fem_spa.sweep.state import Request, Sweep
from fem_spa.sweep.table import folder_of, sweep_csv
from fem_spa.sweep.words import case_words, time_left

WRITTEN = ("sweep.csv", "sweep.json", "curves.png", "keys.png", "maps.png", "report.html")
SECONDS_BETWEEN_TABLES = 1.0
"""The table, which may have thousands of rows, is written no more often; a case is in its folder at once."""


def run_sweep(request: Request, folder: Path, say: Callable[[str], None] = lambda text: None) -> Sweep:
    """Run the cases of a sweep that are not solved yet, and write the table, the pictures and the page.

    Parameters
    ----------
    folder : of the results; cases of an earlier call in it count
    say : is told of every case that ends

    Raises
    ------
    InputError
        The input is wrong, in one line; nothing was written.
    """
    begun = time.perf_counter()
    folder = folder.resolve()
    refuse_busy(folder)
    plan = make_plan(
        request.deck, request.vary, request.sample, request.seed, request.overrides, folder / "meshes"
    )
    sweep = Sweep(plan, folder)
    left = _earlier(sweep, request.again)
    engine = open_engine(request.scheduler, request.workers, len(left)) if left else None
    with contextlib.ExitStack() as stack:
        if engine is not None:
            stack.enter_context(engine)
        stack.enter_context(claimed(folder))
        with refused(folder):
            if engine is not None:
                engine.refuse_blind(folder)
            write_whole(folder / "sweep.json", json.dumps({"status": "running"}) + "\n")
        if engine is not None:
            sweep.engine = engine.words
            say(f"{len(left)} of {len(plan.cases)} cases to run, by {engine.words}")
            try:
                _run(sweep, engine, left, request.again, say)
                engine.close()
            except KeyboardInterrupt:
                sweep.status, sweep.message = "interrupted", "interrupted by the user"
                say("interrupted: what is at work puts its results in order (Ctrl-C again: at once)")
                with contextlib.suppress(KeyboardInterrupt):
                    engine.close()
            except EngineGone as error:
                sweep.status, sweep.message = "stopped", str(error)
            _look_again(sweep, left)
        sweep.seconds = time.perf_counter() - begun
        _finish(sweep, request)
    return sweep


def _earlier(sweep: Sweep, again: bool) -> list[Case]:
    """Take what earlier calls have solved; the cases that are left."""
    keep = ENDS[:1] if again else ENDS
    left = []
    for case in sweep.plan.cases:
        if case.deck is None:
            sweep.lines[case.name] = Line("refused", case.refused)
            continue
        line = read_line(sweep.folder / folder_of(case))
        if line is not None and line.status in keep:
            sweep.lines[case.name] = line
            sweep.found += 1
        else:
            left.append(case)
    return left


def _run(sweep: Sweep, engine: Engine, left: Sequence[Case], again: bool, say: Callable[[str], None]) -> None:
    """Meshes that several cases share, then the cases, those of one mesh after one another."""
    begun = time.monotonic()
    left = _draw(sweep, engine, left, say)
    tasks = [_task(sweep, case, again) for case in left]
    written = time.monotonic()
    write_whole(sweep.folder / "sweep.csv", sweep_csv(sweep.plan, sweep.lines))
    for done, ended in enumerate(engine.run(solve, tasks), 1):
        case = left[ended.number]
        line = sweep.lines[case.name] = _line_of(ended)
        if time.monotonic() > written + SECONDS_BETWEEN_TABLES:
            write_whole(sweep.folder / "sweep.csv", sweep_csv(sweep.plan, sweep.lines))
            written = time.monotonic()
        rest = (time.monotonic() - begun) / done * (len(left) - done)
        say(f"case {done} of {len(left)}: {case_words(sweep.plan, case, line)}{time_left(rest)}")


def _draw(sweep: Sweep, engine: Engine, left: Sequence[Case], say: Callable[[str], None]) -> list[Case]:
    """Make the meshes that more than one case needs; the cases that are still to be solved."""
    users: dict[str, list[Case]] = {}
    for case in left:
        users.setdefault(case.mesh, []).append(case)
    meshes = sweep.folder / "meshes"
    shared = [cases for key, cases in users.items() if len(cases) > 1 and not place(meshes, key).is_file()]
    if shared:
        say(f"meshing {len(shared)} geometr{'y' if len(shared) == 1 else 'ies'} for {len(left)} cases")
    for ended in engine.run(draw, [cases[0].deck for cases in shared]):
        if ended.error is not None:
            for case in shared[ended.number]:
                sweep.lines[case.name] = _line_of(ended)
    return [case for case in left if case.name not in sweep.lines]


def _task(sweep: Sweep, case: Case, again: bool) -> Task:
    assert case.deck is not None
    return Task(case.deck, sweep.folder / folder_of(case), again)


def _line_of(ended: Ended) -> Line:
    """A case's line from how its task ended."""
    from geometry.errors import GeometryError
    from materials.errors import MaterialError

    error = ended.error
    if isinstance(error, Unfinished):
        return Line("interrupted", str(error))
    if error is None:
        return ended.value if isinstance(ended.value, Line) else Line("waiting")
    if isinstance(error, WorkerLost):
        return Line("lost", str(error))
    words = " ".join(str(error).split())
    if isinstance(error, (InputError, GeometryError, MaterialError)):
        return Line("refused", words)
    return Line("fault", f"{type(error).__name__}: {words}")


def _look_again(sweep: Sweep, left: Sequence[Case]) -> None:
    """What cases left behind that were at work when the sweep was interrupted."""
    for case in left:
        if sweep.line(case).status in ("waiting", "interrupted"):
            line = read_line(sweep.folder / folder_of(case))
            if line is not None:
                sweep.lines[case.name] = line


def _finish(sweep: Sweep, request: Request) -> None:
    """Table, record, pictures, page."""
    from fem_spa.output.record import versions
    from fem_spa.sweep.page import write_page
    from fem_spa.sweep.pictures import draw_all

    folder = sweep.folder
    write_whole(folder / "sweep.csv", sweep_csv(sweep.plan, sweep.lines))
    statuses = [line.status for line in sweep.in_order()]
    record: dict[str, Any] = {
        "status": sweep.status,
        "message": sweep.message,
        "deck": str(request.deck),
        "vary": list(request.vary),
        "set": list(request.overrides),
        "sample": request.sample,
        "seed": request.seed,
        "cases": {status: statuses.count(status) for status in dict.fromkeys(statuses)},
        "run before": sweep.found,
        "same as others": sweep.plan.twins,
        "engine": sweep.engine,
        "seconds": round(sweep.seconds, 3),
        "command": request.command,
        "versions": versions(),
    }
    write_whole(folder / "sweep.json", json.dumps(record, indent=1, ensure_ascii=False) + "\n")
    write_page(folder / "report.html", sweep, request, draw_all(sweep))
