"""Records of the whole three-chamber arm for studies of the loop: its protocols, a bench's noise.

The arm that makes them has another clamp, number of elements and modulus than the base model that is
diagnosed on them. A sitting is a few records of one protocol, of other sizes, seeds or mountings; the last
one is held out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import read_model
from studies.loop_records import write_record

TOP = 350.0
"""kPa."""
WHITE, SLOW, OFFSET, MEMORY = 0.2, 0.3, 0.4, 1.0
"""mm a component: noise of a sample, AR(1) noise, offset of a record; s: memory of the AR(1) noise."""
ONE = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
TWO = ((0, 1, 1), (1, 0, 1), (1, 1, 0))
WHOLE = {"kind": "rod", "preset": "am-i-support", "clamp": "base", "elements": 24, "modulus": "1.7 MPa"}
"""The arm that the records are of."""
BASE = {"kind": "rod", "preset": "am-i-support", "integration": "modal"}
"""The base model with every component on."""
Command = tuple[np.ndarray, float]
"""(n, 3) kPa, and the orientation in degrees."""


def stairs(n: int, *directions: tuple[int, int, int]) -> np.ndarray:
    """(n, 3) half, whole, nothing along each direction in turn, after a short rest; one at most."""
    levels = [np.zeros(3), *(np.array(d) * size for d in directions for size in (0.5, 1.0, 0.0))]
    at = np.arange(n) * len(levels) // n
    return np.array(levels, float)[at]


def waves(n: int, rate: float, hertz: float) -> np.ndarray:
    """(n, 3) sines between nothing and one, a third of a period apart, from nothing within half a second."""
    t = np.arange(n) / rate
    phase = math.tau * (hertz * t[:, None] - np.arange(3) / 3)
    return 0.5 * (1 - np.cos(phase)) * np.minimum(2 * t, 1.0)[:, None]


def babble(n: int, rate: float, rng: np.random.Generator, hertz: float = 1.0) -> np.ndarray:
    """(n, 3) levels of chance between nothing and one, held."""
    at = np.floor(np.arange(n) * hertz / rate).astype(int)
    return rng.uniform(0, 1, (at[-1] + 1, 3))[at]


def sittings(seconds: float, rate: float, rng: np.random.Generator) -> dict[str, tuple[Command, ...]]:
    """Protocol -> its records; hanging, but for the level arm; the last of each is held out."""
    n = round(seconds * rate)
    hanging: dict[str, list[np.ndarray]] = {
        "stretch": [size * stairs(n, (1, 1, 1)) for size in (1.0, 0.5, 0.75)],
        "bend1": [size * stairs(n, *ONE) for size in (1.0, 0.5, 0.75)],
        "bend2": [size * stairs(n, *TWO) for size in (1.0, 0.5, 0.75)],
        "sine": [
            size * waves(n, rate, hertz) for size, hertz in ((1.0, 0.1), (0.5, 0.4), (1.0, 0.4), (0.75, 0.2))
        ],
        "babble": [size * babble(n, rate, rng) for size in (1.0, 0.5, 0.75)],
    }
    found = {name: tuple((TOP * c, 0.0) for c in commands) for name, commands in hanging.items()}
    found["level"] = (
        (TOP * stairs(n, *ONE), 90.0),
        (0.5 * TOP * stairs(n, *TWO), 90.0),
        (TOP * stairs(n, *TWO), 45.0),
        (0.75 * TOP * stairs(n, *ONE), 90.0),
    )
    return found


def write_sitting(
    folder: Path, name: str, commands: tuple[Command, ...], rate: float, rng: np.random.Generator
) -> list[Path]:
    """The records of the whole arm under these commands, as files."""
    truth = read_model(WHOLE)
    files = []
    for k, (command, orientation) in enumerate(commands, 1):
        time = np.arange(len(command)) / rate
        tip = 1e3 * truth.simulate(Drive(time, 1e3 * command, orientation=math.radians(orientation)))
        files.append(measured(folder / f"{name}{k}.csv", time, command, tip, orientation, rng))
    return files


def measured(
    path: Path,
    time: np.ndarray,
    command: np.ndarray,
    tip: np.ndarray,
    orientation: float,
    rng: np.random.Generator,
) -> Path:
    """One record: the tip (n, 3) in mm with an offset and noise, the command (n, 3) in kPa."""
    step = float(time[1] - time[0])
    tip = tip + rng.normal(0, OFFSET, 3) + rng.normal(0, WHITE, tip.shape) + slow_noise(rng, tip.shape, step)
    columns = {"time [s]": time}
    columns |= {f"pressure {k + 1} [kPa]": command[:, k] for k in range(3)}
    columns |= {f"{axis} [mm]": tip[:, k] for k, axis in enumerate("xyz")}
    metadata = {"orientation": f"{orientation:g} deg", "history": "cycled", "session": "1"}
    return write_record(path, metadata, columns)


def slow_noise(rng: np.random.Generator, shape: tuple[int, ...], step: float) -> np.ndarray:
    """AR(1) noise of `SLOW` with a memory of `MEMORY`, samples `step` s apart."""
    keep = math.exp(-step / MEMORY)
    noise = rng.normal(0, SLOW * math.sqrt(1 - keep**2), shape)
    noise[0] = rng.normal(0, SLOW, shape[1:])
    for k in range(1, len(noise)):
        noise[k] += keep * noise[k - 1]
    return noise


def shows(component: str, commands: tuple[Command, ...], rate: float) -> float:
    """mm RMS that leaving a component out takes from the tip where modulus and offset are refitted."""
    return left_over(BASE, {**BASE, component: False}, commands, rate)


def numerics(commands: tuple[Command, ...], rate: float) -> float:
    """The same of the base model as a whole against the arm that the records are of."""
    return left_over({**WHOLE, "integration": "modal"}, BASE, commands, rate)


def left_over(
    truth: Mapping[str, Any], model: Mapping[str, Any], commands: tuple[Command, ...], rate: float
) -> float:
    """mm RMS between the tips of two rods, modulus and a constant offset of the second fitted; no noise."""
    from scipy.optimize import minimize_scalar

    rod = read_model(model)
    stiff, far = rod.parameters["modulus"].value, 0.3

    def tips(rod: Any) -> np.ndarray:
        drives = [
            Drive(np.arange(len(c)) / rate, 1e3 * c, orientation=math.radians(way)) for c, way in commands
        ]
        found = np.concatenate([1e3 * rod.simulate(drive) for drive in drives])
        return np.asarray(found - found.mean(axis=0))

    aim = tips(read_model(truth))
    less, same, more = (tips(rod.with_values(modulus=stiff * math.exp(x))) for x in (-far, 0.0, far))

    def left(y: float) -> float:
        tip = 0.5 * y * (y - 1) * less + (1 - y * y) * same + 0.5 * y * (y + 1) * more
        return float(np.sqrt(np.mean(np.sum((tip - aim) ** 2, axis=1))))

    return float(minimize_scalar(left, bounds=(-1.5, 1.5), method="bounded").fun)
