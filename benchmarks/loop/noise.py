"""What a bench adds: white and coloured noise, an offset and a gain of each record, harmless faults."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.loop.physics import log_uniform

FAULTS = ("metadata missing", "outliers", "dropouts", "jitter", "fine steps")


@dataclass(frozen=True)
class Noise:
    """Standard deviations as shares of the span; `memory` (s) of the AR(1) part; `faults` of `FAULTS`."""

    white: float
    coloured: float
    memory: float
    offset: float
    gain: float
    faults: tuple[str, ...] = ()


def draw_noise(rng: np.random.Generator, faults: tuple[str, ...] = ()) -> Noise:
    """Within the ranges that loop.md gives for repeatability and sensors."""
    return Noise(
        log_uniform(rng, 0.0007, 0.003),
        log_uniform(rng, 0.0015, 0.0045),
        log_uniform(rng, 0.5, 5.0),
        log_uniform(rng, 0.0015, 0.006),
        log_uniform(rng, 0.0005, 0.003),
        faults,
    )


def measured(
    rng: np.random.Generator, clean: np.ndarray, dt: float, span: float, offset: float, noise: Noise
) -> np.ndarray:
    """One record's output with its noise, (n,); `offset` is the output at rest, about which gains turn."""
    n = len(clean)
    keep = float(np.exp(-dt / noise.memory))
    kick = rng.normal(0, noise.coloured * span * np.sqrt(1 - keep**2), n)
    slow, now = np.empty(n), float(rng.normal(0, noise.coloured * span))
    for i in range(n):
        now = keep * now + kick[i]
        slow[i] = now
    y = offset + (clean - offset) * (1 + rng.normal(0, noise.gain)) + rng.normal(0, noise.offset * span)
    y = y + slow + rng.normal(0, noise.white * span, n)
    if "fine steps" in noise.faults:
        pitch = log_uniform(rng, 0.002, 0.006) * span
        y = np.round(y / pitch) * pitch
    if "outliers" in noise.faults:
        hit = rng.random(n) < log_uniform(rng, 0.002, 0.01)
        y[hit] += rng.choice([-1, 1], hit.sum()) * rng.uniform(0.1, 0.4, hit.sum()) * span
    if "dropouts" in noise.faults:
        for _ in range(int(rng.integers(2, 6))):
            start = int(rng.integers(0, n))
            y[start : start + int(rng.integers(1, 20))] = np.nan
    return y


def sampled(rng: np.random.Generator, duration: float, dt: float, noise: Noise) -> np.ndarray:
    """Times of a record, s."""
    t = np.arange(0.0, duration + dt / 2, dt)
    if "jitter" in noise.faults:
        t[1:-1] += rng.uniform(-0.3, 0.3, len(t) - 2) * dt
    return np.minimum(t, duration)
