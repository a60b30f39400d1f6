"""Memory of the body: loops, creep, damping, inertia, softening, damage.

Relay grids and a Duhem ODE for loops, a power law for creep, a nonlinear dashpot, tables for softening.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from benchmarks.loop.physics import Physics, Shape, World, log_uniform, nothing


def _relays(p: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Preisach: relays that switch up at a and down at b < a, weights around the diagonal (Cauchy by normal).

    `size` of the largest pressure acts through the relays, which lag behind and remember returns; the middle
    of their major loop is taken off, so that there is a loop and no bent curve.
    """
    m = 36
    grid = (np.arange(m) + 0.5) / m
    a, b = np.meshgrid(grid, grid, indexing="ij")
    keep = a > b
    a, b = a[keep], b[keep]
    gap = a - b
    weight = np.exp(-0.5 * ((a + b - shape["centre"]) / 0.8) ** 2) / (1 + (gap / shape["width"]) ** 2)
    weight /= weight.sum()
    x = np.clip(p / world.line.top, -0.1, 1.2)
    turning = _turning(x)
    state = -np.ones(len(a))
    out = np.empty(len(x))
    for start, stop in pairwise(turning):
        rising = x[stop] > x[start]
        piece = x[start : stop + 1]
        if rising:
            change = np.where(state < 0, a, np.inf)
        else:
            change = np.where(state > 0, -b, np.inf)
            piece = -piece
        order = np.argsort(change)
        summed = np.concatenate([[0.0], np.cumsum(weight[order])]) * (2 if rising else -2)
        out[start : stop + 1] = state @ weight + summed[np.searchsorted(change[order], piece)]
        state = np.where(change <= piece[-1], 1.0 if rising else -1.0, state)
    # steps between relays are smoothed over their pitch, as a real distribution would
    edges = np.arange(m + 1) / m
    up = np.array([weight @ np.where(a <= v, 1.0, -1.0) for v in edges])
    down = np.array([weight @ np.where(b < v, 1.0, -1.0) for v in edges])
    middle = np.interp(x, edges, 0.5 * (up + down))
    return p + size * world.line.top * 0.5 * (_bridge(x, out, turning, 1.0 / m) - middle)


def _turning(x: np.ndarray) -> np.ndarray:
    """Indices of the monotone stretches' ends, first and last included."""
    d = np.diff(x)
    way = np.sign(d)
    moving = np.nonzero(way)[0]
    changes = moving[1:][way[moving][1:] != way[moving][:-1]]
    return np.unique(np.concatenate([[0], changes, [len(x) - 1]]))


def _bridge(x: np.ndarray, y: np.ndarray, turning: np.ndarray, pitch: float) -> np.ndarray:
    """Piecewise constant y(x) on each monotone stretch made linear over `pitch` in x."""
    out = y.copy()
    for start, stop in pairwise(turning):
        piece = slice(start, stop + 1)
        jumps = start + 1 + np.nonzero(np.abs(np.diff(y[piece])) > 0)[0]
        points = np.concatenate([[start], jumps, [stop]])
        path = np.abs(x[piece] - x[start])
        if len(points) > 2 and path[-1] > pitch:
            at, first = np.unique(np.abs(x[points] - x[start]), return_index=True)
            out[piece] = np.interp(path, at, y[points][first])
    return out


def _duhem(p: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Coleman-Hodgdon: z' = alpha |x'| (g(x) - z), the backbone g curved; lost pressure = size top z."""
    x = p / world.line.top
    g = np.tanh(shape["bend"] * (x - 0.5)) / np.tanh(0.5 * shape["bend"])
    move = np.abs(np.diff(x, prepend=x[0]))
    decay = np.exp(-shape["alpha"] * move).tolist()
    target = (g + np.where(np.diff(x, prepend=x[0]) >= 0, 1.0, -1.0)).tolist()
    z = np.empty(len(x))
    now = float(g[0])
    for i in range(len(x)):
        now = target[i] + (now - target[i]) * decay[i]
        z[i] = now
    return p - size * world.line.top * (z - g)


def _rub(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Dahl: sliding on a wall holds the angle back by z, z' = y'(1 - sgn(y') z / c)^i, c grows with y."""
    span = world.base.span
    c = (size * span * (1 - shape["load"] + shape["load"] * np.clip(y / span, 0, 2))).tolist()
    move = np.diff(y, prepend=y[0]).tolist()
    z, out = 0.0, np.empty(len(y))
    for i in range(len(out)):
        limit, d = max(c[i], 1e-9 * span), move[i]
        parts = 1 + int(abs(d) / (0.2 * limit))
        for _ in range(min(parts, 50)):
            free = 1 - np.copysign(1.0, d) * z / limit
            z += d / min(parts, 50) * np.copysign(abs(free) ** shape["power"], free)
        z = min(max(z, -limit), limit)
        out[i] = z
    return y - out


def _power_creep(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Springpot in series: y + size * integral ((t - s) / 60 s)^alpha dy(s), on a coarse grid."""
    t = world.line.time
    rows = np.unique(np.concatenate([np.arange(0, len(t), 12), [len(t) - 1]]))
    tc, yc = t[rows], y[rows] - y[0]
    rate = np.diff(yc) / np.diff(tc)
    n = shape["alpha"] + 1
    out = np.zeros(len(rows))
    for start in range(0, len(rows), 500):
        at = tc[start : start + 500, None]
        kernel = np.maximum(at - tc[None, :-1], 0.0) ** n - np.maximum(at - tc[None, 1:], 0.0) ** n
        out[start : start + 500] = kernel @ rate / (n * 60.0 ** (n - 1))
    return y + size * np.interp(t, tc, out)


def _eyring_creep(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Eyring flow towards `size` of the output: fast while much is left, then slower and slower (log-like).

    c' = (size span / tau) sinh(3 g) / 10, g = (size (y - y0) - c) / (size span).
    """
    step, unit = world.line.step.tolist(), size * world.base.span
    c, out = 0.0, np.empty(len(y))
    for i, aim in enumerate((size * (y - y[0])).tolist()):
        gap = (aim - c) / unit
        rate = np.sinh(3 * max(abs(gap), 1e-3)) / (10 * shape["tau"] * max(abs(gap), 1e-3))
        c += (aim - c) * (1 - np.exp(-min(rate * step[i], 50.0)))
        out[i] = c
    return y + out


def _dashpot(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """A shear-thinning dashpot: x' = (e / size) (|e| / span / 0.1)^(m - 1), e what is still to go."""
    step, span, m = world.line.step.tolist(), world.base.span, shape["power"]
    x, last, out = float(y[0]), float(y[0]), np.empty(len(y))
    for i, aim in enumerate(y.tolist()):
        e = 0.5 * (aim + last) - x
        rate = (max(abs(e) / span / 0.1, 1e-3)) ** (m - 1) / size
        x += e * (1 - np.exp(-min(rate * step[i], 50.0)))
        last = aim
        out[i] = x
    return out


def _swing(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """A mass on a hardening spring with quadratic damping; `size` is the period (s) at rest."""
    w, zeta, span = 2 * np.pi / size, shape["zeta"], world.base.span
    x, v, out = float(y[0]), 0.0, np.empty(len(y))
    step, last = world.line.step.tolist(), float(y[0])
    for i, aim in enumerate(y.tolist()):
        if step[i] > 0.1:
            x, v = aim, 0.0
        else:
            parts = 1 + int(step[i] * w / 0.15)
            h = step[i] / parts
            for k in range(parts):
                e = last + (aim - last) * (k + 0.5) / parts - x
                force = w * w * e * (1 + 0.5 * (e / span) ** 2)
                drag = 2 * zeta * w * (1 + shape["square"] * abs(v) / (w * span))
                v = (v + h * force) / (1 + h * drag)
                x += h * v
        last = aim
        out[i] = x
    return out


_SOFTENING = np.array([0.0, 0.05, 0.22, 0.5, 0.78, 0.94, 1.0])


def _softened(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Table-driven Mullins: below the largest pressure so far it bends further by a tabulated bump."""
    x = np.clip(world.pressure / world.line.top, 0, None)
    most = np.maximum.accumulate(x)
    amount = np.interp(most, np.linspace(0, 1, len(_SOFTENING)), _SOFTENING)
    inside = np.clip(x / np.maximum(most, 1e-9), 0, 1)
    bump = inside ** shape["low"] * (1 - inside ** shape["high"])
    return y + size * world.base.span * amount * bump * most**0.5


def _worn(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Fatigue: the gain changes with the logarithm of the cycles, counted by the pressure's path."""
    path = np.cumsum(np.abs(np.diff(world.pressure, prepend=world.pressure[0]))) / world.line.top
    cycles = path / 2
    return y * (1 + shape["sign"] * size * np.log10(1 + cycles / shape["first"]))


def _warmed(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """Arrhenius softening: gain exp(size (T - T0)) with the body's temperature."""
    assert world.line.temperature is not None
    return y * np.exp(size * (world.line.temperature - world.line.temperature[0]))


def _peeled(y: np.ndarray, world: World, size: float, shape: Shape) -> np.ndarray:
    """The layer comes off: a crack that runs while the pressure is over a threshold, from a moment on."""
    x = world.pressure / world.line.top
    seen = np.nonzero(world.line.seen)[0]
    begin = world.line.time[seen[int(shape["moment"] * (len(seen) - 1))]]
    drive = np.where((world.line.time >= begin) & (x > shape["onset"]), x - shape["onset"], 0.0)
    crack = 1 - np.exp(-np.cumsum(drive * world.line.step) / (0.15 * shape["run"]))
    return y * (1 - size * crack)


def _loops(rng: np.random.Generator) -> dict[str, float]:
    return {"centre": float(rng.uniform(0.6, 1.4)), "width": log_uniform(rng, 0.06, 0.3)}


def _hodgdon(rng: np.random.Generator) -> dict[str, float]:
    return {"bend": float(rng.uniform(0.3, 2.5)), "alpha": log_uniform(rng, 4, 25)}


RUBBER = [
    Physics("hysteresis", "chamber", (0.01, 0.06), (0.04, 0.2), _loops, _relays),
    Physics("hysteresis", "chamber", (0.01, 0.06), (0.04, 0.2), _hodgdon, _duhem),
    Physics(
        "friction",
        "output",
        (0.01, 0.05),
        (0.01, 0.05),
        lambda rng: {"load": float(rng.uniform(0.2, 0.9)), "power": float(rng.uniform(0.8, 2.0))},
        _rub,
    ),
    Physics(
        "creep",
        "output",
        (0.01, 0.08),
        (0.05, 0.25),
        lambda rng: {"alpha": log_uniform(rng, 0.1, 0.5)},
        _power_creep,
    ),
    Physics(
        "creep",
        "output",
        (0.01, 0.08),
        (0.05, 0.25),
        lambda rng: {"tau": log_uniform(rng, 1.0, 15.0)},
        _eyring_creep,
    ),
    Physics(
        "viscous-lag",
        "output",
        (0.03, 0.3),
        (0.05, 0.6),
        lambda rng: {"power": float(rng.uniform(0.75, 1.3))},
        _dashpot,
    ),
    Physics(
        "inertia",
        "output",
        (0.125, 1.0),
        (0.125, 1.0),
        lambda rng: {"zeta": log_uniform(rng, 0.08, 0.4), "square": float(rng.uniform(0, 0.5))},
        _swing,
        "steps",
    ),
    Physics(
        "mullins",
        "output",
        (0.02, 0.1),
        (0.1, 0.3),
        lambda rng: {"low": float(rng.uniform(0.6, 1.2)), "high": float(rng.uniform(0.8, 3.0))},
        _softened,
        "virgin",
    ),
    Physics(
        "fatigue",
        "output",
        (0.01, 0.1),
        (0.01, 0.15),
        lambda rng: {"sign": float(rng.choice([-1, 1])), "first": log_uniform(rng, 0.5, 4)},
        _worn,
    ),
    Physics("temperature", "output", (0.001, 0.004), (0.005, 0.015), nothing, _warmed, "long"),
    Physics(
        "delamination",
        "output",
        (0.1, 0.4),
        (0.1, 0.4),
        lambda rng: {
            "moment": float(rng.uniform(0.2, 0.6)),
            "onset": float(rng.uniform(0.5, 0.8)),
            "run": float(rng.uniform(0.3, 1.5)),
        },
        _peeled,
    ),
]
