"""From a deck to a result folder: geometry, problem, solution, files."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fem_spa.deck import Deck, read_deck
from fem_spa.errors import InputError
from fem_spa.output.files import write_whole
from fem_spa.output.folder import ResultFolder
from fem_spa.output.progress import Progress
from fem_spa.output.words import verdict
from fem_spa.prepare import Setup, prepare
from fem_spa.solid.problem import Result
from fem_spa.units import brief

EXIT = {"done": 0, "limit": 1, "diverged": 1, "interrupted": 1}


@dataclass
class Outcome:
    """What a run came to.

    Attributes
    ----------
    result : rows, states, status
    setup : problem, materials' sources, the deck as resolved
    folder : where the files are
    record : content of result.json
    """

    result: Result
    setup: Setup
    folder: Path
    record: dict[str, Any]

    @property
    def exit_status(self) -> int:
        """0 where the end of the load path was reached, else 1."""
        return EXIT.get(self.result.status, 1)

    @property
    def verdict(self) -> str:
        """One sentence: how far it came and what is there."""
        return verdict(self.setup.problem, self.result, self.result.rows)


def run_deck(
    deck: Deck | str | Path,
    out: str | Path | None = None,
    overrides: Sequence[str] = (),
    observers: Sequence[Any] = (),
    quiet: bool = False,
) -> Outcome:
    """Solve a deck and leave curve.csv, result.json, fields, pictures and the report in a folder.

    Parameters
    ----------
    deck : a deck, or the path of one
    out : the folder; None is ``out/<name of the deck>``. Nothing is written outside it, and
        nothing at all before the solver has accepted the problem.
    overrides : texts ``key=value`` (only with a path)
    observers : more observers, told after the program's own
    quiet : no progress on stderr

    Raises
    ------
    InputError, geometry.errors.GeometryError, materials.errors.MaterialError
        The input is wrong, in one line; nothing was written.
    """
    begun = time.perf_counter()
    if not isinstance(deck, Deck):
        deck = read_deck(deck, overrides)
    path = output_place(out, deck.name)
    progress = Progress(quiet)
    with progress:
        progress.say(f"meshing {deck.geometry.shape or deck.geometry.file}")
        setup = prepare(deck)
        folder = ResultFolder(path)
        result = _solve(setup, folder, [folder, progress, *observers])
        result.warnings = [*setup.warnings, *result.warnings]
        result.rows = list(folder.rows)  # with the motion of the tip
    record = write_result(setup, result, folder, begun)
    return Outcome(result, setup, path, record)


def output_place(out: str | Path | None, name: str) -> Path:
    """The output folder that was asked for, or ``out/<name>``; refused where it cannot be one."""
    if out is not None and not str(out).strip():
        raise InputError(f"given {brief(out)} for --out: it is empty; give a folder, or leave --out out")
    path = Path("out") / name if out is None else Path(out)
    refuse_place(path)
    return path


def refuse_place(path: Path) -> None:
    """Refuse an output folder that cannot be one."""
    for part in (path, *path.parents):
        try:
            found = part.exists()
        except (OSError, ValueError) as error:  # a name too long, or one that no file can have
            why = getattr(error, "strerror", None) or error
            raise InputError(f"given {brief(path)} for --out: {why}; give another folder") from None
        if found:
            if not part.is_dir():
                raise InputError(f"given {path} for --out: {part} is a file; give a folder, new or old")
            break


def _solve(setup: Setup, folder: ResultFolder, observers: Sequence[Any]) -> Result:
    """The solver's result; an interruption or a fault of the program keeps what was reached."""
    from fem_spa.solid.path import solve

    listen()
    try:
        return solve(setup.problem, setup.steps, observers)
    except KeyboardInterrupt:
        if not folder.started:
            raise
        return _partial(setup, folder, "interrupted", "interrupted by the user")
    except Exception:
        if not folder.started:
            raise
        return _fault(setup, folder)


def listen() -> None:
    """Let Ctrl-C and a polite end from outside raise KeyboardInterrupt, so that what was reached stays whole.

    Set here, after meshing: gmsh takes the system's own handlers of both. A signal that the caller's
    shell ignores stays ignored; outside the main thread nothing is set.
    """
    if threading.current_thread() is not threading.main_thread():
        return

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    for name in ("SIGINT", "SIGTERM"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, interrupt)


def _fault(setup: Setup, folder: ResultFolder) -> Result:
    """A fault of the program itself: its trace goes to error.log, what was reached stays."""
    if os.environ.get("FEM_SPA_DEBUG"):
        raise
    text = traceback.format_exc()
    log = folder.path / "error.log"
    write_whole(log, text)
    last = text.strip().splitlines()[-1]
    return _partial(
        setup, folder, "diverged", f"a fault of the program ended the run ({last}); its trace is in {log}"
    )


def _partial(setup: Setup, folder: ResultFolder, status: str, message: str) -> Result:
    """A result from what the folder has seen."""
    space = folder.space
    result = Result(
        status=status,
        message=message,
        rows=list(folder.rows),
        states=[] if folder.last_state is None else [folder.last_state],
        dofs=int(getattr(space, "n_dofs", 0)),
        elements=len(setup.problem.mesh.tets),
        newton_iterations=sum(row.iterations for row in folder.rows),
        factorizations=0,
        seconds={},
    )
    with contextlib.suppress(Exception):  # the fault may be that fields cannot be written
        folder.finished(result)
    return result


def write_result(setup: Setup, result: Result, folder: ResultFolder, begun: float) -> dict[str, Any]:
    """result.json first, then the pictures and the report, then result.json with their cost.

    A picture that cannot be drawn costs a warning, never the result; nor does Ctrl-C meanwhile.

    Parameters
    ----------
    begun : `time.perf_counter()` at the start of the run
    """
    from fem_spa.output.record import record, to_json

    seconds = {name: result.seconds.get(name, 0.0) for name in ("assembly", "linear", "contact")}
    seconds = {"mesh": setup.mesh_seconds, **seconds, "output": folder.seconds, "total": 0.0}

    def write() -> dict[str, Any]:
        seconds["total"] = time.perf_counter() - begun
        table = record(setup.problem, result, setup.resolved, setup.sources, seconds)
        write_whole(folder.path / "result.json", to_json(table))
        return table

    table = write()
    before = time.perf_counter()
    try:
        _pictures(setup, result, folder)
    except KeyboardInterrupt:
        result.warnings.append("Pictures left out: interrupted.")
    seconds["output"] += time.perf_counter() - before
    table = write()
    try:
        from fem_spa.output.report import write_report

        write_report(folder.path / "report.html", setup.problem, result, table)
    except KeyboardInterrupt:
        result.warnings.append("Report left out: interrupted.")
        table = write()
    return table


def _pictures(setup: Setup, result: Result, folder: ResultFolder) -> None:
    """curve.png and shape.png; the shape is rendered by a process of its own meanwhile."""
    from fem_spa.output.curve_plot import write_curve
    from fem_spa.output.shape_picture import ShapePicture

    problem, rows = setup.problem, result.rows
    last = (folder.last_state, rows[-1]) if rows else (None, None)
    try:
        shape = ShapePicture(problem, folder.space, *last)
        write_curve(folder.path / "curve.png", problem, result, rows)
        shape.write(folder.path / "shape.png")
    except Exception as error:
        if os.environ.get("FEM_SPA_DEBUG"):
            raise
        result.warnings.append(f"A picture could not be drawn ({type(error).__name__}: {error}).")
