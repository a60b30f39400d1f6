"""What a calibration is held against: records over time, and static curves such as `solve` leaves.

A file with a column `time` is a record (fem_spa/loop/records.py). One without is a static curve: every row an
equilibrium, columns as in curve.csv (`pressure [kPa]` or one a cavity, `angle [deg]`, `tip x [mm]`, ...).
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fem_spa.errors import InputError
from fem_spa.loop.records import NoTime, Record, read_record, refuse_broken
from fem_spa.reduced.model import Drive
from fem_spa.reduced.tables import factor, same_kind

UNITS = {"angle": "deg", "displacement": "mm", "force": "N", "x": "mm", "y": "mm", "z": "mm"}
"""Outputs, and the unit shown where the file does not say another."""
_SECONDS_A_ROW = 10.0
_MEASURED = "the measured pressure is used, not the commanded one"


@dataclass(frozen=True)
class Run:
    """One record or curve.

    Attributes
    ----------
    name, path : of the file;  sha256 : of its content
    drive : pressures (n, chambers) Pa over time; the rows of a static curve are ten seconds apart
    chambers : names of the pressures, "" where there is one without a name
    outputs : name -> (n,) SI, NaN where a sample is missing
    static : whether every row is an equilibrium
    use : (n,) bool, rows that count (hold-out within one file clears some)
    record : as read, of a record over time
    """

    name: str
    path: Path
    drive: Drive
    chambers: tuple[str, ...]
    outputs: dict[str, np.ndarray]
    static: bool
    use: np.ndarray
    sha256: str = ""
    notes: tuple[str, ...] = ()
    record: Record | None = None

    def only(self, use: np.ndarray) -> Run:
        """The same run with other rows that count."""
        return replace(self, use=use & self.use)


def read_runs(paths: Sequence[Path | str]) -> list[Run]:
    """All records and curves of one call, in the order of their `start`, else as given.

    Raises
    ------
    InputError
        for a file that cannot be read, is given twice, or has other chambers or outputs than the first
    """
    runs: list[Run] = []
    starts: list[float | None] = []
    for path in map(Path, paths):
        if any(path.resolve() == run.path.resolve() for run in runs):
            raise InputError(f"record {path} is given twice; give each once")
        run, start = _read(path)
        if runs and run.drive.pressure.shape[1] != runs[0].drive.pressure.shape[1]:
            raise InputError(
                f"{path} has {run.drive.pressure.shape[1]} pressures, {runs[0].path} has "
                f"{runs[0].drive.pressure.shape[1]}; files of one call are of one actuator"
            )
        if runs and not set(run.outputs) & set(runs[0].outputs):
            raise InputError(
                f"{path} has the outputs {', '.join(run.outputs)}, {runs[0].path} has "
                f"{', '.join(runs[0].outputs)}; files of one call have the same columns"
            )
        runs.append(run)
        starts.append(start)
    if all(start is not None for start in starts):
        order = sorted(range(len(runs)), key=lambda i: starts[i] or 0.0)
        return [runs[i] for i in order]
    return runs


def _read(path: Path) -> tuple[Run, float | None]:
    try:
        record = read_record(path)
    except NoTime:
        if _has_time(path):
            raise
    except InputError:
        if _has_time(path) or not path.is_file():
            raise
    else:
        return _of_record(record), record.start
    return _of_curve(path), None


def _has_time(path: Path) -> bool:
    """Whether the header of a readable CSV names a time."""
    from fem_spa.reduced.curve import read_columns

    try:
        cells = read_columns(path)[0]
    except InputError:
        return True
    return any(cell.strip().strip('"').lower().startswith("time") for cell in cells)


def _of_record(record: Record) -> Run:
    refuse_broken(record)
    pressure = record.pressures if record.measured is None else record.measured
    drive = Drive(
        record.time,
        pressure,
        record.orientation or 0.0,
        record.payload or 0.0,
        record.temperature,
    )
    count = pressure.shape[1]
    names = ("",) if count == 1 else tuple(str(k + 1) for k in range(count))
    notes = record.notes
    if record.measured is not None:
        notes = (*notes, _MEASURED)
    use = np.any([np.isfinite(v) for v in record.outputs.values()], axis=0)
    return Run(
        record.name, record.path, drive, names, record.outputs, False, use, record.sha256, notes, record
    )


def commanded(run: Run) -> Run:
    """The same run under its commanded pressure, measured or not; a static curve as it is."""
    if run.record is None:
        return run
    drive = replace(run.drive, pressure=run.record.pressures)
    return replace(run, drive=drive, notes=tuple(note for note in run.notes if note != _MEASURED))


def _of_curve(path: Path) -> Run:
    from fem_spa.reduced.curve import _CELL, read_columns

    cells, table = read_columns(path)
    pressures: dict[str, np.ndarray] = {}
    outputs: dict[str, np.ndarray] = {}
    for j, cell in enumerate(cells):
        match = _CELL.fullmatch(cell)
        word, unit = (match[1].lower(), match[2] or "") if match else (cell.lower(), "")
        if word == "pressure" or word.startswith("pressure "):
            pressures[word[9:]] = _si(table[:, j], unit, "kPa", cell, path)
        name = word.removeprefix("tip ")
        if name in UNITS and name not in outputs:
            outputs[name] = _si(table[:, j], unit, UNITS[name], cell, path)
    if not pressures or not outputs:
        what = "a pressure, 'pressure [kPa]'," if not pressures else "an output such as 'angle [deg]'"
        raise InputError(f"record {path} has no time, and for a static curve it lacks {what}; add the column")
    if "displacement" not in outputs and {"x", "y", "z"} <= set(outputs):
        outputs["displacement"] = tip_way(np.column_stack([outputs[axis] for axis in "xyz"]))
    names = tuple(sorted(pressures))
    pressure = np.column_stack([pressures[name] for name in names])
    use = np.isfinite(pressure).all(axis=1)
    if use.sum() < 3:
        raise InputError(f"record {path} has {use.sum()} rows with a pressure; a curve needs three at least")
    time = _SECONDS_A_ROW * np.arange(int(use.sum()), dtype=float)
    outputs = {name: values[use] for name, values in outputs.items()}
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    name = path.stem if path.stem != "curve" or not path.parent.name else path.parent.name
    every = np.ones(len(time), dtype=bool)
    return Run(name, path, Drive(time, pressure[use]), names, outputs, True, every, digest)


def _si(values: np.ndarray, unit: str, expected: str, cell: str, path: Path) -> np.ndarray:
    if not unit or not same_kind(unit, expected):
        raise InputError(
            f"record {path}, column '{cell}': a unit like {expected} is needed, in brackets: [{expected}]"
        )
    return values * factor(unit)


def tip_way(tip: np.ndarray) -> np.ndarray:
    """(n,) m, how far a tip (n, 3) has gone along the direction from its first place to its farthest."""
    moved = tip - tip[0]
    far = moved[int(np.argmax(np.linalg.norm(np.nan_to_num(moved), axis=1)))]
    length = float(np.linalg.norm(far))
    return moved @ (far / length) if length > 0 else moved[:, 0]
