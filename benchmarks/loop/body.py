"""Structure and loads: walls, stiffening, wall thickness, the clamp, gravity and payload, snapping.

Gravity and payload are solved as a heavy chain of links in equilibrium; walls and limits are implicit
equations; the snap is a bistable ODE.
"""

from __future__ import annotations

import numpy as np

from benchmarks.loop.physics import Physics, Shape, World, nothing

LINKS = 10


def _inverted(free: np.ndarray, inverse: np.ndarray, y: np.ndarray) -> np.ndarray:
    """y of `free` where `inverse` = free(y) is increasing and tabulated."""
    return np.interp(free, inverse, y)


def _wall(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """A wall met at an angle: y + k w softplus((y - c) / w) = free; `size` = 1 - slope left behind it."""
    span = world.base.span
    at, width = shape["at"] * span, shape["width"] * span
    k = size / max(1 - size, 0.05) if shape["sign"] > 0 else -size / (1 + size)
    grid = np.linspace(-1.0, 4.0, 3000) * span
    return _inverted(y, grid + k * width * np.logaddexp(0.0, (grid - at) / width), grid)


def _limiting_chain(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Fung-like: free = c sinh(y / c), ever stiffer; `size` is the share lost at the largest output."""
    span = world.base.span
    ratio = np.linspace(1e-3, 6.0, 4000)
    lost = 1 - np.arcsinh(ratio) / ratio
    c = span / float(np.interp(min(size, 0.55), lost, ratio))
    return c * np.arcsinh(y / c)


def _uneven_wall(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Chambers of unlike wall: mean of the map at p (t / t_i)^n over five chambers."""
    spread = size * np.array([0.2, 0.6, 1.0, 1.4, 1.8]) * shape["sign"]
    scale = np.clip(1 + spread, 0.15, 3.0) ** -shape["power"]
    return np.mean([world.base.static(world.pressure * s) for s in scale], axis=0)


def _clamp(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """The clamp turns under the moment as a Hertzian contact does, with moment^(2/3)."""
    x = np.clip(world.pressure / world.line.top, 0, None)
    return y + shape["sign"] * size * world.base.span * x ** (2 / 3)


def _heavy(y: np.ndarray, world: World, weight: float, tip: np.ndarray) -> np.ndarray:
    """Equilibrium of a chain of links, (n,) rad at the tip.

    Joint j has stiffness N and free angle y / N; moments of distributed weight `weight` and tip weight `tip`
    are in units of EI / L. Newton from the free shape, on a table over the free angle.

    Parameters
    ----------
    weight : rho g A L^3 / EI;  tip : (n,) m g L^2 / EI
    """
    out = y.copy()
    table = np.linspace(min(0.0, y.min()) - 1e-3, y.max() + 1e-3, 40)
    pairs = {(float(o), float(m)) for o, m in zip(world.line.orientation, tip, strict=True)}
    for way, mass in pairs:
        rows = (world.line.orientation == way) & (tip == mass)
        held = np.array([_balance(free, way, weight, mass) for free in table])
        out[rows] = np.interp(y[rows], table, held)
    return out


def _balance(free: float, way: float, weight: float, tip: float) -> float:
    """Tip angle of one chain; link i is inclined by way + its angle against the hanging axis."""
    n = LINKS
    carried = (weight * (n - np.arange(n) - 0.5) / n + tip) / n  # weight beyond link i times its length
    angle = free * (np.arange(n) + 1) / n
    for _ in range(60):
        turn = np.diff(angle, prepend=0.0)
        joint = n * (turn - free / n)
        residual = joint - np.append(joint[1:], 0.0) + carried * np.sin(way + angle)
        slope = np.diag(np.full(n, 2.0 * n)) - np.diag(np.full(n - 1, float(n)), 1)
        slope -= np.diag(np.full(n - 1, float(n)), -1)
        slope[-1, -1] = n
        slope += np.diag(carried * np.cos(way + angle))
        step = np.linalg.solve(slope, residual)
        angle = angle - np.clip(step, -0.3, 0.3)
        if np.abs(step).max() < 1e-10:
            break
    return float(angle[-1])


def _gravity(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    return _heavy(y, world, size, np.zeros(len(y)))


def _payload(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    most = max(float(world.line.payload.max()), 1e-9)
    return _heavy(y, world, 0.0, size * world.line.payload / most)


def _snap(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """A bistable shell: t q' = q - q^3 + h, h following the pressure; the jump adds `size` of the span."""
    step = world.line.step.tolist()
    h = (world.pressure / world.line.top - shape["at"]) / shape["width"] * 0.385
    q, out = -1.0, np.empty(len(y))
    for i, drive in enumerate(h.tolist()):
        left = min(step[i], 2.0)
        drive = min(max(drive, -8.0), 8.0)
        while left > 0:
            d = min(left, 0.02)
            force = q - q**3 + drive
            q += d / 0.03 * force / (1 + d / 0.03 * abs(1 - 3 * q * q))
            left -= d
        out[i] = q
    return y + size * world.base.span * 0.5 * (1 + np.tanh(2.5 * out))


BODY = [
    Physics(
        "contact",
        "output",
        (0.1, 0.5),
        (0.1, 0.5),
        lambda rng: {
            "at": float(rng.uniform(0.3, 0.7)),
            "width": float(rng.uniform(0.02, 0.06)),
            "sign": float(rng.choice([1, 1, -1])),
        },
        _wall,
    ),
    Physics("stiffening", "output", (0.05, 0.3), (0.05, 0.2), nothing, _limiting_chain),
    Physics(
        "wall-thickness",
        "map",
        (0.1, 0.3),
        (0.03, 0.1),
        lambda rng: {"power": float(rng.uniform(1, 3)), "sign": float(rng.choice([-1, 1]))},
        _uneven_wall,
    ),
    Physics(
        "base-compliance",
        "output",
        (0.01, 0.05),
        (0.01, 0.05),
        lambda rng: {"sign": float(rng.choice([-1, 1]))},
        _clamp,
    ),
    Physics("gravity", "output", (0.05, 0.5), (0.05, 0.3), nothing, _gravity),
    Physics("payload", "output", (0.1, 0.8), (0.05, 0.4), nothing, _payload),
    Physics(
        "snap-through",
        "output",
        (0.05, 0.3),
        (0.05, 0.3),
        lambda rng: {"at": float(rng.uniform(0.35, 0.7)), "width": float(rng.uniform(0.015, 0.07))},
        _snap,
    ),
]
