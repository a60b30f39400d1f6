"""Draw a case by tier, number and seed: actuator, protocol, effects of a visible size, noise.

The size of an effect is what is left of it, RMS over all records as a share of the span, after the base model
has been refitted as `diagnose` refits it (gain and offset; four parameters and offset).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.loop.base import Base, draw_base
from benchmarks.loop.body import BODY
from benchmarks.loop.classes import one_class
from benchmarks.loop.noise import FAULTS, Noise, draw_noise
from benchmarks.loop.physics import Physics, World, log_uniform
from benchmarks.loop.rubber import RUBBER
from benchmarks.loop.sensing import SENSING
from benchmarks.loop.session import PROTOCOLS, Line, Plan, plan, time_line, with_temperature
from benchmarks.loop.strange import STRANGE
from benchmarks.loop.supply import SUPPLY

KNOWN = [*SUPPLY, *RUBBER, *BODY, *SENSING]
TIERS = ("null", "single", "pair", "strange", "distractor", "placebo")
PLACEBO = {
    "hysteresis",
    "friction",
    "creep",
    "viscous-lag",
    "pressure-lag",
    "dead-band",
    "mullins",
    "contact",
}
SIZES = (0.01, 0.03, 0.06)
ORDER = ("supply", "chamber", "map", "output", "sensor")
NOT_ON_ELEMENTS = {"gravity", "payload", "creep", "viscous-lag", "wall-thickness", "sensor-drift", "inertia"}


@dataclass(frozen=True)
class Effect:
    """One effect of a case: its physics, size, shape, and how much of it shows."""

    physics: Physics
    size: float
    shape: dict[str, float]
    visible: float = 0.0


@dataclass(frozen=True)
class Case:
    """Everything about one case; `rate` Hz of the records; `logged` whether temperature and payload are."""

    name: str
    seed: int
    tier: str
    protocol: str
    target: float
    base: Base
    plans: list[Plan]
    line: Line
    effects: tuple[Effect, ...]
    noise: Noise
    rate: float
    logged: bool
    history: str
    holdout: tuple[str, ...]


def response(base: Base, line: Line, effects: Sequence[Effect]) -> tuple[np.ndarray, np.ndarray]:
    """Chamber pressure (n,) Pa and output (n,) of the true actuator over the line."""
    ordered = sorted(effects, key=lambda e: ORDER.index(e.physics.slot))
    p = line.command
    measured = p
    for e in ordered:
        if e.physics.slot in ("supply", "chamber"):
            p = e.physics.act(p, World(line, base, p), e.size, e.shape)
        if e.physics.slot == "supply":
            measured = p
    y = base.respond(line, p)
    for e in ordered:
        if e.physics.slot not in ("supply", "chamber"):
            y = e.physics.act(y, World(line, base, p), e.size, e.shape)
    return measured, y


def observed(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Chamber pressure and output. In a placebo each record shows what the effect did to another."""
    chamber, output = response(case.base, case.line, case.effects)
    if case.tier != "placebo":
        return chamber, output
    _, plain = response(case.base, case.line, ())
    shown, record = plain.copy(), case.line.record
    for k in range(len(case.plans)):
        other = np.nonzero(record == (k + 3) % len(case.plans))[0]
        rows = np.nonzero(record == k)[0]
        at = np.linspace(0, len(other) - 1, len(rows)).round().astype(int)
        shown[rows] += (output - plain)[other[at]]
    return case.line.command, shown


def refit_columns(base: Base, line: Line) -> np.ndarray:
    """Directions that the refit of the base model takes away, (seen, columns)."""
    plain = base.respond(line, line.command)
    columns = [plain, np.ones(len(plain))]
    for k in range(len(base.springs)):
        moved = replace(base, springs=tuple(v * (1.02 if i == k else 1) for i, v in enumerate(base.springs)))
        columns.append(moved.respond(line, line.command) - plain)
    return np.column_stack(columns)[line.seen]


def visible(y: np.ndarray, base: Base, line: Line, columns: np.ndarray) -> float:
    """RMS of what the refit leaves, as a share of the span."""
    seen = y[line.seen]
    scale = np.abs(columns).max(axis=0)
    left = seen - columns / scale @ np.linalg.lstsq(columns / scale, seen, rcond=None)[0]
    return float(np.sqrt(np.mean(left**2)) / base.span)


def sized(
    physics: Physics, shape: dict[str, float], target: float, base: Base, line: Line, size: float
) -> Effect:
    """The effect at the size whose visible share is the target, within three times its usual range."""
    low, high = physics.usual(base.material)
    columns = refit_columns(base, line)

    def seen(trial: float) -> float:
        return visible(response(base, line, [Effect(physics, trial, shape)])[1], base, line, columns)

    left, right = np.log(low / 3), np.log(high * 3)
    value = seen(size)
    for _ in range(12):
        if abs(value / target - 1) < 0.05:
            break
        left, right = (np.log(size), right) if value < target else (left, np.log(size))
        guess = np.log(size) + np.clip(np.log(target / max(value, 1e-9)), -1.5, 1.5)
        size = float(np.exp(guess if left < guess < right else 0.5 * (left + right)))
        value = seen(size)
    return Effect(physics, size, shape, value)


def possible(physics: Physics, protocol: str, kind: str) -> bool:
    """Whether the protocol can show it at all, and the base model can carry it."""
    if physics.needs in ("steps", "holds") and protocol in ("A", "B"):
        return False
    if kind == "kelvin-voigt" and physics.name in NOT_ON_ELEMENTS:
        return False
    return not (protocol == "D+" and physics.name == "dead-band" and physics.slot == "chamber")


def draw_case(
    tier: str,
    number: int,
    seed: int,
    protocol: str | None = None,
    among: Collection[str] = (),
    base: Base | None = None,
) -> Case:
    """Case `number` of a tier; same numbers, same case. `among`: effects it may have; `base`: if given."""
    rng = np.random.default_rng([seed, number, TIERS.index(tier)])
    kind = "kelvin-voigt" if tier in ("null", "single") and rng.random() < 0.12 else "curve"
    usual = PROTOCOLS[3:] if tier == "placebo" else PROTOCOLS
    protocol = protocol or usual[number % len(usual)]
    kind = "curve" if base is not None else kind
    base = base or draw_base(rng, kind)
    faults: tuple[str, ...] = ()
    if tier == "distractor":
        faults = tuple(str(f) for f in rng.choice(FAULTS, size=int(rng.integers(1, 4)), replace=False))
    noise = draw_noise(rng, faults)
    count = {"null": 0, "pair": 2, "distractor": int(rng.random() < 0.6)}.get(tier, 1)
    size = SIZES[min(int(rng.random() * 2.5), 2)]
    if tier == "strange":
        size = max(size, 0.03)
    for _ in range(60):
        library = STRANGE if tier == "strange" else KNOWN
        if tier == "placebo" or among:
            library = [c for c in library if c.name in (among or PLACEBO)]
        chosen = _choose(rng, library, count, protocol, kind)
        names = {c.name for c in chosen}
        plans, line, logged = _session(rng, names, protocol, base, kind)
        effects = tuple(
            sized(c, c.draw(rng), size, base, line, log_uniform(rng, *c.usual(base.material))) for c in chosen
        )
        if all(0.7 * size <= e.visible <= 1.6 * size for e in effects):
            break
    else:
        raise RuntimeError(f"no effect of {tier} {number} {seed} shows at {size}")
    virgin = any(e.physics.needs == "virgin" for e in effects)
    history = "virgin" if virgin else str(rng.choice(["cycled", "virgin"]))
    held = _held_out(rng, plans, protocol)
    name = f"{tier}-{seed}-{number:04d}"
    rate = float(rng.choice([20.0, 25.0, 50.0]))
    return Case(
        name,
        seed,
        tier,
        protocol,
        size,
        base,
        plans,
        line,
        effects,
        noise,
        rate,
        logged,
        history,
        held,
    )


def _choose(
    rng: np.random.Generator, library: list[Physics], count: int, protocol: str, kind: str
) -> list[Physics]:
    """Effects of different classes, names equally often."""
    names = sorted({c.name for c in library if possible(c, protocol, kind)})
    found: list[Physics] = []
    while len(found) < count:
        name = str(rng.choice(names))
        if any(one_class(name, other.name) or one_class(other.name, name) for other in found):
            continue
        forms = [c for c in library if c.name == name and possible(c, protocol, kind)]
        found.append(forms[int(rng.integers(len(forms)))])
    return found


def _session(
    rng: np.random.Generator, names: set[str], protocol: str, base: Base, kind: str
) -> tuple[list[Plan], Line, bool]:
    """Records, time line, and whether temperature or payload is written into them."""
    long_rests = "temperature" in names or bool(rng.random() < 0.4)
    way = float(rng.choice([0.0, 0.0, np.pi / 2, np.pi]))
    if names & {"gravity", "payload"}:
        way = float(rng.choice([0.0, 0.0, np.pi]))
    plans = plan(protocol, rng, way, long_rests)
    rich = protocol == "D+"
    logged = rich or bool(rng.random() < 0.5)
    payload = np.zeros(len(plans))
    if "payload" in names:
        payload[:] = float(rng.choice([0.01, 0.02, 0.05]))
        if rich:
            payload[1 : len(plans) : 3] = 0.0
        plans = [replace(item, payload=float(m)) for item, m in zip(plans, payload, strict=True)]
    line = time_line(plans, base.top, payload)
    swing = rng.uniform(10.0, 22.0) if "temperature" in names else rng.uniform(0.2, 1.5)
    return plans, with_temperature(line, _warm(rng, line, swing)), logged


def _warm(rng: np.random.Generator, line: Line, swing: float) -> np.ndarray:
    """Temperature of the actuator, K: a room that warms up or breathes, a body that follows it late."""
    t = line.time / line.time[-1]
    room = 1 - np.exp(-3 * t) if rng.random() < 0.5 else np.sin(np.pi * t * rng.uniform(0.6, 1.6))
    late = 0.08 * line.time[-1]
    body, now = np.empty(len(t)), 0.0
    keep = np.exp(-line.step / late)
    for i in range(len(t)):
        now = room[i] + (now - room[i]) * keep[i]
        body[i] = now
    return 294.0 + swing * body / max(np.ptp(body), 1e-9)


def _held_out(rng: np.random.Generator, plans: list[Plan], protocol: str) -> tuple[str, ...]:
    """Named records for half of the cases; else none, and `diagnose` chooses."""
    if rng.random() < 0.5:
        return ()
    if protocol in ("A", "B", "C"):
        return (plans[-1].name,)
    names = ["steps", "middle" if rng.random() < 0.5 else "fast"]
    return (*names, "flipped2") if protocol == "D+" else tuple(names)
