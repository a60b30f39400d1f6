"""Between the command and the chamber: orifices, dead time, thresholds, leaks, a weak regulator.

Flow goes with the square root of the difference (Bernoulli), not with the difference; thresholds and limits
are smooth; a leak is an orifice as well and acts while the valve is shut in a hold.
"""

from __future__ import annotations

import numpy as np

from benchmarks.loop.physics import Physics, Shape, World, log_uniform


def _orifice(p: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Filling and venting through an orifice: p' = +-c sqrt|d| (linear below 2 % of the largest pressure).

    `size` is the time (s) from nought to 63 % of a full step; falling is `ratio` times slower.
    """
    top, step = world.line.top, world.line.step.tolist()
    knee = 0.02 * top
    c = 2 * (1 - np.sqrt(0.37)) * np.sqrt(top) / size
    ratio = shape["ratio"]
    x = float(p[0])
    out = np.empty(len(p))
    target = p.tolist()
    last = target[0]
    for i in range(len(target)):
        h = step[i]
        pieces = 1 if h > 1 else 2
        for k in range(pieces):
            aim = last + (target[i] - last) * (k + 0.5) / pieces
            d = aim - x
            rate = c / (ratio if d < 0 else 1.0) / np.sqrt(max(abs(d), knee))
            x += d * (1 - np.exp(-min(rate * h / pieces, 50.0)))
        last = target[i]
        out[i] = x
    return out


def _dead_time(p: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Sound and valve: dead time `size` (s), a little longer when the pressure is low."""
    t = world.line.time
    late = size * (1 + shape["slack"] * (0.5 - p / world.line.top))
    return np.interp(t - late, t, p)


def _threshold(p: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Nothing happens below about `size` of the largest pressure: a softplus, zero at zero."""
    top = world.line.top
    p0, s = size * top, shape["softness"] * size * top
    lift = s * np.logaddexp(0.0, (p - p0) / s)
    return np.where(p > 0, lift - s * np.log1p(np.exp(-p0 / s)), p)


def _spool(p: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """A spool with overlap: the regulator waits until the command is off by `size`, then follows."""
    width, back = size * world.line.top, shape["back"]
    out = np.empty(len(p))
    x = float(p[0])
    for i, aim in enumerate(p.tolist()):
        d = aim - x
        if abs(d) > width:
            x += d - np.copysign(width * back, d)
        out[i] = x
    return np.maximum(out, 0.0)


def _leak(p: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """The valve shuts when the command has rested for half a second; then p' = -k p^m, from an orifice.

    `size` is the share lost in the first minute at the largest pressure.
    """
    top, step = world.line.top, world.line.step.tolist()
    k = size / 60.0 * top / top ** shape["power"]
    out = np.empty(len(p))
    lost, still, last = 0.0, 0.0, float(p[0])
    for i, aim in enumerate(p.tolist()):
        still = still + step[i] if abs(aim - last) < 1e-4 * top else 0.0
        last = aim
        if still > 0.5 and aim > 0.02 * top:
            lost = min(lost + k * max(aim - lost, 0.0) ** shape["power"] * step[i], aim)
        else:
            lost *= np.exp(-min(step[i] / 0.08, 50.0))
        out[i] = aim - lost
    return out


def _limit(p: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """A regulator at its end: smooth minimum of the command and 0.8 size^-0.15 of the largest pressure."""
    end, m = 0.8 * size**-0.15 * world.line.top, shape["sharpness"]
    x = np.maximum(p, 1e-9 * end) / end
    return np.where(p > 0, end * x / (1 + x**m) ** (1 / m), p)


SUPPLY = [
    Physics(
        "pressure-lag",
        "supply",
        (0.08, 0.5),
        (0.08, 0.5),
        lambda rng: {"ratio": log_uniform(rng, 1.5, 4)},
        _orifice,
    ),
    Physics(
        "delay",
        "supply",
        (0.02, 0.08),
        (0.02, 0.08),
        lambda rng: {"slack": float(rng.uniform(0, 0.4))},
        _dead_time,
        "steps",
    ),
    Physics(
        "dead-band",
        "chamber",
        (0.03, 0.15),
        (0.05, 0.2),
        lambda rng: {"softness": float(rng.uniform(0.08, 0.3))},
        _threshold,
    ),
    Physics(
        "dead-band",
        "supply",
        (0.01, 0.05),
        (0.01, 0.05),
        lambda rng: {"back": float(rng.uniform(0.85, 1.0))},
        _spool,
    ),
    Physics(
        "leak",
        "supply",
        (0.03, 0.2),
        (0.03, 0.3),
        lambda rng: {"power": float(rng.uniform(0.5, 1.4))},
        _leak,
        "holds",
    ),
    Physics(
        "saturation",
        "supply",
        (0.05, 0.3),
        (0.05, 0.3),
        lambda rng: {"sharpness": float(rng.uniform(4, 14))},
        _limit,
    ),
]
