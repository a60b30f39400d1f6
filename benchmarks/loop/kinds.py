"""Actuators of the other base kinds: chain, pneunet, rod and fem, one pressure or several.

The program is given the model file; the records come from the same kind of model with another stiffness
(rod: another clamp and number of elements too) and an effect that acts on pressures or outputs by the
generator's own physics (supply, rubber, sensing), or by a component that the file given leaves out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.loop.base import Base
from benchmarks.loop.physics import Physics, World
from benchmarks.loop.session import STEP, Line, Plan, time_line, triangle
from fem_spa.reduced.model import Drive, ReducedModel
from fem_spa.reduced.registry import read_model

PHYSICAL = "part of the actuator"
"""Form of an effect that is a component which the model file leaves out."""


@dataclass(frozen=True)
class Kind:
    """One kind of base model.

    Attributes
    ----------
    given : the `[model]` table that the program reads
    true : what differs in the actuator that the records are from
    parts : effect -> (what the file given has beside `given`, what the actuator has beside `true`)
    top : kPa, largest pressure a chamber;  outputs : name -> unit of the records
    stiff : parameters refitted together;  acts : generator's effects that may be laid over it
    turned : whether records in other orientations are among them;  hangs : kg undeclared, by effect
    """

    name: str
    given: Mapping[str, Any]
    true: Mapping[str, Any]
    top: tuple[float, ...]
    outputs: Mapping[str, str]
    stiff: tuple[str, ...]
    acts: tuple[str, ...]
    parts: Mapping[str, tuple[Mapping[str, Any], Mapping[str, Any]]] = field(default_factory=dict)
    turned: bool = False
    deck: str = ""

    @property
    def effects(self) -> tuple[str, ...]:
        return (*self.acts, *self.parts)


EVERY = ("hysteresis", "creep", "viscous-lag", "pressure-lag", "delay", "mullins", "saturation", "inertia")
SEVERAL = ("chamber-gain", "cross-coupling")
_FINGER = """[geometry]
shape = "pneunet"
size = "7 mm"
{geometry}
[materials.body]
card = "dragon-skin-30"
[layers.paper]
modulus = "2 GPa"
thickness = "0.1 mm"
[loads]
pressure = {pressure}
points = 8
"""

KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind(
            "chain",
            {"kind": "chain", "preset": "bending", "mass": "40 g"},
            {"k_layer": "1.12 N*m/rad", "k_theta": "1.23 N*m/rad"},
            (300.0,),
            {"angle": "deg"},
            ("k_theta", "k_layer"),
            (*EVERY, "dead-band", "sensor-nonlinearity"),
            {"gravity": ({"gravity": False}, {}), "payload": ({}, {})},
            True,
        ),
        Kind(
            "series",
            {
                "kind": "chain",
                "series": [
                    {"preset": "bending", "segments": 11},
                    {"preset": "bending", "segments": 11},
                ],
            },
            {
                f"k_{a}_{i}": v
                for a, v in (("layer", "1.31 N*m/rad"), ("theta", "1.44 N*m/rad"))
                for i in (1, 2)
            },
            (250.0, 250.0),
            {"angle": "deg"},
            tuple(f"k_{a}_{i}" for i in (1, 2) for a in ("theta", "layer")),
            (*EVERY, *SEVERAL),
            {"gravity": ({"gravity": False}, {})},
            True,
        ),
        Kind(
            "pneunet",
            {"kind": "pneunet"},
            {"stiffness": 1.12, "offset": "0.8 deg"},
            (70.0, 35.0),
            {"angle": "deg"},
            ("stiffness",),
            (*EVERY, *SEVERAL, "dead-band"),
        ),
        Kind(
            "rod",
            {"kind": "rod", "preset": "am-i-support"},
            {"clamp": "base", "elements": 24, "modulus": "1.75 MPa"},
            (300.0, 300.0, 300.0),
            {"x": "mm", "y": "mm", "z": "mm"},
            ("modulus",),
            ("creep", "hysteresis"),
            {
                "gravity": ({"gravity": False}, {}),
                "viscous-lag": ({"damping": False}, {}),
                "chamber-gain": ({"strain_gains": False}, {"strain_gains": [1.12, 0.95, 1.03]}),
                "dead-band+pressure-lag": ({"valve": False}, {}),
                "cross-coupling": ({}, {"cross_coupling": 0.06}),
                "payload": ({}, {}),
            },
            True,
        ),
        Kind(
            "fem",
            {"kind": "fem", "deck": "deck.toml"},
            {"gain": 0.94, "offset": "0.7 deg"},
            (40.0,),
            {"angle": "deg"},
            (),
            (*EVERY, "dead-band", "sensor-nonlinearity"),
            deck=_FINGER.format(geometry="fast_chambers = 0\nslow_chambers = 4", pressure='"50 kPa"'),
        ),
    )
}


@dataclass(frozen=True)
class Bench:
    """A case: what is on the bench and what was asked of it.

    Attributes
    ----------
    plans : records; knots (k, 1 + m): s, then each chamber's share of its largest pressure
    effect : name, "" where there is none;  visible : share of the span that the refit leaves of it
    clean : record -> (time, (n, m) kPa, (n, d) outputs in the records' unit), no noise
    """

    kind: Kind
    seed: int
    plans: tuple[Plan, ...]
    effect: str
    visible: float
    given: Mapping[str, Any]
    payload: float
    clean: tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...]
    span: float


def plans_of(kind: Kind, rng: np.random.Generator) -> list[Plan]:
    """Records: each chamber alone, all together at three rates, a hold, levels at random."""
    m = len(kind.top)

    def of(name: str, knots: np.ndarray, weights: Sequence[float], way: float = 0.0) -> tuple[Any, ...]:
        return name, np.column_stack([knots[:, 0], np.outer(knots[:, 1], weights)]), way

    one = [1.0] * m
    hold = np.array([(0, 0), (1.0, 0), (1.3, 0.8), (21.0, 0.8), (21.3, 0.0), (27.0, 0.0)])
    found = [of(f"alone{j + 1}", triangle(10.0, 1), np.eye(m)[j]) for j in range(m)] if m > 1 else []
    found += [
        of("slow", triangle(16.0, 1), one),
        of("middle", triangle(6.0, 2, 0.7), one),
        of("fast", triangle(2.0, 5), one if m == 1 else [1.0, *[0.5] * (m - 1)]),
        of("hold", hold, one if m == 1 else [0.4, *[1.0] * (m - 1)]),
    ]
    for k in (1, 2):
        at, last, knots = 0.5, np.zeros(m), [(0.0, *np.zeros(m))]
        for _ in range(8):
            level = rng.uniform(0.0, 1.0, m)
            knots += [(at, *last), (at + 0.12, *level)]
            at, last = at + float(rng.uniform(1.0, 3.0)), level
        found.append((f"levels{k}", np.array([*knots, (at, *last)]), 0.0))
    if kind.turned:
        found.append(of("turned", triangle(8.0, 1), one if m == 1 else [0.2, *[0.9] * (m - 1)], np.pi / 2))
        found.append(of("turned2", triangle(5.0, 2), one if m == 1 else [1.0, *[0.3] * (m - 1)], np.pi / 2))
    plans, start = [], 0.0
    for name, knots, way in found:
        plans.append(Plan(name, knots, start, float(way)))
        start = float(np.round(start + knots[-1, 0] + rng.uniform(2.0, 8.0)))
    return plans


@cache
def fem_rows(deck: str) -> tuple[tuple[str, ...], tuple[tuple[float, ...], ...]]:
    """Columns and rows of the curve that a deck gives."""
    import tempfile

    from fem_spa.reduced.curve import read_columns
    from fem_spa.run import run_deck

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "deck.toml"
        path.write_text(deck, encoding="utf-8")
        run_deck(path, Path(folder) / "out", quiet=True)
        columns, rows = read_columns(Path(folder) / "out" / "curve.csv")
    return tuple(columns), tuple(map(tuple, rows.tolist()))


def actuator(kind: Kind, own: Mapping[str, Any]) -> ReducedModel:
    """The actuator that the records are from, with `own` beside what is always different."""
    if kind.deck:
        columns, rows = fem_rows(kind.deck)
        keep = [
            columns.index(c) for c in ("pressure slow [kPa]", "pressure [kPa]", "angle [deg]") if c in columns
        ]
        names = ["pressure [kPa]", "angle [deg]"]
        table = {"kind": "curve", "columns": names, "rows": [[row[i] for i in keep] for row in rows]}
        return read_model({"model": table | dict(kind.true) | dict(own)})
    return read_model({"model": dict(kind.given) | dict(kind.true) | dict(own)})


def moved(
    model: ReducedModel, line: Line, command: np.ndarray, payload: float, names: Sequence[str]
) -> np.ndarray:
    """(n, d) what the actuator does with the pressures (n, m) Pa, record by record, in SI."""
    columns = [[o.name for o in model.outputs].index(name) for name in names]
    out = np.zeros((len(command), len(columns)))
    for k in range(int(line.record.max()) + 1):
        rows = np.nonzero(line.record == k)[0]
        drive = Drive(line.time[rows], command[rows], float(line.orientation[rows[0]]), payload)
        out[rows] = model.simulate(drive)[:, columns]
    rest = np.nonzero(line.record < 0)[0]
    for j in rest.tolist():  # between records: unpressurised
        out[j] = out[max(j - 1, 0)] if j and line.record[j - 1] < 0 else out[0]
    return out


def draw(name: str, seed: int, effect: str | None, library: Sequence[Physics], target: float = 0.03) -> Bench:
    """A case of a kind; `effect` "" is none, None one by the seed."""
    kind = KINDS[name]
    rng = np.random.default_rng([seed, 5, list(KINDS).index(name)])
    if effect is None:
        effect = str(rng.choice(["", *kind.effects])) if seed % 4 else ""
    plans = plans_of(kind, rng)
    single = [replace(p, knots=p.knots[:, :2]) for p in plans]
    line = time_line(single, 1.0, np.zeros(len(plans)))
    m, tops = len(kind.top), 1e3 * np.array(kind.top)
    command = np.zeros((len(line.time), m))
    for k, plan in enumerate(plans):
        rows = line.record == k
        t = line.time[rows] - plan.start
        for j in range(m):
            command[rows, j] = tops[j] * np.interp(t, plan.knots[:, 0], plan.knots[:, 1 + j])
    given, true = kind.parts.get(effect, ({}, {}))
    payload = float(rng.uniform(0.02, 0.05)) if effect == "payload" else 0.0
    names, units = (
        list(kind.outputs),
        [1e3 if u == "mm" else np.degrees(1.0) for u in kind.outputs.values()],
    )
    body = actuator(kind, true)
    acts = [p for p in library if p.name == effect and effect in kind.acts]
    plain = moved(actuator(kind, given), line, command, 0.0, names)
    seen = line.seen
    span = float(np.ptp(plain[seen], axis=0).max())
    columns = _refit(kind, actuator(kind, given), line, command, plain, names)

    def answer(size: float) -> np.ndarray:
        p, y = command, None
        if effect == "chamber-gain" and not true:
            p = command * (1.0 + size * np.linspace(1.0, -0.6, m))
        elif effect == "cross-coupling" and not true:
            p = command + size * (command.sum(axis=1, keepdims=True) - command) / (m - 1)
        elif acts and acts[0].slot in ("supply", "chamber"):
            p = np.stack(
                [_acted(acts[0], size, shape, line, command[:, j], tops[j], tops[j]) for j in range(m)], 1
            )
        y = moved(body, line, p, payload, names)
        if acts and acts[0].slot not in ("supply", "chamber"):
            rest = y[0]
            y = rest + np.stack(
                [
                    _acted(acts[0], size, shape, line, y[:, j] - rest[j], tops[0], span, command[:, 0])
                    for j in range(y.shape[1])
                ],
                1,
            )
        return y

    def visible(y: np.ndarray) -> float:
        flat = (y - plain)[seen].ravel()
        left = flat - columns @ np.linalg.lstsq(columns, flat, rcond=None)[0]
        return float(np.sqrt(np.mean(np.sum(left.reshape(-1, len(names)) ** 2, axis=1)))) / span

    shape = acts[0].draw(rng) if acts else {}
    size = float(np.mean(acts[0].silicone)) if acts else 0.05
    y = answer(size)
    share = visible(y)
    if effect and not true and effect not in kind.parts:
        for _ in range(6):
            if abs(share / target - 1) < 0.1:
                break
            size *= float(np.clip(target / max(share, 1e-6), 0.3, 3.0))
            y = answer(size)
            share = visible(y)
    clean = []
    for k, plan in enumerate(plans):
        rows = np.nonzero(line.record == k)[0]
        clean.append((line.time[rows] - plan.start, 1e-3 * command[rows], y[rows] * np.array(units)))
    whole = dict(kind.given) | dict(given)
    return Bench(kind, seed, tuple(plans), effect, share, whole, payload, tuple(clean), span * units[0])


def _acted(
    physics: Physics,
    size: float,
    shape: Mapping[str, float],
    line: Line,
    signal: np.ndarray,
    top: float,
    span: float,
    pressure: np.ndarray | None = None,
) -> np.ndarray:
    """One column with the effect on it."""
    own = replace(line, command=signal, top=float(top))
    base = Base("kind", "silicone", float(span), float(top), (0, 0), 1.0, 0.0)
    return physics.act(signal, World(own, base, signal if pressure is None else pressure), size, shape)


def _refit(
    kind: Kind,
    model: ReducedModel,
    line: Line,
    command: np.ndarray,
    plain: np.ndarray,
    names: Sequence[str],
) -> np.ndarray:
    """(rows, c) what the refit of the base model takes away: stiffness (curves: gain) and an offset each."""
    if kind.stiff:
        softer = model.with_values(**{n: 0.98 * model.parameters[n].value for n in kind.stiff})
        change = moved(softer, line, command, 0.0, names) - plain
    else:
        change = plain
    d = len(names)
    ones = [np.tile(np.eye(d)[j], (int(line.seen.sum()), 1)).ravel() for j in range(d)]
    return np.column_stack([change[line.seen].ravel() / np.abs(change).max(), *ones])


__all__ = ["KINDS", "PHYSICAL", "STEP", "Bench", "Kind", "actuator", "draw", "plans_of"]
