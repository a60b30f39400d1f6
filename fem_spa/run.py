"""From a deck to a result folder: geometry, problem, solution, files."""

from __future__ import annotations

import contextlib
import json
import os
import time
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fem_spa.checkpoint import FOLDER, Checkpoints, difference
from fem_spa.deck import Deck, read_deck
from fem_spa.errors import InputError, Unfinished
from fem_spa.interruption import Interruption
from fem_spa.mesh_store import has as has_mesh
from fem_spa.mesh_store import keep as keep_mesh
from fem_spa.output.claim import refuse_busy
from fem_spa.output.files import write_whole
from fem_spa.output.folder import ResultFolder
from fem_spa.output.progress import Progress
from fem_spa.output.words import verdict
from fem_spa.prepare import Setup, built_in, prepare
from fem_spa.solid.problem import Result
from fem_spa.units import brief

MESH = "mesh"
"""Folder of a run's mesh, for --resume: meshing the same drawing twice does not give the same bits."""
EXIT = {"done": 0, "limit": 1, "diverged": 1, "interrupted": 1}


@dataclass
class Outcome:
    """What a run came to.

    Attributes
    ----------
    result : rows, states, status; without rows where the run had ended before
    setup : problem, materials' sources, the deck as resolved
    folder : where the files are
    record : content of result.json
    had_ended : an earlier run has reached its end there, and nothing was done
    """

    result: Result
    setup: Setup
    folder: Path
    record: dict[str, Any]
    had_ended: bool = False

    @property
    def exit_status(self) -> int:
        """0 where the end of the load path was reached, else 1."""
        return EXIT.get(self.result.status, 1)

    @property
    def verdict(self) -> str:
        """One sentence: how far it came and what is there."""
        if self.had_ended:
            return f"Nothing to do: this run has ended before ({self.result.status})."
        return verdict(self.setup.problem, self.result, self.result.rows)


def run_deck(
    deck: Deck | str | Path,
    out: str | Path | None = None,
    overrides: Sequence[str] = (),
    observers: Sequence[Any] = (),
    quiet: bool = False,
    resume: bool = False,
) -> Outcome:
    """Solve a deck and leave curve.csv, result.json, fields, pictures and the report in a folder.

    Parameters
    ----------
    deck : a deck, or the path of one
    out : the folder; None is ``out/<name of the deck>``. Nothing is written outside it, and
        nothing at all before the solver has accepted the problem.
    overrides : texts ``key=value`` (only with a path)
    observers : more observers, told after the program's own; where a run is resumed, of what is new
    quiet : no progress on stderr
    resume : go on after the last checkpoint in the folder; anew where there is none

    Raises
    ------
    InputError, geometry.errors.GeometryError, materials.errors.MaterialError
        The input is wrong, in one line; nothing was written. To resume, deck and mesh must be the same.
    Unfinished
        The results cannot be written any further; what was finished is there.
    """
    begun = time.perf_counter()
    if not isinstance(deck, Deck):
        deck = read_deck(deck, overrides)
    path = output_place(out, deck.name)
    refuse_busy(path)
    progress = Progress(quiet)
    checkpoints = Checkpoints(path / FOLDER)
    if resume and deck.meshes is None and has_mesh(path / MESH, deck, _shape(deck)):
        deck = deck.with_meshes(path / MESH)
    with contextlib.ExitStack() as stack:
        with progress:
            progress.say(f"meshing {deck.geometry.shape or deck.geometry.file}")
            setup = prepare(deck)
            folder = stack.enter_context(ResultFolder(path, checkpoints.remove))
            problem = identity(setup)
            memory = None
            if resume:
                ended, memory = earlier(folder, checkpoints, problem)
                if ended is not None:
                    return Outcome(_bare(ended), setup, path, ended, had_ended=True)
                progress.note(_from_where(path, memory))
            interruption = stack.enter_context(Interruption())
            watchers = [folder, progress, *observers, interruption]
            with interruption.after_an_iteration():
                result = _solve(deck, setup, folder, watchers, checkpoints, problem, memory)
        result.warnings = [*setup.warnings, *result.warnings]
        result.rows = list(folder.rows)  # with the motion of the tip
        if memory is not None:
            begun -= memory["walk"]["seconds"]["total"]
        try:
            record = write_result(setup, result, folder, begun)
            if result.status != "interrupted" and not (path / "error.log").exists():
                checkpoints.remove()
        except OSError as error:
            raise _unwritten(path, error, result) from None
    return Outcome(result, setup, path, record)


def _shape(deck: Deck) -> Any:
    return None if deck.geometry.shape is None else built_in(deck)


def identity(setup: Setup) -> dict[str, Any]:
    """What makes the problem what it is, as result.json holds it."""
    from fem_spa.output.record import material_table, to_json

    table = {
        "deck": setup.resolved,
        "mesh_hash": setup.problem.mesh.hash(),
        "materials": material_table(setup.problem, setup.sources),
    }
    return dict(json.loads(to_json(table)))


def earlier(
    folder: ResultFolder, checkpoints: Checkpoints, problem: Mapping[str, Any]
) -> tuple[dict[str, Any] | None, dict[str, Any] | None]:
    """The result.json of a run that has ended in this folder, or its last checkpoint, or neither.

    Raises
    ------
    InputError
        What is there is of another deck or mesh; the folder is in use.
    """
    if not folder.path.is_dir():
        return None, None
    folder.claim()
    memory = checkpoints.load()
    ended = _ended(folder.path) if memory is None else None
    was = ended or (memory or {}).get("problem")
    changed = difference(was, problem) if was is not None else None
    if changed is not None:
        raise InputError(
            f"given --resume: the run in {folder.path} is another one: {changed}; "
            "give what it was begun with, or leave out --resume to start anew"
        )
    return ended, memory


def _ended(path: Path) -> dict[str, Any] | None:
    """result.json of a run that came to its end there."""
    try:
        record = json.loads((path / "result.json").read_text(encoding="utf-8"))
        whole = record["status"] in ("done", "limit", "diverged") and {
            "deck",
            "mesh_hash",
            "materials",
        } <= set(record)
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return dict(record) if whole and (path / "curve.csv").is_file() else None


def _bare(record: Mapping[str, Any]) -> Result:
    """What a result.json says of a result."""
    return Result(
        status=record["status"],
        message=record.get("message", ""),
        rows=[],
        states=[],
        dofs=record.get("dofs", 0),
        elements=record.get("elements", 0),
        newton_iterations=record.get("newton_iterations", 0),
        factorizations=record.get("factorizations", 0),
        seconds=dict(record.get("seconds", {})),
    )


def _from_where(path: Path, memory: Mapping[str, Any] | None) -> str:
    """What a person reads where a run is to be resumed."""
    if memory is None:
        return f"nothing to go on with in {path}: a new run"
    rows = [row for block in memory["walk"]["rows"] for row in block]
    return f"going on after step {rows[-1]['step']}" if rows else "going on under the dead loads"


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


def _solve(
    deck: Deck,
    setup: Setup,
    folder: ResultFolder,
    observers: Sequence[Any],
    checkpoints: Checkpoints,
    problem: Mapping[str, Any],
    memory: Mapping[str, Any] | None,
) -> Result:
    """The solver's result; an interruption or a fault of the program keeps what was reached."""
    from fem_spa.solid.path import solve

    mesh_kept = deck.meshes is not None

    def keep(walk: dict[str, Any]) -> None:
        """A checkpoint, once the fields of its step are written; the mesh before the first one."""
        nonlocal mesh_kept
        if not mesh_kept:
            keep_mesh(folder.path / MESH, deck, _shape(deck), setup.problem.mesh)
            mesh_kept = True
        content = {"problem": problem, "walk": walk, "folder": folder.memory()}
        folder.beside(lambda: checkpoints.save(content))

    if memory is not None:
        folder.go_on(memory["walk"], memory["folder"])
    try:
        walk = None if memory is None else memory["walk"]
        return solve(setup.problem, setup.steps, observers, keep=keep, memory=walk)
    except KeyboardInterrupt:
        if not folder.started:
            raise
        return _partial(setup, folder, "interrupted", "interrupted by the user")
    except OSError as error:
        if not folder.started:
            raise
        why = f"the results cannot be written any further ({error.strerror or error})"
        return _partial(setup, folder, "interrupted", f"{why}; with room there, --resume goes on")
    except InputError:
        raise
    except Exception:
        if not folder.started:
            raise
        return _fault(setup, folder)


def listen() -> None:
    """Let Ctrl-C and a polite end from outside raise KeyboardInterrupt, so that what was reached stays whole.

    For jobs without iterations to wait for. A signal that the caller's shell ignores stays ignored; outside
    the main thread nothing is set.
    """
    Interruption().__enter__()


def _unwritten(path: Path, error: OSError, result: Result) -> Unfinished:
    """The line for a folder that takes no more."""
    last = f"after step {result.rows[-1].step}" if result.rows else "before its first step"
    return Unfinished(
        f"{error.filename or path} cannot be written ({error.strerror or error}); the run ended {last}, and "
        f"what was finished by then is in {path}: make room there and give --resume to go on"
    )


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
