"""Records on uniform grids, one after another in session order: what every later step works on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem_spa.errors import InputError
from fem_spa.loop.records import Record

LONG_REST = 1e7
"""s: the gap before a record whose start is not known."""


@dataclass(frozen=True)
class Run:
    """One record's place in the long arrays.

    Attributes
    ----------
    name : of the record
    part : its rows
    step : s between rows
    gap : s of zero pressure before it
    train : whether it may be fitted
    """

    name: str
    part: slice
    step: float
    gap: float
    train: bool


@dataclass(frozen=True)
class Data:
    """All records, rows in session order.

    Attributes
    ----------
    runs : one a record
    clock : (n,) s on one clock; a rest of unknown length counts as none
    pressure : (n, m) Pa commanded
    measured : (n, m) Pa or None
    temperature : (n,) K or None
    output : (n, d) SI; missing samples filled by their neighbours
    known : (n,) whether the sample was measured
    orientation : (n,) rad;  oriented : whether any record states it
    payload : (n,) kg;  weighed : whether any record states it
    fresh : 1 if the first record is the first loading ever, 0 if softened before, None if unknown
    p_max : largest absolute pressure of the training records, Pa
    grain : SI, white noise that the outputs have at least, whatever they look like
    """

    runs: tuple[Run, ...]
    clock: np.ndarray
    pressure: np.ndarray
    measured: np.ndarray | None
    temperature: np.ndarray | None
    output: np.ndarray
    known: np.ndarray
    orientation: np.ndarray
    oriented: bool
    payload: np.ndarray
    weighed: bool
    fresh: float | None
    p_max: float
    grain: float = 0.0

    @property
    def train(self) -> np.ndarray:
        """(n,) whether a row may be fitted."""
        mask = np.zeros(len(self.clock), bool)
        for run in self.runs:
            mask[run.part] = run.train
        return mask

    @cached_property
    def step(self) -> float | None:
        """s between rows, where it is the same in all records."""
        steps = {run.step for run in self.runs}
        low, high = min(steps), max(steps)
        return low if high - low < 1e-9 * high else None

    @cached_property
    def table(self) -> np.ndarray:
        """(runs, longest) rows of each record; a shorter one goes on with its last row."""
        longest = max(run.part.stop - run.part.start for run in self.runs)
        return np.stack(
            [np.minimum(run.part.start + np.arange(longest), run.part.stop - 1) for run in self.runs]
        )

    @cached_property
    def place(self) -> tuple[np.ndarray, np.ndarray]:
        """(n,), (n,) record and place in it of each row: where a row stands in `table`."""
        record = np.concatenate([np.full(r.part.stop - r.part.start, i) for i, r in enumerate(self.runs)])
        inside = np.concatenate([np.arange(r.part.stop - r.part.start) for r in self.runs])
        return record, inside

    @property
    def longest(self) -> float:
        """s: duration of the longest training record."""
        return max((r.part.stop - r.part.start) * r.step for r in self.runs if r.train)


def build(records: Sequence[Record], train: Sequence[bool], names: Sequence[str], rows: int) -> Data:
    """Put records on uniform grids of at most about `rows` rows together, by means over whole blocks.

    Parameters
    ----------
    records : in session order
    train : which may be fitted
    names : outputs, in the order of the model
    rows : most rows that the work can afford
    """
    total = sum(max(round(r.duration / _step(r)), 1) for r in records)
    block = max(1, math.ceil(total / rows))
    runs: list[Run] = []
    parts: dict[str, list[np.ndarray]] = {k: [] for k in ("clock", "p", "pm", "T", "y", "known", "phi", "m")}
    at, now, last_end = 0, 0.0, None
    for record, fit in zip(records, train, strict=True):
        grid, step = _grid(record, block)
        gap, elapsed = _gap(record, last_end)
        now += elapsed
        n = len(grid) // block
        runs.append(Run(record.name, slice(at, at + n), step * block, gap, fit))
        parts["clock"].append(now + _blocks(grid - grid[0], block))
        parts["p"].append(_blocks(_on(grid, record.time, record.pressures), block))
        if record.measured is not None:
            parts["pm"].append(_blocks(_on(grid, record.time, record.measured), block))
        if record.temperature is not None:
            parts["T"].append(_blocks(np.interp(grid, record.time, record.temperature), block))
        values, known = _outputs(record, names, grid)
        parts["y"].append(_blocks(values, block))
        parts["known"].append(_blocks(known.astype(float), block) > 0.99)
        parts["phi"].append(np.full(n, record.orientation or 0.0))
        parts["m"].append(np.full(n, record.payload or 0.0))
        now += record.duration
        last_end = None if record.start is None else record.start + record.duration
        at += n
    joined = {key: np.concatenate(value) if value else None for key, value in parts.items()}
    rows_train = np.concatenate([np.full(r.part.stop - r.part.start, r.train) for r in runs])
    pressure = joined["p"]
    assert pressure is not None
    first = records[0].history
    return Data(
        runs=tuple(runs),
        clock=joined["clock"],  # type: ignore[arg-type]
        pressure=pressure,
        measured=joined["pm"] if len(parts["pm"]) == len(records) else None,
        temperature=joined["T"] if len(parts["T"]) == len(records) else None,
        output=joined["y"],  # type: ignore[arg-type]
        known=joined["known"],  # type: ignore[arg-type]
        orientation=joined["phi"],  # type: ignore[arg-type]
        oriented=any(r.orientation is not None for r in records),
        payload=joined["m"],  # type: ignore[arg-type]
        weighed=any(r.payload is not None for r in records),
        fresh={"virgin": 1.0, "cycled": 0.0}.get(first),
        p_max=float(np.max(np.abs(pressure[rows_train]))) or 1.0,
    )


def _step(record: Record) -> float:
    """Sampling time, s."""
    return float(np.median(np.diff(record.time)))


def _grid(record: Record, block: int) -> tuple[np.ndarray, float]:
    step = _step(record)
    n = max(round(record.duration / step) + 1, block)
    n -= n % block
    return record.time[0] + step * np.arange(n), step


def _gap(record: Record, last_end: float | None) -> tuple[float, float]:
    """(gap for what relaxes, gap for what is counted on the clock), s."""
    if record.start is None or last_end is None:
        return LONG_REST, 0.0
    gap = max(record.start - last_end, 0.0)
    return gap, gap


def _on(grid: np.ndarray, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.stack([np.interp(grid, time, column) for column in values.T], axis=1)


def _blocks(values: np.ndarray, block: int) -> np.ndarray:
    """Means over blocks of rows."""
    if block == 1:
        return values
    n = len(values) // block
    return np.asarray(values[: n * block].reshape(n, block, *values.shape[1:]).mean(axis=1))


def _outputs(record: Record, names: Sequence[str], grid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, d) outputs on the grid, and where all were measured and stand in line with their neighbours."""
    columns, known = [], np.ones(len(grid), bool)
    for name in names:
        values = record.outputs[name]
        good = np.isfinite(values)
        good[good] &= ~spikes(values[good])
        if not good.any():
            raise InputError(
                f"record {record.path}: no sample of {name} is a number; give one with measurements"
            )
        columns.append(np.interp(grid, record.time[good], values[good]))
        if not good.all():
            known &= np.interp(grid, record.time, good.astype(float)) > 0.99
    return np.stack(columns, axis=1), known


def spikes(values: np.ndarray) -> np.ndarray:
    """(n,) True where one or two samples stand far off both neighbours: an outlier, not a step."""
    n = len(values)
    out = np.zeros(n, bool)
    if n < 8:
        return out
    jump = np.diff(values)
    typical = 1.4826 * float(np.median(np.abs(jump - np.median(jump)))) + 1e-12 * float(np.ptp(values))
    limit = max(8.0 * typical, 0.03 * float(np.ptp(np.percentile(values, [1, 99]))))
    for width in (1, 2):
        left = values[width:-width] - values[: -2 * width]
        right = values[width:-width] - values[2 * width :]
        off = (np.minimum(left, right) > limit) | (np.maximum(left, right) < -limit)
        out[width:-width] |= off
    return out
