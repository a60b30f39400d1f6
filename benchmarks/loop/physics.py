"""What an effect of the generator is, and what it may look at."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.loop.base import Base
from benchmarks.loop.session import Line

Shape = Mapping[str, float]


@dataclass(frozen=True)
class World:
    """What an effect sees of the actuator: the line, the undisturbed model, the pressure that acts."""

    line: Line
    base: Base
    pressure: np.ndarray


@dataclass(frozen=True)
class Physics:
    """One effect.

    Attributes
    ----------
    name : the contract's, or a name of its own where the contract has none
    slot : "supply" (before the pressure sensor), "chamber" (behind it), "map" (takes the place of the
        static map), "output", "sensor"
    silicone, tpu : usual range of `size`, from which it is drawn on a log scale
    draw : random numbers -> the rest of its parameters
    act : (signal, world, size, shape) -> signal; the signal is a pressure in the first two slots
    needs : records it must have to be there at all: "" or "steps", "holds", "virgin", "long"
    """

    name: str
    slot: str
    silicone: tuple[float, float]
    tpu: tuple[float, float]
    draw: Callable[[np.random.Generator], dict[str, float]]
    act: Callable[[np.ndarray, World, float, Shape], np.ndarray]
    needs: str = ""

    def usual(self, material: str) -> tuple[float, float]:
        return self.silicone if material == "silicone" else self.tpu


def nothing(rng: np.random.Generator) -> dict[str, float]:
    """No further parameters."""
    return {}


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A draw on a log scale."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def relax(target: np.ndarray, rate: np.ndarray, step: np.ndarray) -> np.ndarray:
    """x' = rate (target - x), (n,), exact for a target that is linear between points."""
    x = np.empty(len(target))
    product = np.minimum(rate * step, 50.0)
    keep = np.exp(-product)
    slip = (np.diff(target, prepend=target[0]) * (1 - keep) / product).tolist()
    now, last = float(target[0]), float(target[0])
    for i, aim in enumerate(target.tolist()):
        now = aim - slip[i] + (now - last) * keep[i]
        last = aim
        x[i] = now
    return x
