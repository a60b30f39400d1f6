"""What was commanded: protocols A to D+ as lists of records, and the one time line they make together.

A is one slow rise and fall, B five equal cycles, C a staircase with holds of 10 s, D three rates and two
amplitudes, minor loops, a rest, a hold of 60 s, random steps and the first record again; D+ is D with records
taken upside down and the chamber's pressure measured.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

PROTOCOLS = ("A", "B", "C", "D", "D+")
STEP = 0.01
"""s, between the points of the time line within a record."""


@dataclass(frozen=True)
class Plan:
    """One record as it is meant.

    Attributes
    ----------
    name : file name without its ending
    knots : (k, 2) time (s) from the record's start and pressure (1 = the session's largest); linear between
    start : s, since the session's first record
    orientation : rad; payload : kg, as written into the record where `payload_written`
    """

    name: str
    knots: np.ndarray
    start: float
    orientation: float = 0.0
    payload: float = 0.0

    @property
    def duration(self) -> float:
        return float(self.knots[-1, 0])


@dataclass(frozen=True)
class Line:
    """The session as one time line: every record finely, every rest coarsely.

    Attributes
    ----------
    time : (n,) s;  command : (n,) Pa;  record : (n,) index of the record, -1 at rest
    orientation : (n,) rad;  payload : (n,) kg, the true one;  top : Pa, the largest command
    """

    time: np.ndarray
    command: np.ndarray
    record: np.ndarray
    orientation: np.ndarray
    payload: np.ndarray
    top: float
    temperature: np.ndarray | None = field(default=None)

    @property
    def seen(self) -> np.ndarray:
        return self.record >= 0

    @property
    def step(self) -> np.ndarray:
        """(n,) s, to the point before; the first is the fine step."""
        return np.diff(self.time, prepend=self.time[0] - STEP)


def triangle(period: float, cycles: int, high: float = 1.0, low: float = 0.0) -> np.ndarray:
    """Knots of `cycles` triangles after half a second of rest."""
    lead = 0.5
    knots = [(0.0, 0.0), (lead, 0.0)]
    if low > 0.0:
        lead += period * low / high / 2
        knots.append((lead, low))
    for k in range(cycles):
        knots += [(lead + (k + 0.5) * period, high), (lead + (k + 1) * period, low)]
    end = knots[-1][0]
    if low > 0.0:
        end += period * low / high / 2
        knots.append((end, 0.0))
    knots.append((end + 0.5, 0.0))
    return np.array(knots)


def stairs(levels: np.ndarray, hold: float, slew: float) -> np.ndarray:
    """Knots of `hold` seconds at each level, `slew` seconds between."""
    knots = [(0.0, 0.0)]
    at, last = 0.5, 0.0
    for level in levels:
        knots += [(at, last), (at + slew, float(level))]
        at, last = at + hold, float(level)
    knots.append((at, last))
    return np.array(knots)


def minor_loops(period: float) -> np.ndarray:
    """Rise with loops inside at two offsets, then fall with one."""
    levels = [0.0, 0.4, 0.15, 0.75, 0.45, 1.0, 0.6, 0.85, 0.3, 0.55, 0.0]
    knots, at = [(0.0, 0.0), (0.5, 0.0)], 0.5
    for last, level in pairwise(levels):
        at += abs(level - last) * period / 2
        knots.append((at, level))
    knots.append((at + 0.5, 0.0))
    return np.array(knots)


def random_steps(rng: np.random.Generator, duration: float, slew: float) -> np.ndarray:
    """Levels drawn anew every 1 to 4 s."""
    knots, at, last = [(0.0, 0.0)], 0.5, 0.0
    while at < duration:
        level = float(rng.uniform(0.0, 1.0))
        knots += [(at, last), (at + slew, level)]
        at, last = at + float(rng.uniform(1.0, 4.0)), level
    knots += [(at, last), (at + slew, 0.0), (at + slew + 1.5, 0.0)]
    return np.array(knots)


def _rich(rng: np.random.Generator, slew: float) -> list[tuple[str, np.ndarray]]:
    """The records of D, about 280 s together, in the order of a bench."""
    ladder = np.vstack([triangle(20.0, 1, 0.6), triangle(20.0, 1, 1.0)[1:] + np.array([20.5, 0.0])])
    hold = np.array(
        [(0, 0), (0.5, 0), (0.5 + slew, 0.8), (60.5, 0.8), (60.5 + slew, 0.0), (80.0, 0.0)], dtype=float
    )
    return [
        ("ladder", ladder),
        ("middle", triangle(8.0, 3)),
        ("fast", triangle(2.0, 8)),
        ("small", triangle(8.0, 3, 0.6)),
        ("loops", minor_loops(16.0)),
        ("hold", hold),
        ("steps", random_steps(rng, 28.0, slew)),
        ("again", ladder),
    ]


def plan(protocol: str, rng: np.random.Generator, orientation: float, long_rests: bool) -> list[Plan]:
    """The records of a session; rests between them are drawn: seconds, or minutes where `long_rests`."""
    slew = float(rng.uniform(0.05, 0.2))
    repeats = int(rng.integers(3, 5))
    if protocol == "A":
        shapes = [(f"slow{k + 1}", triangle(43.0, 1)) for k in range(repeats)]
    elif protocol == "B":
        shapes = [(f"cycles{k + 1}", triangle(8.6, 5)) for k in range(repeats)]
    elif protocol == "C":
        levels = np.array([0.2, 0.4, 0.6, 0.8, 1.0, 0.8, 0.6, 0.4, 0.2, 0.0])
        shapes = [(f"stairs{k + 1}", stairs(levels, 10.0, slew)) for k in range(repeats)]
    else:
        shapes = _rich(rng, slew)
    turned = {}
    if protocol == "D+":
        turned = {"flipped1": triangle(20.0, 1), "flipped2": minor_loops(12.0)}
        at = int(rng.integers(3, 7))
        shapes = shapes[:at] + list(turned.items())[:1] + shapes[at:] + list(turned.items())[1:]
    plans, start = [], 0.0
    for name, knots in shapes:
        way = (orientation + np.pi) % (2 * np.pi) if name in turned else orientation
        plans.append(Plan(name, knots, start, way))
        rest = np.exp(rng.uniform(np.log(120.0), np.log(900.0)) if long_rests else rng.uniform(1.0, 4.5))
        start = float(np.round(start + plans[-1].duration + rest, 0)) + 1.0
    return plans


def time_line(plans: list[Plan], top: float, payload: np.ndarray) -> Line:
    """One line through all records and rests.

    Parameters
    ----------
    top : Pa
    payload : (records,) kg, what truly hangs at the tip
    """
    times, command, record, way, mass = [], [], [], [], []
    for k, item in enumerate(plans):
        if k:
            last = plans[k - 1].start + plans[k - 1].duration
            gap = item.start - last
            rest = last + gap * (np.geomspace(0.002, 1.0, 60)[:-1])
            times.append(rest)
            command.append(np.zeros(len(rest)))
            record.append(np.full(len(rest), -1))
            way.append(np.full(len(rest), item.orientation))
            mass.append(np.full(len(rest), payload[k]))
        t = np.arange(0.0, item.duration + STEP / 2, STEP)
        times.append(item.start + t)
        command.append(top * np.interp(t, item.knots[:, 0], item.knots[:, 1]))
        record.append(np.full(len(t), k))
        way.append(np.full(len(t), item.orientation))
        mass.append(np.full(len(t), payload[k]))
    t, p, r, o, m = (np.concatenate(part) for part in (times, command, record, way, mass))
    return Line(t, p, r, o, m, top)


def with_temperature(line: Line, temperature: np.ndarray) -> Line:
    """The same line with the actuator's temperature, (n,) K."""
    return replace(line, temperature=temperature)
