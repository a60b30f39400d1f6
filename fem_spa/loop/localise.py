"""Where in the chain the fault lies: which slot's number, let wander, explains what the base leaves.

Every slot has knobs: a multiplier or an offset in it, with the model's sensitivity s(t) to it. A knob's value
b(t) may follow a random walk, residual = sum b(t) s(t) (after Kristensen, Madsen and Jorgensen 2004, Reichert
and Mieleitner 2009; linearised, so the walk's smoother is a penalised least squares on nodes). The size of
its steps is chosen, and the knobs are compared, by stretches of time left out; records' own offsets, which
differ by chance, are put aside. The knob at fault has a path that hardly wanders, or goes along with its
cause. This names no effect: it says where to look.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.effects.effect import SLOTS
from fem_spa.loop.operators import lowpass, play, running_max, travelled
from fem_spa.loop.screen import base_columns
from fem_spa.loop.walk import FEWEST, Walk, followed, record_means, walk_of

NEAR = 0.05
"""Slots that explain so much less than the best are not told apart from it."""
LEAST = 0.2
"""Share of the left-out residual below which no slot is said to be at fault."""
STEADY = 0.25
"""A path that wanders less than this share of its mean is steady."""


@dataclass(frozen=True)
class Place:
    """A slot, its best knob, and that knob's path.

    Attributes
    ----------
    slot, knob : name in the chain, and words
    explained : share of the squared residual on blocks left out; negative where it does harm
    along : what the path goes along with, and the share of its variance, best first; () for a steady one
    steady : whether a constant change is enough
    """

    slot: str
    knob: str
    explained: float
    along: tuple[tuple[str, float], ...]
    steady: bool


def localise(chain: Chain, data: Data) -> list[Place]:
    """The slots, best first; training rows only. Each keeps the better of its knobs."""
    plain = chain.response(data, chain.thetas, chain.base.values)
    residual = data.output - (chain.gain * plain + chain.offset)
    nuisance = np.concatenate([base_columns(chain, data, plain), _own_offsets(data)], axis=2)
    if sum(run.train and run.part.stop - run.part.start >= FEWEST for run in data.runs) == 0:
        return []
    walk = walk_of(data)
    known = _covariates(chain, data)
    best: dict[str, Place] = {}
    for slot, words, column in knobs(chain, data, plain):
        share, path, weight = followed(walk, column, nuisance, residual)
        if slot in best and best[slot].explained >= share:
            continue
        if slot == "sensor":
            path = path - record_means(walk, path, weight)
        steady = _steady(path, weight)
        along = () if steady else _along(path, weight, walk, known)
        best[slot] = Place(slot, words, share, along, steady)
    found = sorted(best.values(), key=lambda p: -p.explained)
    # a path that wanders can imitate what a steady one says as well with one number
    near = [p for p in found if p.steady and p.explained > found[0].explained - NEAR]
    return [*near, *(p for p in found if p not in near)]


def _own_offsets(data: Data) -> np.ndarray:
    """(n, d, c) an offset a training record and output; none where there is one record only."""
    d = data.output.shape[1]
    runs = [run for run in data.runs if run.train]
    out = np.zeros((len(data.output), d, d * len(runs) if len(runs) > 1 else 0))
    for k, run in enumerate(runs if len(runs) > 1 else ()):
        for j in range(d):
            out[run.part, j, k * d + j] = 1.0
    return out


def knobs(chain: Chain, data: Data, plain: np.ndarray) -> list[tuple[str, str, np.ndarray]]:
    """(slot, words, (n, d) sensitivity); a slot whose number the records cannot feel is left out."""
    u, rest = data.pressure, chain.rest

    def with_pressure(pressure: np.ndarray) -> np.ndarray:
        return chain.gain * (chain.response(data, chain.thetas, chain.base.values, pressure) - plain)

    def memory(kernel: np.ndarray) -> np.ndarray:
        return chain.gain * (plain - rest - kernel)

    found = []
    for tau in (0.15, 0.5, 2.0):
        found.append(
            ("input", f"a lag of the pressure of about {tau:g} s", with_pressure(lowpass(data, u, tau)))
        )
    found.append(("actuation", "the pressure from which it moves", with_pressure(u - 0.03 * chain.p_max)))
    for j in range(u.shape[1] if u.shape[1] > 1 else 0):
        more = u * np.where(np.arange(u.shape[1]) == j, 1.05, 1.0)
        found.append(("actuation", f"the gain of chamber {j + 1}", with_pressure(more)))
    found.append(("stiffness", "the stiffness", chain.gain * (plain - rest)))
    for words, radius in (("a state that turns with the direction", 0.05), ("a state that turns late", 0.25)):
        columns = [play(data, plain[:, j], radius * chain.scale[j], rest[j]) for j in range(plain.shape[1])]
        found.append(("state", words, memory(np.stack(columns, axis=1))))
    for tau in (0.5, 2.0, 10.0):
        found.append(("state", f"a state of about {tau:g} s", memory(lowpass(data, plain, tau, rest))))
    angle = np.stack([plain[:, j] * (name == "angle") for j, name in enumerate(chain.base.names)], axis=1)
    weight = np.where(
        np.array([n == "angle" for n in chain.base.names]),
        -np.sin(data.orientation[:, None] + 0.5 * angle),
        np.cos(data.orientation[:, None]) * np.ones_like(plain),
    )
    found.append(("load", "a weight", weight * chain.scale))
    share = (plain - rest) / chain.scale
    found.append(("load", "a load that grows with the motion", share * np.abs(share) * chain.scale))
    for j, name in enumerate(chain.base.names):
        one = np.zeros_like(plain)
        one[:, j] = chain.scale[j]
        found.append(("sensor", f"the zero of {name} within a record", one))
    rows = data.train & data.known
    size = 1e-6 * float(np.max(chain.scale))
    return [(s, w, c) for s, w, c in found if s in SLOTS and np.abs(c[rows]).max() > size]


def _steady(path: np.ndarray, weight: np.ndarray) -> bool:
    mean = float(weight @ path / weight.sum())
    return float(np.sqrt(weight @ (path - mean) ** 2 / weight.sum())) < STEADY * abs(mean)


def _covariates(chain: Chain, data: Data) -> dict[str, np.ndarray]:
    """Words -> (n,) what a path may go along with."""
    u = chain.context(data).drive
    found = {
        "the pressure": u,
        "its direction": u - play(data, u, 0.02),
        "the largest pressure so far": running_max(data, np.abs(u)),
        "the time": data.clock,
        "the number of cycles": travelled(data, u),
    }
    if data.temperature is not None:
        found["the temperature"] = data.temperature
    angle = chain.predict(data)[:, 0] if chain.base.names[0] == "angle" else np.zeros(len(u))
    if np.ptp(data.orientation) > 1e-9:
        found["the sine of the inclination"] = np.sin(data.orientation + angle)
    return {name: x for name, x in found.items() if np.ptp(x[data.train]) > 1e-9}


def _along(
    path: np.ndarray, weight: np.ndarray, walk: Walk, known: dict[str, np.ndarray]
) -> tuple[tuple[str, float], ...]:
    """Share of the path's (weighted) variance between six bins of each covariate, best two above a third."""
    node = walk.left + (walk.part > 0.5)
    count = np.maximum(np.bincount(node, minlength=walk.nodes), 1)
    found = []
    for name, values in known.items():
        x = np.bincount(node, values[walk.rows], walk.nodes) / count
        found.append((name, _between(path, x, weight)))
    found.sort(key=lambda item: -item[1])
    return tuple((name, share) for name, share in found[:2] if share > 0.33)


def _between(y: np.ndarray, x: np.ndarray, weight: np.ndarray, bins: int = 6) -> float:
    label = np.digitize(x, np.quantile(x, np.linspace(0.0, 1.0, bins + 1)[1:-1]))
    mean = float(weight @ y / weight.sum())
    whole = float(weight @ (y - mean) ** 2) or 1.0
    parts = 0.0
    for v in np.unique(label):
        w = weight[label == v]
        parts += float(w.sum()) * (float(w @ y[label == v] / max(w.sum(), 1e-300)) - mean) ** 2
    return parts / whole


def place_words(places: Sequence[Place]) -> str:
    """A clause for a person; empty where there is no slot to speak of."""
    if not places:
        return ""
    best = places[0]
    if best.explained < LEAST:
        return "no number of the chain, let wander, foretells it on stretches of time left out"
    near = [p.slot for p in places[1:] if p.explained > best.explained - NEAR]
    share = f"foretells {100 * best.explained:.0f} % of it on stretches of time left out"
    text = f"of the slots of the chain {best.slot} fits best: {best.knob}, {path_words(best)}, {share}"
    return text + (f" ({', '.join(near)} hardly less)" if near else "")


def path_words(place: Place) -> str:
    """What the knob's path does."""
    if place.steady:
        return "changed by a constant amount"
    if not place.along:
        return "wandering with nothing that is known"
    return "changing with " + " or ".join(name for name, _ in place.along)


def place_table(places: Sequence[Place]) -> list[dict[str, Any]]:
    """Rows for report.json, best first."""
    return [{"slot": p.slot, "knob": p.knob, "explained": p.explained, "path": path_words(p)} for p in places]
