"""Readings that stand on a lattice: the size of its steps, and the readings with the saw averaged out.

Rounding adds a saw over the output. Over one whole tooth of travel its mean is nought, so the mean residual
over as much travel is that of the sensor before rounding; where the output rests or turns round, nothing is
known within a tooth.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data

TEETH = (6.0, 160.0)
"""Teeth over the span, fewest and most, that are looked for."""
LEAST_AGREEMENT = 0.35
"""Length of the mean phase of the readings, weighed by travel; readings on no lattice have a third of a tooth
over the travel without a turn."""
LEAST_STEPS = 40.0
"""Moving samples from which agreement is not chance."""
LEAST_KNOWN = 0.25
"""Share of the training rows that must be left when the saw is averaged out."""
NOISE, SHARP = 0.006, 0.7
"""Noise after the rounding, share of the span, and share of the agreement that it leaves to be asked for."""
STEPS_OF_TEETH = 0.05
"""Teeth over the span between two lattices that are tried."""
AT_ONCE = 256
"""Lattices whose waves are in memory together."""
PASSED, LEAST_PASSED = 0.8, 5
"""Travel in a tooth, in steps, from which it was passed through; and how many must have been."""
PLACE, LEAST_PLACES = 0.004, 9.0
"""Share of the span within which rows show one place, and the fewest of them in a record, on the mean."""
CHANCE = 1e-3
"""Probability with which places on no lattice agree as much on one of all that are tried."""
OF_ITSELF = 0.6
"""Share of the readings' agreement that the prediction may have."""
GRAIN = 0.1
"""Share of a step to which the mean over a tooth is believed."""
FASTEST = 0.015
"""Share of the span beyond which a row's travel is a jump between places of rest, which agree by chance."""


def lattice_step(chain: Chain, data: Data) -> float | None:
    """Size of the steps (SI, of the output) on which the readings stand, None where they do not.

    The phase of the readings alone is looked at, whatever the model lacks.
    """
    if data.output.shape[1] != 1:
        return None
    prediction = chain.predict(data)[:, 0]
    parts = []
    for run in data.runs:
        known = data.known[run.part]
        if run.train and known.sum() > 8:
            travel = np.abs(np.gradient(prediction[run.part]))
            weight = travel * known * (travel < FASTEST * np.ptp(prediction[data.train]))
            moves = weight > 0.0
            parts.append((data.output[run.part, 0][moves], weight[moves], prediction[run.part][moves]))
    weights = np.concatenate([w for _, w, _ in parts]) if parts else np.zeros(0)
    total = float(weights.sum())
    if total <= 0.0:
        return None
    count = total**2 / float(np.sum(weights**2))
    span = float(np.ptp(prediction[data.train]))
    teeth = np.arange(TEETH[0], TEETH[1], STEPS_OF_TEETH) / span
    power = np.zeros(len(teeth))
    for reading, weight, _ in parts:
        for begin in range(0, len(teeth) if len(weight) else 0, AT_ONCE):
            some = slice(begin, begin + AT_ONCE)
            wave = np.exp(2j * np.pi * np.outer(teeth[some], reading))
            power[some] += np.abs(wave @ weight) ** 2 / weight.sum()
    agreement = np.sqrt(power / total)
    # noise after the rounding blurs fine steps only: coarse ones must agree the better
    expected = SHARP * np.exp(-2.0 * (np.pi * NOISE * span * teeth) ** 2)
    clear = agreement >= np.maximum(expected, max(LEAST_AGREEMENT, 3.0 / np.sqrt(count)))
    if count < LEAST_STEPS or not clear.any():
        return None
    best = int(np.argmax(agreement * clear))
    # readings on a lattice stand on every finer one too
    coarse = int(np.nonzero(agreement > 0.8 * agreement[best])[0][0])
    window = slice(max(coarse - 5, 0), coarse + 6)
    step = float(1.0 / teeth[window][int(np.argmax(agreement[window]))])
    return step if _passed(parts, step) >= LEAST_PASSED else None


def resting_step(chain: Chain, data: Data) -> float | None:
    """Size of the steps (SI, of the output) on which readings stand that rest and jump.

    Rows that show the same place count once. A command of equal steps makes a lattice of its own: the
    readings must agree, and the prediction must not.
    """
    if data.output.shape[1] != 1:
        return None
    prediction = chain.predict(data)[:, 0]
    span = float(np.ptp(prediction[data.train]))
    records = []
    for run in data.runs:
        rows = np.arange(run.part.start, run.part.stop)[data.known[run.part]]
        if run.train and len(rows) > 8 and span > 0.0:
            records.append(_places(prediction[rows], data.output[rows, 0], PLACE * span))
    count = float(np.mean([len(read) for _, read in records])) if records else 0.0
    if count < LEAST_PLACES:
        return None
    teeth = np.arange(TEETH[0], TEETH[1], STEPS_OF_TEETH) / span
    told, read = (_agreement(teeth, [record[k] for record in records]) for k in (0, 1))
    expected = SHARP * np.exp(-2.0 * (np.pi * NOISE * span * teeth) ** 2)
    chance = np.sqrt(np.log(span * (teeth[-1] - teeth[0]) / CHANCE) / count)
    clear = (read >= np.maximum(expected, chance)) & (told < OF_ITSELF * read)
    if not clear.any():
        return None
    return float(1.0 / teeth[int(np.argmax(read * clear))])


def _agreement(teeth: np.ndarray, records: list[np.ndarray]) -> np.ndarray:
    """(teeth,) length of the mean phase of values on each lattice, every record's phase its own."""
    waves = [np.exp(2j * np.pi * np.outer(teeth, values)).mean(axis=1) for values in records]
    return np.asarray(np.sqrt(np.mean(np.abs(np.stack(waves)) ** 2, axis=0)))


def _places(prediction: np.ndarray, reading: np.ndarray, apart: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean prediction and mean reading at each place that a record shows."""
    place = np.floor(prediction / apart).astype(int)
    _, at, count = np.unique(place, return_inverse=True, return_counts=True)
    return np.bincount(at, prediction) / count, np.bincount(at, reading) / count


def _passed(parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]], step: float) -> int:
    """Teeth that were passed through: readings of a part of one agree by themselves."""
    tooth = np.concatenate([np.floor(place / step) for _, _, place in parts]).astype(int)
    weight = np.concatenate([w for _, w, _ in parts])
    return int(np.sum(np.bincount(tooth - tooth.min(), weight) >= PASSED * step))


def without_teeth(chain: Chain, data: Data, step: float) -> Data | None:
    """The data with every residual the mean over a tooth of travel, rows without one unknown.

    None where too few rows would be left.
    """
    prediction = chain.predict(data)[:, 0]
    output, known = data.output.copy(), np.zeros(len(prediction), bool)
    for run in data.runs:
        f = prediction[run.part]
        r = data.output[run.part, 0] - f
        sign = np.sign(np.diff(f))
        turns = np.nonzero(np.diff(sign) != 0)[0] + 1
        edges = [0, *turns.tolist(), len(f) - 1]
        smooth, good = r.copy(), np.zeros(len(f), bool)
        for a, b in itertools.pairwise(edges):
            if b - a < 4 or abs(f[b] - f[a]) < step:
                continue
            _average(f[a : b + 1], r[a : b + 1], step, smooth[a : b + 1], good[a : b + 1])
        output[run.part, 0] = f + smooth
        known[run.part] = good & data.known[run.part]
    rows = data.train & data.known
    if float(np.mean(known[rows])) < LEAST_KNOWN:
        return None
    return replace(data, output=output, known=known, grain=GRAIN * step)


def _average(f: np.ndarray, r: np.ndarray, step: float, smooth: np.ndarray, good: np.ndarray) -> None:
    """Means of r over a travel of `step` about each row of a monotone stretch, into `smooth` and `good`."""
    way = np.abs(f - f[0])
    area = np.concatenate([[0.0], np.cumsum(0.5 * (r[1:] + r[:-1]) * np.diff(way))])
    inside = (way >= 0.5 * step) & (way <= way[-1] - 0.5 * step)
    high, low = (np.interp(way[inside] + s * step, way, area) for s in (0.5, -0.5))
    smooth[inside] = (high - low) / step
    good[inside] = True
