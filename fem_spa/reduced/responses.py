"""Steps and sines of pressure, and what the answers to them look like in numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem_spa.errors import InputError
from fem_spa.reduced.model import Drive


def step_drive(pressure: float, duration: float, interval: float = 1e-3, orientation: float = 0.0) -> Drive:
    """Pressure (Pa) put on at t = 0 and held for `duration` (s), a sample every `interval` (s)."""
    time = _even(duration, interval)
    return Drive(time, np.full((time.size, 1), float(pressure)), orientation)


def sine_drive(
    pressure: float, frequency: float, cycles: float, samples: int = 200, orientation: float = 0.0
) -> Drive:
    """0 to `pressure` (Pa) and back along a sine, from 0, `samples` a cycle; frequency in Hz."""
    if frequency <= 0:
        raise InputError(f"given a frequency of {frequency:g} Hz; more than zero is needed")
    time = _even(cycles / frequency, 1 / (frequency * samples))
    wave = 0.5 * pressure * (1 - np.cos(2 * np.pi * frequency * time))
    return Drive(time, wave[:, None], orientation)


def _even(duration: float, interval: float) -> np.ndarray:
    if not (duration > 0 and 0 < interval <= duration):
        raise InputError(
            f"given {duration:g} s sampled every {interval:g} s; both must be positive, the second less"
        )
    return np.linspace(0.0, duration, round(duration / interval) + 1)


@dataclass(frozen=True)
class StepFigures:
    """Of a step response: end value, overshoot as a share of it, times (s) to 10, 63 and 90 % of it."""

    end: float
    overshoot: float
    to_10: float
    to_63: float
    to_90: float


def step_figures(time: np.ndarray, output: np.ndarray) -> StepFigures:
    """Figures of an output (n,) from rest, whose last value is taken for the end.

    Raises
    ------
    InputError : the output does not move
    """
    moved = np.asarray(output, float) - output[0]
    if moved[-1] == 0.0:
        raise InputError("the output ends where it began; there is no step response to describe")
    share = moved / moved[-1]
    times = []
    for level in (0.1, 1 - np.exp(-1), 0.9):
        row = int(np.argmax(share >= level))
        before = max(row - 1, 0)
        rise = share[row] - share[before]
        part = (level - share[before]) / rise if rise > 0 else 1.0
        times.append(float(time[before] + part * (time[row] - time[before]) - time[0]))
    return StepFigures(float(output[-1]), max(float(share.max()) - 1.0, 0.0), *times)


@dataclass(frozen=True)
class SineFigures:
    """Of the last cycle: swing of the output, phase lag (rad) of its first harmonic behind the pressure's,
    and the largest gap between way up and way down at equal pressure, as a share of the swing."""

    swing: float
    lag: float
    gap: float


def sine_figures(drive: Drive, output: np.ndarray, frequency: float) -> SineFigures:
    """Figures of an output (n,) under `sine_drive` at `frequency`, Hz.

    Raises
    ------
    InputError : less than one cycle
    """
    time, pressure = drive.time, drive.pressure[:, 0]
    last = time >= time[-1] - (1 + 1e-9) / frequency
    if time[-1] - time[0] < (1 - 1e-9) / frequency:
        raise InputError("given less than one cycle; longer records are needed")
    t, p, y = time[last], pressure[last], np.asarray(output, float)[last]
    wave = np.exp(-2j * np.pi * frequency * t)
    first = np.trapezoid((y - y.mean()) * wave, t), np.trapezoid((p - p.mean()) * wave, t)
    top = int(np.argmax(p))
    begin, end = int(np.argmin(p[: top + 1])), top + int(np.argmin(p[top:]))
    levels = np.linspace(p[begin:].min(), p.max(), 202)[1:-1]
    up = np.interp(levels, p[begin : top + 1], y[begin : top + 1])
    down = np.interp(levels, p[top : end + 1][::-1], y[top : end + 1][::-1])
    swing = float(np.ptp(y))
    gap = float(np.max(np.abs(down - up))) / swing if swing > 0 else 0.0
    return SineFigures(swing, float(np.angle(first[1] / first[0])), gap)
