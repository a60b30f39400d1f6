"""Measured records: CSV with units in the header and `# key: value` metadata above it. SI inside."""

from __future__ import annotations

import datetime
import hashlib
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fem_spa.errors import InputError
from fem_spa.reduced.checks import refuse_gap
from fem_spa.units import quantity
from materials.bounded import MOST_ROWS, read_bytes

OUTPUTS = {"angle": "rad", "displacement": "m", "force": "N", "x": "m", "y": "m", "z": "m"}
"""Names that an output column may have, and the SI unit inside."""

HISTORIES = ("virgin", "cycled", "unknown")
_CELL = re.compile(r"\s*([^\[\]]+?)\s*(?:\[([^\[\]]*)\])?\s*")
_PRESSURE = re.compile(r"(measured )?pressure(?: (\d+))?")


class NoTime(InputError):
    """The record has no usable time column, so nothing that moves can be told from it."""


@dataclass(frozen=True)
class Record:
    """One measured run.

    Attributes
    ----------
    path, name : the file, and its name without `.csv`
    time : (n,) s, increasing
    pressures : (n, m) Pa gauge, commanded
    measured : (n, m) Pa gauge at the actuator, or None where it was not logged
    temperature : (n,) K, or None
    outputs : name -> (n,) in SI (rad, m, N), NaN where a sample is missing
    units : output name -> unit as written in the file
    orientation : rad between rest axis and gravity (0 hangs down), None where not stated
    payload : kg, None where not stated
    history : `virgin`, `cycled` or `unknown`
    session, trial, specimen : as written, None where not stated
    start : s since 1970, None where not stated
    sha256 : of the file
    backward : samples that were left out because their time does not increase
    notes : what the reader saw and a person should know
    """

    path: Path
    name: str
    time: np.ndarray
    pressures: np.ndarray
    measured: np.ndarray | None
    temperature: np.ndarray | None
    outputs: dict[str, np.ndarray]
    units: dict[str, str]
    orientation: float | None = None
    payload: float | None = None
    history: str = "unknown"
    session: str | None = None
    trial: str | None = None
    specimen: str | None = None
    start: float | None = None
    sha256: str = ""
    backward: int = 0
    notes: tuple[str, ...] = ()
    metadata: dict[str, str] = field(default_factory=dict)

    @property
    def duration(self) -> float:
        """s from the first to the last sample."""
        return float(self.time[-1] - self.time[0])


def read_records(paths: Sequence[Path | str]) -> list[Record]:
    """All records of one call, ordered by `start` where every one states it, else as given; names unique.

    Raises
    ------
    InputError
        for a file that cannot be read, is given twice, or does not fit the others (chambers, outputs)
    """
    seen: set[Path] = set()
    records: list[Record] = []
    for path in map(Path, paths):
        if path.resolve() in seen:
            raise InputError(f"record {path} is given twice; give each once")
        seen.add(path.resolve())
        records.append(read_record(path))
    for record in records[1:]:
        first = records[0]
        if record.pressures.shape[1] != first.pressures.shape[1]:
            raise InputError(
                f"{record.path} has {record.pressures.shape[1]} pressures, {first.path} has "
                f"{first.pressures.shape[1]}; records of one call are of one actuator"
            )
        if set(record.outputs) != set(first.outputs):
            raise InputError(
                f"{record.path} has the outputs {', '.join(record.outputs)}, {first.path} has "
                f"{', '.join(first.outputs)}; records of one call have the same columns"
            )
    if all(record.start is not None for record in records):
        records.sort(key=lambda record: record.start or 0.0)
    return _with_own_names(records)


def _with_own_names(records: list[Record]) -> list[Record]:
    """Two files of one name in two folders: the second becomes `name-2`."""
    from dataclasses import replace

    taken: dict[str, int] = {}
    out = []
    for record in records:
        count = taken[record.name] = taken.get(record.name, 0) + 1
        out.append(record if count == 1 else replace(record, name=f"{record.name}-{count}"))
    return out


def read_record(path: Path | str) -> Record:
    """Read one record.

    Raises
    ------
    NoTime
        where there is no time column, or its values do not increase
    InputError
        for anything else that is missing, has no unit or the wrong one, or is not a number
    """
    path = Path(path)
    try:
        content = read_bytes(path, MOST_ROWS)
    except OSError as error:
        raise InputError(f"record {path} cannot be read: {error.strerror}; check the name") from None
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"record {path} is not text; a CSV file in UTF-8 is needed") from None
    metadata, header, lines = _split(path, text)
    table = _numbers(path, lines, len(header))
    notes: list[str] = []
    columns, units = _columns(path, header, table, notes)
    time = columns.pop("time", None)
    outputs = {name: columns.pop(name) for name in OUTPUTS if name in columns}
    if not outputs:
        raise InputError(
            f"record {path} has no output column; needed is one of "
            f"{', '.join(f'{name} [{_habit(unit)}]' for name, unit in OUTPUTS.items())}"
        )
    commanded = _stack(path, columns, "pressure")
    if commanded is None:
        raise InputError(f"record {path} has no pressure; a column 'pressure [kPa]' is needed")
    measured = _stack(path, columns, "measured pressure")
    if measured is not None and measured.shape != commanded.shape:
        raise InputError(f"record {path}: each commanded pressure needs its measured one, or none has it")
    if time is None:
        raise NoTime(f"record {path} has no time; a column 'time [s]' is needed")
    keep, backward = _usable(path, time, commanded, notes)
    temperature = columns.get("temperature")
    if temperature is not None and not np.isfinite(temperature[keep]).any():
        temperature = None
    for name, values in outputs.items():
        missing = int(np.sum(~np.isfinite(values[keep])))
        if missing:
            notes.append(f"{missing} samples of {name} are missing")
    return Record(
        path=path,
        name=path.name[:-4] if path.name.lower().endswith(".csv") else path.name,
        time=time[keep],
        pressures=commanded[keep],
        measured=None if measured is None else _filled(time[keep], measured[keep]),
        temperature=None if temperature is None else _filled(time[keep], temperature[keep, None])[:, 0],
        outputs={name: values[keep] for name, values in outputs.items()},
        units=units,
        sha256=hashlib.sha256(content).hexdigest(),
        backward=backward,
        notes=tuple(notes),
        metadata=metadata,
        **_facts(path, metadata),  # type: ignore[arg-type]
    )


def _split(path: Path, text: str) -> tuple[dict[str, str], list[str], list[str]]:
    """Metadata, header cells, data lines."""
    metadata: dict[str, str] = {}
    rows = [line.strip() for line in text.splitlines()]
    at = 0
    while at < len(rows) and (not rows[at] or rows[at].startswith("#")):
        key, colon, value = rows[at].lstrip("#").partition(":")
        if colon and rows[at].startswith("#"):
            metadata[key.strip().lower()] = value.strip()
        at += 1
    if at >= len(rows):
        raise InputError(f"record {path} is empty; a header line and samples are needed")
    header = rows[at].split(_comma(rows[at]))
    return metadata, [cell.strip().strip('"') for cell in header], [row for row in rows[at + 1 :] if row]


def _comma(header: str) -> str:
    return next((mark for mark in (",", ";", "\t") if mark in header), ",")


def _numbers(path: Path, lines: list[str], width: int) -> np.ndarray:
    """(n, width) numbers; an empty cell or `nan` is NaN."""
    if not lines:
        raise InputError(f"record {path} has a header and no samples")
    mark = _comma(lines[0])
    out = np.full((len(lines), width), math.nan)
    for i, line in enumerate(lines):
        cells = line.split(mark)
        if len(cells) != width:
            raise InputError(
                f"record {path}, sample {i + 1}: {len(cells)} cells under a header of {width}; "
                "every line needs one a column"
            )
        try:
            out[i] = [float(cell) if cell.strip() else math.nan for cell in cells]
        except ValueError:
            raise InputError(
                f"record {path}, sample {i + 1}: '{line[:40]}' holds what is no number"
            ) from None
    return out


def _columns(
    path: Path, header: list[str], table: np.ndarray, notes: list[str]
) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Known columns by name in SI, and the units of the outputs as written."""
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    for i, cell in enumerate(header):
        match = _CELL.fullmatch(cell)
        name = " ".join((match[1] if match else cell).split()).lower()
        unit = (match[2] if match else None) or None
        si = "s" if name == "time" else "Pa" if _PRESSURE.fullmatch(name) else OUTPUTS.get(name)
        if name != "temperature" and si is None:
            notes.append(f"column '{cell}' is not known and is not used")
            continue
        if name in columns:
            raise InputError(f"record {path} has the column '{name}' twice")
        if unit is None:
            raise InputError(
                f"record {path}: column '{cell}' has no unit; write it in brackets, for example "
                f"'{name} [{_habit(si or 'K')}]'"
            )
        if si is None:
            columns[name] = _kelvin(path, table[:, i], unit)
            continue
        columns[name] = table[:, i] * quantity(f"1 {unit}", si, f"{path.name}, column '{cell}'")
        if name in OUTPUTS:
            units[name] = unit.strip()
    return columns, units


def _habit(unit: str) -> str:
    """The unit that people write for an SI unit."""
    return {"rad": "deg", "m": "mm", "Pa": "kPa", "K": "degC"}.get(unit, unit)


def _kelvin(path: Path, values: np.ndarray, unit: str) -> np.ndarray:
    word = unit.strip().lower().replace("°", "deg")
    if word in ("degc", "celsius", "c"):
        return np.asarray(values + 273.15)
    if word in ("k", "kelvin"):
        return values
    if word in ("degf", "fahrenheit"):
        return np.asarray((values + 459.67) / 1.8)
    raise InputError(f"record {path}: '{unit}' for temperature; degC, K or degF is needed")


def _stack(path: Path, columns: dict[str, np.ndarray], word: str) -> np.ndarray | None:
    """(n, m) of `word`, or `word 1`, `word 2`, ... in order."""
    if word in columns:
        if f"{word} 1" in columns:
            raise InputError(f"record {path} has both '{word}' and '{word} 1'; number all of them or none")
        return columns[word][:, None]
    numbers = sorted(int(name.rpartition(" ")[2]) for name in columns if re.fullmatch(rf"{word} \d+", name))
    if not numbers:
        return None
    if numbers != list(range(1, len(numbers) + 1)):
        raise InputError(f"record {path} numbers its '{word}' {numbers}; 1, 2, ... without gaps is needed")
    return np.stack([columns[f"{word} {k}"] for k in numbers], axis=1)


def refuse_broken(record: Record) -> None:
    """InputError for a record whose times go back or that lacks rows: models are not to guess there."""
    if record.backward:
        raise InputError(
            f"record {record.path}: {record.backward} times do not increase; sort the rows or cut the "
            "record there"
        )
    try:
        refuse_gap(record.time)
    except InputError as error:
        raise InputError(f"record {record.path}: {error}") from None


def _usable(path: Path, time: np.ndarray, pressure: np.ndarray, notes: list[str]) -> tuple[np.ndarray, int]:
    """Indices of samples with time and pressure, times increasing; how many times do not."""
    good = np.isfinite(time) & np.isfinite(pressure).all(axis=1)
    dropped = int(np.sum(~good))
    if dropped:
        notes.append(f"{dropped} samples without time or pressure are left out")
    if not good.any():
        raise NoTime(f"record {path} has no sample with both time and pressure")
    index = np.nonzero(good)[0]
    forward = np.concatenate([[True], time[index][1:] > np.maximum.accumulate(time[index])[:-1]])
    back = int(np.sum(~forward))
    if back > 0.2 * len(index):
        raise NoTime(
            f"record {path}: its times do not increase ({back} of {len(index)} stand still or go back)"
        )
    if back:
        notes.append(f"{back} samples whose time does not increase are left out")
    return np.asarray(index[forward]), back


def _filled(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(n, m) with missing samples put on the line between their neighbours."""
    out = values.copy()
    for column in out.T:
        good = np.isfinite(column)
        if good.any() and not good.all():
            column[~good] = np.interp(time[~good], time[good], column[good])
    return out


def _facts(path: Path, metadata: dict[str, str]) -> dict[str, object]:
    """Metadata that the program understands."""
    facts: dict[str, object] = {}
    if metadata.get("orientation"):
        facts["orientation"] = quantity(
            metadata["orientation"], "rad", f"{path.name}, orientation", zero=True
        )
    if metadata.get("payload"):
        facts["payload"] = quantity(metadata["payload"], "kg", f"{path.name}, payload", low=0.0, zero=True)
    if metadata.get("history"):
        word = metadata["history"].lower()
        if word not in HISTORIES:
            raise InputError(f"{path.name}: history '{word}'; {', '.join(HISTORIES)} are allowed")
        facts["history"] = word
    for key in ("session", "trial", "specimen"):
        if metadata.get(key):
            facts[key] = metadata[key]
    if metadata.get("start"):
        facts["start"] = _instant(path, metadata["start"])
    return facts


def _instant(path: Path, text: str) -> float:
    """s since 1970 of an ISO time; one without a zone is taken as UTC, for only differences matter."""
    try:
        moment = datetime.datetime.fromisoformat(text.strip())
    except ValueError:
        raise InputError(
            f"{path.name}: start '{text}'; an ISO time is needed, for example 2026-03-01T10:20:00"
        ) from None
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=datetime.UTC)
    return moment.timestamp()
