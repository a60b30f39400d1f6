"""Proportional valves before any model: commanded pressure in, chamber pressure out.

Alessi et al., ablation study of a pneumatic arm, (28)-(30): a command that differs from the one before it
starts an actuation from the pressure of that moment, p_ini, to the commanded, p_des, along a smooth step,

    p = p_ini + (3 x^2 - 2 x^3) (p_des - p_ini),   x = (t - t_delay) / t_max clipped to 0..1      (28), (29)
    t_max = dt + |p_des - p_ini| t_rise, or t_drop where the pressure falls                      (30)

and a command below the threshold p0 counts as zero. Two things are settled here that the paper leaves open.

- Printed (29) divides by t_max - t_delay: a delay would shorten the rise and, once longer than it, turn it
  round. Here the rise takes t_max after the delay. The paper's delay is zero, so its numbers are the same.
- Commands in a drive run linearly between samples, so one actuation overtakes another. (28) started anew from
  zero slope at each sample would never get going. A new actuation keeps the slope of the one before it where
  that leads to the new command (cubic Hermite; from rest this is (28)). Ramps slower than 1/t_rise are
  followed without lag, whatever the sampling.

The dt of (30) only guards a division by zero there; here it is zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numba import njit

from fem_spa.errors import InputError
from fem_spa.reduced.checks import check_drive, check_time
from fem_spa.reduced.model import Drive
from fem_spa.reduced.tables import amount

STEP = 1e-3
"""s; how finely a command that runs linearly is followed."""
_UNITS = {"rise": "s/bar", "drop": "s/bar", "delay": "s", "threshold": "bar"}


@dataclass(frozen=True)
class Valve:
    """A proportional valve with its line.

    Attributes
    ----------
    rise, drop : time a pressure step takes, s a Pa, when it rises and when it falls
    delay : s, before anything happens
    threshold : Pa; a command of smaller size counts as zero
    """

    rise: float = 0.0
    drop: float = 0.0
    delay: float = 0.0
    threshold: float = 0.0

    def __post_init__(self) -> None:
        for name in _UNITS:
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise InputError(f"given {value:g} for the valve's {name}: zero or more is needed")


ARM = Valve(rise=0.2e-5, drop=0.56e-5, delay=0.0, threshold=0.2e5)
"""Alessi et al., Table 1: 0.2 and 0.56 s a bar, no delay, 0.2 bar."""


def read_valve(table: Mapping[str, Any], where: str = "valve") -> Valve:
    """A valve of a table: rise and drop ("0.2 s/bar"), delay ("20 ms"), threshold ("0.2 bar"); default 0."""
    for key in table:
        if key not in _UNITS:
            from fem_spa.deck import nearest

            raise InputError(f"given {where}.{key}: there is no such key{nearest(key, _UNITS)}")
    return Valve(**{key: amount(given, _UNITS[key], f"{where}.{key}", 0.0) for key, given in table.items()})


def valve_pressure(
    time: np.ndarray, pressure: np.ndarray, valve: Valve, at: np.ndarray | None = None, step: float = STEP
) -> np.ndarray:
    """Chamber pressures behind a valve, Pa, (n, chambers) as `pressure`, or (n,) where that is.

    Parameters
    ----------
    time : (n,) s, increasing
    pressure : (n, chambers) or (n,) Pa commanded, linear between samples; unpressurised before the first,
        whose command comes as a step; the last command holds on
    at : (m,) s, increasing, none before time[0]; where the answer is wanted, default `time`
    step : s, how finely commands are followed

    Raises
    ------
    InputError : times that do not increase
    """
    t, wanted = np.asarray(time, float), np.asarray(time if at is None else at, float)
    check_time(t)
    check_time(wanted)
    if wanted[0] < t[0]:
        raise InputError(f"given a time of {wanted[0]:g} s before the first command at {t[0]:g} s")
    p = np.asarray(pressure, float)
    known = t + valve.delay
    even = np.arange(known[0], wanted[-1], step) if valve.rise or valve.drop else known[:1]
    grid = np.unique(np.concatenate([known, even, wanted]))
    grid = grid[grid >= known[0]]
    late = wanted >= known[0]
    rows = np.searchsorted(grid, wanted[late])
    columns = p[:, None] if p.ndim == 1 else p
    result = np.zeros((wanted.size, columns.shape[1]))
    for j in range(columns.shape[1]):
        command = np.interp(grid, known, columns[:, j])
        command[np.abs(command) < valve.threshold] = 0.0
        result[late, j] = _follow(grid, command, valve.rise, valve.drop)[rows]
    return result[:, 0] if p.ndim == 1 else result


def behind(drive: Drive, valve: Valve) -> Drive:
    """The drive that a model gets when `valve` stands before it; same times."""
    time, pressure = check_drive(drive, np.shape(drive.pressure)[-1], "valve")
    return replace(drive, pressure=valve_pressure(time, pressure, valve))


@njit(cache=True)
def _follow(time, command, rise, drop):
    """(n,) pressure after `command` (n,); the command of an interval is that of its end."""
    out = np.empty(time.size)
    start, begin, slope, goal, span = time[0], 0.0, 0.0, command[0], 0.0
    span = abs(goal) * (rise if goal >= 0.0 else drop)
    out[0] = begin if span > 0.0 else goal
    for k in range(1, time.size):
        if command[k] != goal:
            begin, slope = _hermite(time[k - 1] - start, begin, slope, goal, span)
            start, goal = time[k - 1], command[k]
            gap = goal - begin
            span = abs(gap) * (rise if gap >= 0.0 else drop)
            if slope * gap <= 0.0:
                slope = 0.0
            elif abs(slope) * span > 3.0 * abs(gap):
                slope = 3.0 * gap / span
        out[k] = _hermite(time[k] - start, begin, slope, goal, span)[0]
    return out


@njit(cache=True)
def _hermite(t, begin, slope, goal, span):
    """Value and slope at t of the cubic from (0, begin, slope) to (span, goal, 0); the goal from there on."""
    if t >= span:
        return goal, 0.0
    x = t / span
    gap = goal - begin
    value = begin + slope * span * x * (1.0 - x) ** 2 + gap * x * x * (3.0 - 2.0 * x)
    return value, slope * (1.0 - x) * (1.0 - 3.0 * x) + gap / span * 6.0 * x * (1.0 - x)
