"""The observer that keeps the result folder: what has converged is on disk, whole."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, replace
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from fem_spa.output.claim import claimed, refused
from fem_spa.output.files import sweep_parts, write_whole
from fem_spa.output.obstacle_surface import vtp
from fem_spa.output.table import (
    Columns,
    centre_line_csv,
    centre_line_lines,
    columns,
    curve_csv,
    curve_line,
    pressure_headers,
)
from fem_spa.output.vtu import pvd, vtu
from fem_spa.solid.centre_line import CentreLine
from fem_spa.solid.motion import MotionWatch
from fem_spa.solid.problem import Motion, Problem, Result, Row, State
from fem_spa.solid.walk_memory import Told, rows_and_state

WRITTEN = (
    *("curve.csv", "centre_line.csv", "result.json", "fields.pvd", "curve.png", "shape.png"),
    *("report.html", "obstacles.vtp", "error.log"),
)
MOST_PENDING = 2
"""Things that may wait to be written: a step's fields and its checkpoint."""

NOTE = "fem_spa: lengths in m, stress and pressure in Pa, Cauchy stress as xx yy zz xy yz xz"


class ResultFolder:
    """Writes curve.csv, centre_line.csv, fields.pvd and fields/*.vtu as the run goes on, the fields on a
    thread of their own.

    The folder is made, and files of an earlier run in it are removed, only when the solver has
    accepted the problem: a wrong input leaves no trace. From then on no other run may write there, until
    the folder, as a context manager, is left.

    Parameters
    ----------
    path : the folder
    clear : called when files of an earlier run are removed, for what others keep there

    Attributes
    ----------
    rows, last_state, problem, space : what has been seen; the rows with the motion of the tip
    seconds : spent in here
    """

    def __init__(self, path: Path, clear: Callable[[], None] | None = None) -> None:
        self.path = path
        self._clear = clear
        self._held = contextlib.ExitStack()
        self._claimed = False
        self._walk: Mapping[str, Any] = {}
        self._memory: Mapping[str, Any] | None = None
        self._told = Told()
        self.rows: list[Row] = []
        self.last_state: State | None = None
        self.problem: Problem | None = None
        self.space: Any = None
        self._nodal: Any = None
        self._motion, self._line = MotionWatch(), CentreLine()
        self.seconds = 0.0
        self._columns = Columns(())
        self._tables: dict[str, bytearray] = {}
        self._steps: list[tuple[float, str]] = []
        self._writer = ThreadPoolExecutor(1, thread_name_prefix="fields")
        self._pending: list[Future[None]] = []

    @property
    def started(self) -> bool:
        """Whether the folder is in use."""
        return self.problem is not None

    @property
    def cavities(self) -> tuple[str, ...]:
        """Columns of pressure, in order."""
        return self.problem.mesh.cavities if self.problem is not None else ()

    def __enter__(self) -> ResultFolder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.shutdown(wait=True)
        self._held.close()

    def claim(self) -> None:
        """Make the folder and keep other runs out of it.

        Raises
        ------
        InputError
            The folder cannot be written, or another run has it.
        """
        if self._claimed:
            return
        self._held.enter_context(claimed(self.path))
        self._claimed = True

    def go_on(self, walk: Mapping[str, Any], memory: Mapping[str, Any]) -> None:
        """Begin with the rows and the state of a walk's memory, and with the `memory` that was taken then.

        To be called before `start`, which then leaves the files of the earlier run.
        """
        self._walk, self._memory = walk, memory

    def start(self, problem: Problem, space: Any) -> None:
        """The problem is accepted: make the folder ready."""
        self.claim()
        with refused(self.path):
            (self.path / "fields").mkdir(parents=True, exist_ok=True)
            sweep_parts(self.path, WRITTEN)
            sweep_parts(self.path / "fields", ["step_*"])
            (self.path / "error.log").unlink(missing_ok=True)
            if self._memory is None:
                self._remove_earlier()
        self.problem, self.space = problem, space
        self._motion.start(problem, space)
        self._line.start(problem, space)
        with refused(self.path):
            if problem.obstacles:
                write_whole(self.path / "obstacles.vtp", vtp(problem.obstacles, space.points))
            if self._memory is not None:
                self._recall(self._memory)
            self._begin_tables()
            self._write_tables()
            self._write_list_of_fields()

    def _remove_earlier(self) -> None:
        """The files of an earlier run: first those that say how it ended."""
        for name in ("result.json", *WRITTEN):
            (self.path / name).unlink(missing_ok=True)
        if self._clear is not None:
            self._clear()
        for old in (self.path / "fields").glob("step_*.vtu"):
            old.unlink(missing_ok=True)

    def memory(self) -> dict[str, Any]:
        """What the rows to come depend on, besides their states."""
        return {"told": self._told.memory(), "motion": self._motion.memory()}

    def _recall(self, memory: Mapping[str, Any]) -> None:
        """Rows, lines and list of fields as they were; what was written of later steps is removed."""
        self._told.recall(memory["told"])
        told = list(self._told)
        assert self.problem is not None
        rows, self.last_state = rows_and_state(self._walk, self.problem, self.space)
        self.rows = [
            replace(row, motion=Motion(**motion)) for row, (motion, _) in zip(rows, told, strict=True)
        ]
        self._motion.recall([Motion(**motion) for motion, _ in told], memory["motion"])
        self._line.lines = [np.array(line) for _, line in told]
        names = [f"fields/step_{row.step:04d}.vtu" for row in self.rows]
        self._steps = [
            (float(row.step), name)
            for row, name in zip(self.rows, names, strict=True)
            if (self.path / name).is_file()
        ]
        for later in (self.path / "fields").glob("step_*.vtu"):
            if f"fields/{later.name}" not in names:
                later.unlink(missing_ok=True)

    def iteration(self, step: int, pressure: dict[str, float], iteration: int, residual: float) -> None:
        """Nothing is kept of single iterations."""

    def converged(self, state: State, row: Row, fraction: float = 0.0) -> None:
        """Write the curve now; the fields of this step beside the next one's solution."""
        begun = time.perf_counter()
        self._motion.converged(state, row)
        self._line.converged(state, row)
        motion = self._motion.motions[-1]
        self.rows.append(replace(row, motion=motion))
        self._told.append([asdict(motion), self._line.lines[-1].tolist()])
        self.last_state = state
        self._grow_tables(self.rows[-1])
        self._write_tables()
        self.beside(lambda: self._write_fields(state, row))
        self.seconds += time.perf_counter() - begun

    def beside(self, write: Callable[[], None]) -> None:
        """Let the writing thread do this once it has done what it was given before.

        Raises
        ------
        Exception
            as something that was given before did
        """
        while len(self._pending) >= MOST_PENDING or (self._pending and self._pending[0].done()):
            self._pending.pop(0).result()
        self._pending.append(self._writer.submit(write))

    def finished(self, result: Result) -> None:
        """Wait until the last fields are on disk."""
        begun = time.perf_counter()
        while self._pending:
            self._pending.pop(0).result()
        self.seconds += time.perf_counter() - begun

    def _begin_tables(self) -> None:
        """The tables with the rows that there are."""
        assert self.problem is not None
        self._columns = columns(self.problem)
        texts = {"curve.csv": curve_csv(self.rows, self._columns)}
        if len(self._line.arc):
            lines = self._line.lines
            texts["centre_line.csv"] = centre_line_csv(self.rows, self._line.arc, lines, self._columns)
        self._tables = {name: bytearray(text.encode()) for name, text in texts.items()}

    def _grow_tables(self, row: Row) -> None:
        """One row more, so that no number is put into words twice."""
        self._tables["curve.csv"] += curve_line(row, self._columns).encode()
        if "centre_line.csv" in self._tables:
            text = centre_line_lines(row, self._line.arc, self._line.lines[-1], self._columns)
            self._tables["centre_line.csv"] += text.encode()

    def _write_tables(self) -> None:
        for name, content in self._tables.items():
            write_whole(self.path / name, content)

    def _write_list_of_fields(self) -> None:
        write_whole(self.path / "fields.pvd", pvd(self._steps))

    def _write_fields(self, state: State, row: Row) -> None:
        """The fields of a step, then the list that names them."""
        name = f"fields/step_{row.step:04d}.vtu"
        write_whole(self.path / name, self._fields(state, row))
        self._steps.append((float(row.step), name))
        self._write_list_of_fields()

    def _fields(self, state: State, row: Row) -> bytes:
        from fem_spa.solid.fields import NodalFields

        assert self.problem is not None
        if self._nodal is None:
            self._nodal = NodalFields(self.space, self.problem.materials)
        fields = self._nodal(state)
        small = {name: np.asarray(values, dtype=np.float32) for name, values in fields.items()}
        small["displacement"] = np.asarray(fields["displacement"], dtype=np.float64)
        names = pressure_headers(self.cavities)
        numbers = {name: row.pressure[c] / 1e3 for name, c in zip(names, self.cavities, strict=True)}
        numbers |= {
            "TimeValue": float(row.step),
            "angle [deg]": math.degrees(row.angle),
            "volume [mm^3]": row.volume * 1e9,
        }
        regions = ", ".join(f"{i} {name}" for i, name in enumerate(self.space.region_names))
        return vtu(
            self.space.points,
            self.space.tets,
            small,
            {"region": np.asarray(self.space.region, dtype=np.int32)},
            numbers,
            f"{NOTE}; regions {regions}",
        )
