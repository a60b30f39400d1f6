"""The arm paper's bench protocols (section IV.B) as drives, and what its Tables 2 and 3 report for each.

Commands are held and sampled at 100 Hz; between two samples they run linearly, which makes a step 10 ms long.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from fem_spa.reduced.model import Drive

BAR = 1e5
TOP = 3.5
STEP = 0.5
"""bar: the largest command and the step of the staircases."""
SAMPLING = 100.0
"""Hz."""


@dataclass(frozen=True)
class Protocol:
    """One motion pattern.

    Attributes
    ----------
    name : as in the tables;  rate : actuation frequency, Hz
    duration : of the paper's, s
    commands : (seconds) -> (k, 3) Pa, one row an actuation, the first `seconds` of the pattern
    paper : mean |ex|, |ey|, |ez| in mm, mean and s.d. of |e|/L in % of Table 3 (workspace: Table 2)
    dynamic : False where only resting positions are compared
    """

    name: str
    rate: float
    duration: float
    commands: Callable[[float], np.ndarray]
    paper: tuple[float, float, float, float, float]
    dynamic: bool = True

    def drive(self, seconds: float | None = None) -> Drive:
        """The commands, held between actuations, over the first `seconds` (default: all)."""
        length = self.duration if seconds is None else min(seconds, self.duration)
        rows = self.commands(length)
        time = np.arange(round(length * SAMPLING)) / SAMPLING
        row = np.minimum((time * self.rate + 1e-9).astype(int), len(rows) - 1)
        return Drive(time, rows[row])


def staircase(*directions: tuple[float, float, float]) -> Callable[[float], np.ndarray]:
    """0 to 3.5 bar by 0.5 bar along each of the directions in turn."""
    levels = np.arange(0.0, TOP + STEP / 2, STEP) * BAR
    rows = np.concatenate([np.outer(levels, direction) for direction in directions])
    return lambda seconds: rows


def babbling(rate: float, seed: int) -> Callable[[float], np.ndarray]:
    """Random walk from zero, each chamber -0.05, 0 or 0.05 bar an actuation, kept within 0 to 3.5 bar."""

    def walk(seconds: float) -> np.ndarray:
        rng = np.random.default_rng(seed)
        p = np.zeros((round(seconds * rate), 3))
        for i in range(1, len(p)):
            p[i] = np.clip(p[i - 1] + 0.05 * rng.integers(-1, 2, 3), 0.0, TOP)
        return p * BAR

    return walk


def sinusoids(frequency: float, rate: float = 20.0) -> Callable[[float], np.ndarray]:
    """2 bar + 1.5 bar sin(2 pi f t + phase), phases 0, 2/3 pi, 4/3 pi."""

    def waves(seconds: float) -> np.ndarray:
        t = np.arange(round(seconds * rate)) / rate
        phase = np.array([0.0, 2 / 3, 4 / 3]) * np.pi
        return BAR * (2.0 + 1.5 * np.sin(2 * np.pi * frequency * t[:, None] + phase))

    return waves


def workspace(seconds: float) -> np.ndarray:
    """All 512 combinations of 0, 0.5 ... 3.5 bar, or the first that fit into `seconds` (5 s each)."""
    levels = np.arange(0.0, TOP + STEP / 2, STEP) * BAR
    return np.array(list(product(levels, repeat=3)))[: max(1, round(seconds * 0.2))]


_ONE = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_TWO = ((0.0, 1.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, 0.0))
PROTOCOLS = (
    Protocol("Stretching", 0.2, 40.0, staircase((1.0, 1.0, 1.0)), (1.0, 0.6, 4.1, 2.3, 1.2)),
    Protocol("Bending 1", 0.2, 120.0, staircase(*_ONE), (4.2, 4.7, 3.7, 4.4, 2.8)),
    Protocol("Bending 2", 0.2, 120.0, staircase(*_TWO), (4.3, 5.5, 7.3, 6.3, 3.2)),
    Protocol("Workspace", 0.2, 2560.0, workspace, (9.1, 5.2, 7.0, 7.4, 4.1), dynamic=False),
    Protocol("Babbling 1 Hz", 1.0, 300.0, babbling(1.0, 1), (3.8, 4.1, 1.7, 3.5, 1.6)),
    Protocol("Babbling 2 Hz", 2.0, 300.0, babbling(2.0, 2), (3.5, 5.5, 2.2, 4.1, 1.5)),
    Protocol("Babbling 5 Hz", 5.0, 300.0, babbling(5.0, 5), (6.3, 3.4, 9.9, 7.2, 3.8)),
    Protocol("Babbling 10 Hz", 10.0, 300.0, babbling(10.0, 10), (5.6, 4.4, 9.0, 6.9, 3.4)),
    Protocol("Babbling 20 Hz", 20.0, 300.0, babbling(20.0, 20), (6.8, 6.6, 5.5, 6.5, 3.5)),
    Protocol("Sinusoids 0.05 Hz", 20.0, 20.0, sinusoids(0.05), (26.4, 10.2, 15.9, 18.4, 12.3)),
    Protocol("Sinusoids 0.10 Hz", 20.0, 20.0, sinusoids(0.10), (27.0, 22.9, 19.0, 23.3, 11.1)),
    Protocol("Sinusoids 0.20 Hz", 20.0, 20.0, sinusoids(0.20), (25.6, 33.2, 15.9, 25.9, 11.2)),
)
TABLE_2 = {
    "Stretching": (1.4, 0.6, 2.6, 1.6, 0.6),
    "Bending 1": (4.8, 5.2, 3.9, 4.8, 2.2),
    "Bending 2": (3.7, 5.1, 5.9, 5.5, 2.5),
    "Workspace": (9.1, 5.2, 7.0, 7.4, 4.1),
}
"""Quasi-static validation, in the same order of columns."""
