"""What no library of effects has. The right answer to these is that nothing known explains them."""

from __future__ import annotations

import numpy as np

from benchmarks.loop.physics import Physics, Shape, World, log_uniform, relax


def _beat(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Mains hum folded down by the sampling: a steady tone, whatever the pressure does."""
    t = world.line.time
    return y + size * world.base.span * np.sin(2 * np.pi * shape["frequency"] * t + shape["phase"])


def _hose_kink(p: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Bent beyond an angle the actuator pinches its hose: the pressure then follows `size` s late.

    A pinched hose lets go by a jump, at a smaller angle than it shut.
    """
    top = world.line.top
    x, shut, out = float(p[0]), False, np.empty(len(p))
    step = world.line.step.tolist()
    for i, aim in enumerate(p.tolist()):
        shut = x > (shape["at"] - 0.15 * shut) * top
        x += (aim - x) * (1 - np.exp(-min(step[i] / (size if shut else 0.005), 50.0)))
        out[i] = x
    return out


def _compressor(p: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """The tank's compressor starts and stops between two levels: the supply has a saw-tooth of its own."""
    t = world.line.time / shape["period"] + shape["phase"]
    saw = np.where(t % 1 < 0.3, (t % 1) / 0.3, (1 - t % 1) / 0.7) - 0.5
    return p * (1 + size * saw)


def _jumping_viscosity(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Thick in two bands of pressure, thin outside, as if something stuck: lag `size` s in the bands."""
    x = world.pressure / world.line.top
    inside = ((x > shape["low"]) & (x < shape["low"] + 0.15)) | ((x > 0.7) & (x < 0.85))
    return relax(y, np.where(inside, 1 / size, 200.0), world.line.step)


def _frames(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """The camera's buffer hangs now and then: the last frame is repeated for `size` s."""
    t, out = world.line.time, y.copy()
    rng = np.random.default_rng(int(shape["seed"]))
    at = t[0]
    while at < t[-1]:
        at += rng.exponential(shape["every"])
        rows = np.nonzero((t >= at) & (t < at + size))[0]
        if len(rows):
            out[rows] = out[rows[0]]
        at += size
    return out


def _latch(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """A fold that lies left in one cycle and right in the next: every other cycle bends less."""
    x = world.pressure / world.line.top
    up = x > 0.25
    starts = np.concatenate([[0], (np.diff(up.astype(int)) > 0).astype(int)])
    odd = np.cumsum(starts) % 2
    lift = np.clip((x - 0.25) / 0.2, 0, 1)
    return y - size * world.base.span * odd * lift


def _knock(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Somebody leans on the table: bumps of seconds at moments that have to do with nothing."""
    t, out = world.line.time, y.copy()
    rng = np.random.default_rng(int(shape["seed"]))
    at = t[0]
    while at < t[-1]:
        at += rng.exponential(shape["every"])
        bump = np.exp(-0.5 * ((t - at) / shape["long"]) ** 2)
        out += rng.choice([-1.0, 1.0]) * size * world.base.span * bump
    return out


def _glued(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Walls that stick together while empty: after a rest they let go late, the longer the rest the later."""
    x, step = world.pressure / world.line.top, world.line.step.tolist()
    rested, hold, out = 0.0, 0.0, np.empty(len(y))
    floor, free = float(y[0]), 1.0
    for i in range(len(y)):
        if x[i] < 0.02:
            rested += step[i]
            hold = size * (1 - np.exp(-rested / shape["set"]))
        elif x[i] > hold:
            hold, rested = 0.0, 0.0
        free = 0.0 if hold > 0 else 1 - (1 - free) * np.exp(-min(step[i] / 0.05, 50.0))
        out[i] = floor + free * (y[i] - floor)
    return out


def _seeded(low: float, high: float, **more: tuple[float, float]):  # type: ignore[no-untyped-def]
    def draw(rng: np.random.Generator) -> dict[str, float]:
        found = {"seed": float(rng.integers(1 << 30)), "every": log_uniform(rng, low, high)}
        return found | {name: log_uniform(rng, *ends) for name, ends in more.items()}

    return draw


def _tone(rng: np.random.Generator) -> dict[str, float]:
    return {"frequency": log_uniform(rng, 0.11, 1.9), "phase": float(rng.uniform(0, 6.28))}


STRANGE = [
    Physics("mains beat", "sensor", (0.005, 0.1), (0.005, 0.1), _tone, _beat),
    Physics(
        "hose kink",
        "supply",
        (0.3, 6.0),
        (0.3, 6.0),
        lambda rng: {"at": float(rng.uniform(0.45, 0.75))},
        _hose_kink,
    ),
    Physics(
        "compressor duty",
        "supply",
        (0.03, 0.3),
        (0.03, 0.3),
        lambda rng: {"period": log_uniform(rng, 3.0, 17.0), "phase": float(rng.random())},
        _compressor,
    ),
    Physics(
        "viscosity in bands",
        "output",
        (0.3, 6.0),
        (0.3, 6.0),
        lambda rng: {"low": float(rng.uniform(0.2, 0.45))},
        _jumping_viscosity,
    ),
    Physics("frames repeated", "sensor", (0.2, 3.0), (0.2, 3.0), _seeded(3.0, 12.0), _frames),
    Physics("alternating fold", "output", (0.02, 0.2), (0.02, 0.2), lambda rng: {}, _latch),
    Physics(
        "knocks",
        "output",
        (0.02, 0.3),
        (0.02, 0.3),
        _seeded(8.0, 25.0, long=(0.6, 3.0)),
        _knock,
    ),
    Physics(
        "glued walls",
        "output",
        (0.1, 0.5),
        (0.1, 0.5),
        lambda rng: {"set": log_uniform(rng, 0.5, 3.0)},
        _glued,
    ),
]
