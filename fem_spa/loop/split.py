"""Which records are held out: whole ones, chosen by what was asked of the actuator, never by what it
answered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fem_spa.errors import InputError
from fem_spa.loop.records import Record


@dataclass(frozen=True)
class Split:
    """Records in session order, and which may be fitted.

    Attributes
    ----------
    extrapolating : name of the held-out record that goes furthest beyond the others, None if given by
    the user
    provisional : whether all is fitted to one record, of which the last third may be held out
    """

    records: tuple[Record, ...]
    train: tuple[bool, ...]
    extrapolating: str | None
    provisional: bool


def split(records: Sequence[Record], holdout: Sequence[Path], seed: int) -> Split:
    """Hold out the named records, or a third of them, or the last third of a single one.

    What one record alone shows, the actuator turned or with a weight, is kept to fit: no other could tell it.

    Raises
    ------
    InputError
        where every record would be held out
    """
    if holdout:
        wanted = {path.resolve() for path in holdout}
        train = tuple(r.path.resolve() not in wanted for r in records)
        if not any(train):
            raise InputError("given every record for --holdout; at least one is needed to fit")
        return Split(tuple(records), train, None, sum(train) == 1)
    if len(records) == 1:
        return _cut(records[0])
    count = max(1, round(len(records) / 3))
    free = [i for i in range(len(records)) if not _alone(records, i, set())] or list(range(len(records)))
    reach = _reach(records)
    furthest = max(free, key=lambda i: reach[i])
    rng = np.random.default_rng(seed)
    chosen = {furthest}
    for i in (int(k) for k in rng.permutation([k for k in free if k != furthest])):
        if len(chosen) < count and (len(free) == len(records) or not _alone(records, i, chosen)):
            chosen.add(i)
    train = tuple(i not in chosen for i in range(len(records)))
    return Split(tuple(records), train, records[furthest].name, sum(train) == 1)


def unseen(parted: Split) -> dict[str, str]:
    """Held-out record -> what it alone has, so that no fit can tell what comes of it."""
    fitted = [pose(r) for r, train in zip(parted.records, parted.train, strict=True) if train]
    words = {}
    for record, train in zip(parted.records, parted.train, strict=True):
        new = [name for k, name in enumerate(_POSE) if all(pose(record)[k] != p[k] for p in fitted)]
        if record.orientation is None and "orientation" in new:
            new.remove("orientation")
        if not train and new:
            words[record.path.name] = (
                f"no record to fit has its {' or its '.join(new)}: what gravity or a payload does there "
                "shows in its error only; take such a record to fit"
            )
    return words


_POSE = ("orientation", "payload")


def pose(record: Record) -> tuple[float, float]:
    """rad and kg, as compared."""
    return round(record.orientation or 0.0, 2), record.payload or 0.0


def _alone(records: Sequence[Record], one: int, without: set[int]) -> bool:
    """Whether no other record, but those `without`, has its orientation and its payload."""
    return not any(
        pose(r) == pose(records[one]) for i, r in enumerate(records) if i != one and i not in without
    )


def _cut(record: Record) -> Split:
    """One record: its last third is held out."""
    at = max(2 * len(record.time) // 3, 1)
    first = _rows(record, slice(0, at))
    second = _rows(record, slice(at, None))
    start = record.start or 0.0
    step = float(np.median(np.diff(record.time))) if len(record.time) > 1 else 1.0
    first = replace(first, start=start)
    second = replace(second, start=start + first.duration + step, name=record.name)
    if len(second.time) < 2:
        return Split((record,), (True,), None, True)
    return Split((first, second), (True, False), None, True)


def _rows(record: Record, part: slice) -> Record:
    return replace(
        record,
        time=record.time[part],
        pressures=record.pressures[part],
        measured=None if record.measured is None else record.measured[part],
        temperature=None if record.temperature is None else record.temperature[part],
        outputs={name: values[part] for name, values in record.outputs.items()},
    )


def _reach(records: Sequence[Record]) -> np.ndarray:
    """(records,) how far each goes beyond all others, in pressure, rate and orientation, in units of
    their spread."""
    marks = np.array([_marks(record) for record in records])
    reach = np.zeros(len(records))
    for column in marks.T:
        spread = np.ptp(column)
        if spread <= 1e-9 * max(np.abs(column).max(), 1e-12):
            continue
        for i in range(len(records)):
            others = np.delete(column, i)
            beyond = max(column[i] - others.max(), others.min() - column[i], 0.0)
            reach[i] = max(reach[i], beyond / spread)
    return reach


def _marks(record: Record) -> tuple[float, float, float]:
    rate = np.abs(np.diff(record.pressures, axis=0)) / np.diff(record.time)[:, None]
    top = float(np.max(np.abs(record.pressures)))
    moving = rate[rate > 0.0]
    speed = float(np.log(np.mean(moving))) if len(moving) else -20.0
    return top, speed, record.orientation or 0.0
