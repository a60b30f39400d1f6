"""The repeatability floor: how far records that ask the same of the actuator differ from one another.

Pure error (Draper and Smith 1998, section 2.1): the variance between repeats at the same place of the same
command, offsets of whole records included. It is taken of measured less model: where the model has a memory,
what it foretells of another history is no scatter; a model without one gives the same number to both.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fem_spa.loop.records import Record

SAME_PRESSURE = 0.005
"""Share of the largest pressure within which two commands are the same."""
SAME_SHARE = 0.97
"""Share of the samples that must agree: steps may stand a sample apart."""
SAME_DURATION = 0.02
"""Share by which durations may differ."""


def repeats(records: Sequence[Record]) -> list[list[int]]:
    """Groups of two and more records with the same command, orientation, payload and specimen.

    Returns
    -------
    groups of indices into `records`; a record is in one group at most
    """
    groups: list[list[int]] = []
    for i, record in enumerate(records):
        for group in groups:
            if _same(records[group[0]], record):
                group.append(i)
                break
        else:
            groups.append([i])
    return [group for group in groups if len(group) > 1]


def repeat_floor(
    records: Sequence[Record], train: Sequence[bool], names: Sequence[str], model: Sequence[np.ndarray]
) -> tuple[float, str] | None:
    """RMSE that no model can go below on the held-out records, and the words for where it is from.

    A held-out record without a repeat is taken to scatter as those that have one.

    Parameters
    ----------
    names : outputs, in the unit of SI that `Record` has
    model : (n, d) of each record at its own samples

    Returns
    -------
    root of the mean squared norm over outputs, in SI, and the words; None where nothing is repeated
    """
    own: dict[int, float] = {}
    total, count = 0.0, 0
    for group in repeats(records):
        square, freedom = _pure(
            [records[i] for i in group],
            [np.stack([records[i].outputs[n] for n in names], axis=1) - model[i] for i in group],
        )
        if freedom == 0:
            continue
        own.update(dict.fromkeys(group, square / freedom))
        total, count = total + square, count + freedom
    held = [i for i, fit in enumerate(train) if not fit]
    if count == 0 or not held:
        return None
    weights = np.array([len(records[i].time) for i in held], float)
    squares = np.array([own.get(i, total / count) for i in held])
    words = "repeats" if any(i in own for i in held) else "repeats among the training records"
    return float(np.sqrt(weights @ squares / weights.sum())), words


def _pure(records: Sequence[Record], left: Sequence[np.ndarray]) -> tuple[float, int]:
    """Sum of squares between repeats over the samples of the first, and its degrees of freedom."""
    first = records[0]
    time = first.time - first.time[0]
    top = _top(records)
    stack = np.full((len(records), *left[0].shape), np.nan)
    for k, (record, rows) in enumerate(zip(records, left, strict=True)):
        place, apart = _nearest(time, record)
        agree = np.abs(record.pressures[place] - first.pressures).max(axis=1) <= SAME_PRESSURE * top
        stack[k] = np.where((agree & ~apart)[:, None], rows[place], np.nan)
    seen: np.ndarray = np.all(np.isfinite(stack), axis=2)
    many = np.sum(seen, axis=0)
    good = many > 1
    rows = np.where(seen[:, good, None], stack[:, good], 0.0)
    mean = rows.sum(axis=0) / many[good][:, None]
    square = float(np.sum(np.where(seen[:, good, None], (rows - mean) ** 2, 0.0)))
    return square, int(np.sum(many[good] - 1))


def _nearest(time: np.ndarray, record: Record) -> tuple[np.ndarray, np.ndarray]:
    """(n,) samples of the record nearest in time from its beginning, and where there is none within a step.

    Not interpolated: a mean of two samples would scatter less than a sample does.
    """
    own = record.time - record.time[0]
    right = np.clip(np.searchsorted(own, time), 1, len(own) - 1)
    place = np.where(time - own[right - 1] < own[right] - time, right - 1, right)
    return place, np.abs(own[place] - time) > float(np.median(np.diff(own)))


def _top(records: Sequence[Record]) -> float:
    return max(float(np.max(np.abs(r.pressures))) for r in records) or 1.0


def _same(a: Record, b: Record) -> bool:
    """Whether two records ask the same of the same actuator in the same place."""
    if (a.orientation, a.payload, a.specimen) != (b.orientation, b.payload, b.specimen):
        return False
    if min(len(a.time), len(b.time)) < 2 or abs(a.duration - b.duration) > SAME_DURATION * a.duration:
        return False
    place, apart = _nearest(a.time - a.time[0], b)
    agree = np.abs(b.pressures[place] - a.pressures).max(axis=1) <= SAME_PRESSURE * _top([a, b])
    return float(np.mean(agree & ~apart)) >= SAME_SHARE
