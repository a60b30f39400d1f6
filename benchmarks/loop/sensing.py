"""The sensor of the output: a slow filter, a wrong characteristic, drift, a coarse step."""

from __future__ import annotations

import numpy as np

from benchmarks.loop.physics import Physics, Shape, World, log_uniform, relax


def _filtered(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Three stages that share `size` (s) unequally: the display's filter, the shutter, the bus."""
    first = shape["first"]
    for part in (first, 0.7 * (1 - first), 0.3 * (1 - first)):
        y = relax(y, np.full(len(y), 1 / (part * size)), world.line.step)
    return y


def _bent_scale(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """A characteristic that bends as an exponential (flex sensor) or a sine (off-centre encoder)."""
    span = world.base.span
    x = y / span
    if shape["sine"] > 0.5:
        return y + size * span * np.sin(shape["pitch"] * x + shape["phase"])
    k = 2.5 * shape["sign"]
    return y + size * span * 4 * (np.expm1(k * x) / np.expm1(k) - x)


def _wander(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Drift with a power of the time since switching on; `size` is its share of the span at the end."""
    t = world.line.time - world.line.time[0]
    return y + shape["sign"] * size * world.base.span * (t / t[-1]) ** shape["power"]


def _coarse(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """A step of `size` of the span, cut downwards."""
    pitch = size * world.base.span
    return np.floor(y / pitch + shape["phase"]) * pitch


def _scale(rng: np.random.Generator) -> dict[str, float]:
    return {
        "sine": float(rng.random() < 0.5),
        "pitch": float(rng.uniform(2.0, 5.0)),
        "phase": float(rng.uniform(0, 6.28)),
        "sign": float(rng.choice([-1, 1])),
    }


SENSING = [
    Physics(
        "sensor-lag",
        "sensor",
        (0.02, 0.3),
        (0.02, 0.3),
        lambda rng: {"first": float(rng.uniform(0.4, 0.85))},
        _filtered,
    ),
    Physics("sensor-nonlinearity", "sensor", (0.01, 0.06), (0.01, 0.06), _scale, _bent_scale),
    Physics(
        "sensor-drift",
        "sensor",
        (0.01, 0.08),
        (0.01, 0.08),
        lambda rng: {"power": log_uniform(rng, 0.6, 1.4), "sign": float(rng.choice([-1, 1]))},
        _wander,
    ),
    Physics(
        "quantisation",
        "sensor",
        (0.01, 0.05),
        (0.01, 0.05),
        lambda rng: {"phase": float(rng.random())},
        _coarse,
    ),
]
