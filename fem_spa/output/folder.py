"""The observer that keeps the result folder: what has converged is on disk, whole."""

from __future__ import annotations

import math
import time
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.errors import InputError
from fem_spa.output.files import write_whole
from fem_spa.output.obstacle_surface import vtp
from fem_spa.output.table import Columns, centre_line_csv, columns, curve_csv, pressure_headers
from fem_spa.output.vtu import pvd, vtu
from fem_spa.solid.centre_line import CentreLine
from fem_spa.solid.motion import MotionWatch
from fem_spa.solid.problem import Problem, Result, Row, State

WRITTEN = (
    *("curve.csv", "centre_line.csv", "result.json", "fields.pvd", "curve.png", "shape.png"),
    *("report.html", "obstacles.vtp", "error.log"),
)
MOST_PENDING = 2
"""Steps whose fields may wait to be written."""

NOTE = "fem_spa: lengths in m, stress and pressure in Pa, Cauchy stress as xx yy zz xy yz xz"


class ResultFolder:
    """Writes curve.csv, centre_line.csv, fields.pvd and fields/*.vtu as the run goes on, the fields on a
    thread of their own.

    The folder is made, and files of an earlier run in it are removed, only when the solver has
    accepted the problem: a wrong input leaves no trace.

    Attributes
    ----------
    rows, last_state, problem, space : what has been seen; the rows with the motion of the tip
    seconds : spent in here
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows: list[Row] = []
        self.last_state: State | None = None
        self.problem: Problem | None = None
        self.space: Any = None
        self._nodal: Any = None
        self._motion, self._line = MotionWatch(), CentreLine()
        self.seconds = 0.0
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

    def start(self, problem: Problem, space: Any) -> None:
        """The problem is accepted: make the folder ready."""
        try:
            (self.path / "fields").mkdir(parents=True, exist_ok=True)
            for name in WRITTEN:
                (self.path / name).unlink(missing_ok=True)
            for old in (self.path / "fields").glob("step_*.vtu"):
                old.unlink()
            write_whole(self.path / "curve.csv", "")
        except OSError as error:
            raise InputError(
                f"given {self.path} for --out: it cannot be written ({error.strerror}); give another folder"
            ) from None
        self.problem, self.space = problem, space
        if problem.obstacles:
            write_whole(self.path / "obstacles.vtp", vtp(problem.obstacles, space.points))
        self._motion.start(problem, space)
        self._line.start(problem, space)
        self._write_curve()
        self._write_list_of_fields()

    def iteration(self, step: int, pressure: dict[str, float], iteration: int, residual: float) -> None:
        """Nothing is kept of single iterations."""

    def converged(self, state: State, row: Row, fraction: float = 0.0) -> None:
        """Write the curve now; the fields of this step beside the next one's solution."""
        begun = time.perf_counter()
        self._motion.converged(state, row)
        self._line.converged(state, row)
        self.rows.append(replace(row, motion=self._motion.motions[-1]))
        self.last_state = state
        self._write_curve()
        while len(self._pending) >= MOST_PENDING:
            self._pending.pop(0).result()
        self._pending.append(self._writer.submit(self._write_fields, state, row))
        self.seconds += time.perf_counter() - begun

    def finished(self, result: Result) -> None:
        """Wait until the last fields are on disk."""
        begun = time.perf_counter()
        while self._pending:
            self._pending.pop(0).result()
        self.seconds += time.perf_counter() - begun

    def _write_curve(self) -> None:
        write_whole(self.path / "curve.csv", curve_csv(self.rows, self._columns))
        if len(self._line.arc):
            text = centre_line_csv(self.rows, self._line.arc, self._line.lines, self._columns)
            write_whole(self.path / "centre_line.csv", text)

    @property
    def _columns(self) -> Columns:
        assert self.problem is not None
        return columns(self.problem)

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
