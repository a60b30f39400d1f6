"""The last word of FE: a deck solved again with an effect switched on in it, in place of the effect's block.

Gravity and a payload as dead loads in each record's orientation, a base that turns under their moment, walls
scaled as `calibrate` scales them, a plane in the tip's way. One number of each is fitted, together with gain,
offset and the other effects, over the deck's answers at the values solved so far; the deck is solved at what
was found, and so on.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from fem_spa.errors import InputError
from fem_spa.loop.base import Base
from fem_spa.loop.base_fem import STANDARD, DeckModel, Map, at
from fem_spa.loop.compose import Chain, around
from fem_spa.loop.data import Data
from fem_spa.loop.fit import fit, polished, project
from fem_spa.loop.loads import PAYLOAD
from fem_spa.loop.model_file import Source
from fem_spa.loop.noise import Whitener
from fem_spa.loop.screen import base_columns
from fem_spa.loop.search import theta_columns
from fem_spa.reduced.curve import Curve
from fem_spa.reduced.model import ReducedModel
from fem_spa.units import show
from geometry.errors import GeometryError
from materials.errors import MaterialError

SOLVES = 3
"""Values of an effect's number that a deck is solved at, at most."""
NEAR = 0.02
"""Share of the number by which it may still move; or a quarter of its standard error."""
AS_GOOD = 1.05
"""Squared training error, over the block's, up to which the deck has the last word."""
APART = 0.15
"""Share of a number from which two values of it are not the same for a parabola through them."""
_WRONG = (InputError, GeometryError, MaterialError)
STRUCTURAL = ("gravity", "payload", "base-compliance", "wall-thickness", "contact")
WEIGHT = ("gravity", "payload", "base-compliance")
"""Those that every orientation of the records is solved for."""


@dataclass(frozen=True)
class Form:
    """One number that is switched on in a deck.

    Attributes
    ----------
    words : what the deck then is
    number, unit : as shown;  show : from the value fitted
    low, high, first : of the value; zero is the deck as it is, but where there are `gaps`
    model : value -> the model, not solved yet
    gaps : pressures (k,) Pa and the gap, as the value has it, that the free deck closes there
    """

    words: str
    number: str
    unit: str
    show: Callable[[float], float]
    low: float
    high: float
    first: float
    model: Callable[[float], DeckModel]
    gaps: tuple[np.ndarray, np.ndarray] | None = None


@dataclass(frozen=True)
class Solved:
    """An effect in both its forms.

    Attributes
    ----------
    role : "named" or "rival";  words : the deck, or why there is none
    parameter : number, value, unit, low, high; None where the deck was not solved
    block, deck : RMSE of training rows and of rows held out, SI
    used : whether the deck has the last word
    """

    name: str
    role: str
    words: str
    parameter: dict[str, Any] | None = None
    block: tuple[float, float] | None = None
    deck: tuple[float, float] | None = None
    used: bool = False


@dataclass(frozen=True)
class Work:
    """What a fit needs: thinned and full rows, the noise; `provisional`: one record only.

    `until`: of `time.perf_counter`, by when all solves are to be done; None: they take what they take.
    """

    source: Source
    data: Data
    full: Data
    whiten: Whitener
    provisional: bool = False
    until: float | None = None


def deck_word(work: Work, chain: Chain, name: str) -> tuple[Chain, Source, Solved]:
    """The chain with `name` in the deck where that is as good, the source it is of, and the comparison.

    chain : with the block of `name`, fitted
    """
    source, data = work.source, work.data
    assert source.deck is not None
    block = (_rmse(chain, work.full, True), _rmse(chain, work.full, False))
    kept = chain, source
    late = _too_long(work, name)
    if late is not None:
        return *kept, Solved(name, "named", late, None, block)
    theta = next(t for e, t in zip(chain.effects, chain.thetas, strict=True) if e.name == name)
    try:
        form = form_of(name, theta, source.deck, data, chain)
        if isinstance(form, str):
            return *kept, Solved(name, "named", form, None, block)
        pairs = [(e, t) for e, t in zip(chain.effects, chain.thetas, strict=True) if e.name != name]
        rest = chain.with_effects([e for e, _ in pairs], [t for _, t in pairs])
        best, model, value, error = _fitted(work, form, rest)
    except _WRONG as reason:
        return *kept, Solved(name, "named", f"not solved: {reason}", None, block)
    ends = [form.show(float(np.clip(value + k * error, form.low, form.high))) for k in (-1.96, 1.96)]
    parameter = {
        "name": form.number,
        "value": form.show(value),
        "unit": form.unit,
        "low": min(ends),
        "high": max(ends),
    }
    found = (_rmse(best, work.full, True), _rmse(best, work.full, False))
    inside = form.low + 1e-3 < value < form.high - 1e-3
    used = inside and mean_square(best, data) <= AS_GOOD * mean_square(chain, data)
    told = Solved(name, "named", form.words, parameter, block, found, used)
    if not used:
        return *kept, told
    return best, replace(source, model=cast(ReducedModel, model), deck=model), told


def _too_long(work: Work, name: str) -> str | None:
    """Why a deck is not solved again for a name, None where there is time enough."""
    if work.until is None or name not in STRUCTURAL:
        return None
    assert work.source.deck is not None
    turns = len(np.unique(np.round(work.data.orientation, 6))) if name in WEIGHT else 1
    expected = SOLVES * turns * work.source.deck.solve.seconds
    if time.perf_counter() + expected <= work.until:
        return None
    return f"not solved: about {expected / 60:.0f} min more; model.forms = 'set' takes that time"


def form_of(name: str, theta: np.ndarray, deck: DeckModel, data: Data, chain: Chain) -> Form | str:
    """How a deck carries an effect, or why it does not."""
    if name in ("chamber-gain", "cross-coupling"):
        return "the deck's own map at the pressures so changed: nothing to solve again"
    if name not in STRUCTURAL:
        return "not of the structure: no deck has it"
    if name in ("gravity", "payload") and deck.solve.frame() is None:
        return "the deck's tip does not turn, so that weight has no way to act on it"
    if name == "gravity":
        if deck.gravity or any(deck.solve.deck.loads.gravity or ()):
            return "the deck has gravity already"
        change = lambda v: deck.changed(gravity=v)  # noqa: E731
        return Form("the deck with gravity", "weight", "of its weight", lambda v: v, 0.0, 3.0, 1.0, change)
    if name == "payload":
        return _payload(deck, data)
    if name == "base-compliance":
        return _base(theta, deck, data, chain)
    if name == "wall-thickness":
        first = float(np.clip(0.6 * (theta[0] - theta[1]), -0.15, 0.2)) or 0.05
        return Form(
            "the deck with other walls",
            "walls",
            "times as thick",
            lambda v: 1.0 + v,
            -0.3,
            0.35,
            first,
            lambda v: deck.changed(solve=deck.solve.with_walls(1.0 + v)),
        )
    return _contact(theta, deck, data, chain)


def _payload(deck: DeckModel, data: Data) -> Form:
    most = float(data.payload.max())

    def change(v: float) -> DeckModel:
        if most > 0.0:
            return deck.changed(payload_share=deck.payload_share + v * PAYLOAD / most)
        return deck.changed(payload=deck.payload + v * PAYLOAD)

    words = "the deck with a dead load at its tip"
    return Form(words, "payload", "g", lambda v: 1e3 * PAYLOAD * v, 0.0, 5.0, 0.5, change)


def _base(theta: np.ndarray, deck: DeckModel, data: Data, chain: Chain) -> Form | str:
    """A clamp on a spring; the value is its turn in rad under the moment of the level body at rest."""
    if deck.solve.deck.supports.base_compliance is not None:
        return "the deck's base turns under its moment already"
    own = deck.solve.deck.loads
    mass = deck.payload + deck.payload_share * float(data.payload.max())
    pull = float(np.linalg.norm(own.gravity or 0.0)) + STANDARD * deck.gravity
    tip = float(np.linalg.norm([f.si for f in own.tip_force or ()])) + STANDARD * mass  # type: ignore[attr-defined]
    moment = deck.solve.moment(pull, tip)
    if moment == 0.0:
        return "a free deck without weight leaves no moment at its base: there is nothing to turn it"
    turned = abs(float(theta[0] * chain.scale[0] * chain.gain)) if chain.base.names == ("angle",) else 0.1

    def change(v: float) -> DeckModel:
        return deck.changed(solve=deck.solve.with_base(v / moment))

    return Form(
        "the deck on a base that turns under its moment",
        "compliance",
        "deg/(N*m)",
        lambda v: float(np.degrees(v / moment)),
        0.0,
        1.5,
        float(np.clip(turned, 0.02, 0.5)),
        change,
    )


def _contact(theta: np.ndarray, deck: DeckModel, data: Data, chain: Chain) -> Form | str:
    flatter, steeper, place, _ = theta
    if steeper > flatter:
        return "the slope grows: a wall in the way would make it fall"
    frame = deck.solve.frame()
    if frame is None or deck.chambers > 1:
        return "a wall in the tip's way is solved for decks of one network that bend"
    columns, rows = deck.solve.rows()
    pressure = 1e3 * rows[:, next(i for i, c in enumerate(columns) if c.startswith("pressure"))]
    tip = 1e-3 * rows[:, [columns.index(f"tip {axis} [mm]") for axis in "xyz"]]
    gap = np.maximum.accumulate((tip - tip[0]) @ frame.across)
    seen = np.abs(pressure) <= 1.02 * data.p_max
    travel = float(gap[seen].max())
    if travel <= 0.0:
        return "the tip does not move that way"
    share = np.interp(pressure, pressure, np.asarray(deck.map_at(0.0, 0.0).at(pressure)))  # type: ignore[arg-type]
    reached = (share - share[0]) / float(chain.scale[0])
    first = float(np.clip(np.interp(place, np.maximum.accumulate(reached), gap) / travel, 0.05, 0.95))

    def change(v: float) -> DeckModel:
        where = frame.tip + (frame.reach + v * travel) * frame.across
        label = f"wall {1e3 * v * travel:.4g} mm away"
        return deck.changed(solve=deck.solve.with_plane(where, -frame.across, label))

    words = "the deck with a plane in its tip's way"
    gaps = (pressure[seen], gap[seen] / travel)
    return Form(words, "gap", "mm", lambda v: 1e3 * travel * v, 0.02, 0.98, first, change, gaps)


def _fitted(work: Work, form: Form, rest: Chain) -> tuple[Chain, DeckModel, float, float]:
    """The best chain on solved values alone, its model, the value, and its standard error."""
    data = work.data
    value, nodes = form.first, [(0.0, work.source.deck)] if form.gaps is None else []
    tried: list[tuple[float, Chain, DeckModel, float, float]] = []
    for _ in range(SOLVES):
        try:
            model = form.model(value)
            _reaching(model, data)
        except _WRONG:
            if not tried:
                raise
            break
        nodes.append((value, model))
        start = value if form.gaps is None else _scanned(work, form, rest, nodes)
        base = _based(work.source, _family(form, nodes, work.source.deck), form, start)
        found = fit(replace(rest, base=base), data, work.whiten, rest.effects, rest.thetas).chain
        error = _error(found, data, work.whiten)
        exact = _based(work.source, _family(form, [(value, model)], None), None, value)
        told = fit(replace(rest, base=exact), data, work.whiten, rest.effects, found.thetas).chain
        told = polished(told, data)
        tried.append((mean_square(told, data), told, model, value, error))
        new = float(np.clip(found.base.values[0], form.low, form.high))
        if abs(new - value) < max(NEAR * abs(value), 0.25 * min(error, 0.2 * abs(value))):
            break
        value = float(f"{new:.4g}")
    _, best, model, value, error = min(tried, key=lambda item: item[0])
    return best, model, value, error


def _reaching(model: DeckModel, data: Data) -> None:
    """Solve for every pose of the records; InputError where the deck then does not come as far as it did."""
    for run in data.runs:
        first = run.part.start
        found = model.map_at(float(data.orientation[first]), float(data.payload[first]))
        if isinstance(found, Curve) and found.points[-1, 0] < 0.97 * min(data.p_max, _end(model)):
            raise InputError(f"so changed the deck is solved up to {show(found.points[-1, 0], 'Pa')} only")


def _end(model: DeckModel) -> float:
    ends = (model.solve.deck.loads.pressure or {}).values()
    return max((abs(end.si) for end in ends), default=0.0)


Answer = Callable[[Data, np.ndarray, np.ndarray], np.ndarray]


def _family(form: Form, nodes: Sequence[tuple[float, Any]], free: DeckModel | None) -> Answer:
    """(data, pressures, (value,)) -> (n, 1), between what was solved; of one node its own, where `free` is
    None."""
    if free is None:
        return lambda data, pressure, values: _by_run(data, pressure, lambda pose: _plain(nodes[0][1], pose))
    if form.gaps is not None:
        value, model = nodes[-1]
        known = form.gaps
        return lambda data, pressure, values: _by_run(
            data,
            pressure,
            lambda pose: _walled(_map(free, pose), _map(model, pose), value, float(values[0]), known),
        )
    used = _spread(nodes)

    def smooth(data: Data, pressure: np.ndarray, values: np.ndarray) -> np.ndarray:
        shares = _lagrange([v for v, _ in used], float(values[0]))
        return _by_run(
            data,
            pressure,
            lambda pose: (
                lambda p: sum(w * at(_map(m, pose), p) for w, (_, m) in zip(shares, used, strict=True))
            ),
        )

    return smooth


def _mixed(maps: Sequence[Map], shares: Sequence[float]) -> Callable[[np.ndarray], Any]:
    """The sum of maps with these factors."""
    return lambda p: sum(w * at(m, p) for w, m in zip(shares, maps, strict=True))


def _spread(nodes: Sequence[tuple[float, Any]]) -> list[tuple[float, Any]]:
    """The deck as it is, the last one, and of the others the farthest from both."""
    first, last = nodes[0], nodes[-1]
    others = [n for n in nodes[1:-1] if min(abs(n[0] - last[0]), abs(n[0])) > APART * abs(last[0])]
    return [first, last, *others[-1:]]


def _lagrange(nodes: Sequence[float], x: float) -> list[float]:
    """Weights of values at nodes for the polynomial through them."""
    return [
        float(np.prod([(x - b) / (a - b) for j, b in enumerate(nodes) if j != i]))
        for i, a in enumerate(nodes)
    ]


def _walled(
    free: Map, walled: Map, value: float, wanted: float, known: tuple[np.ndarray, np.ndarray]
) -> Callable[[np.ndarray], np.ndarray]:
    """Free until the gap is closed, then as the solved one goes on from where its own gap was closed."""
    pressure, gap = known
    mine, other = (float(np.interp(g, gap, pressure)) for g in (wanted, value))

    def answer(p: np.ndarray) -> np.ndarray:
        x = p[:, 0]
        start = free.at(np.array([mine]))[0] - walled.at(np.array([other]))[0]
        return np.where(x < mine, free.at(x), start + walled.at(x - mine + other))

    return answer


def _map(model: DeckModel, pose: tuple[float, float]) -> Map:
    return replace(model.map_at(*pose), parameters=model.parameters)


def _plain(model: DeckModel, pose: tuple[float, float]) -> Callable[[np.ndarray], np.ndarray]:
    found = _map(model, pose)
    return lambda p: at(found, p)


def _by_run(
    data: Data, pressure: np.ndarray, of: Callable[[tuple[float, float]], Callable[[np.ndarray], Any]]
) -> np.ndarray:
    """(n, 1) record by record, each in its orientation, with its payload."""
    out = np.empty((len(pressure), 1))
    for run in data.runs:
        first = run.part.start
        pose = float(data.orientation[first]), float(data.payload[first])
        out[run.part, 0] = of(pose)(pressure[run.part])
    return out


def _based(source: Source, answer: Answer, form: Form | None, value: float) -> Base:
    """The deck as a base, its number among the base's values where `form` is given."""
    assert source.deck is not None
    names = tuple(o.name for o in source.model.outputs)
    units = tuple(o.unit for o in source.model.outputs)
    values, low, high = np.zeros((3, 0)) if form is None else np.array([[value], [form.low], [form.high]])
    base = Base(
        cast(ReducedModel, source.deck), names, units, True, (), values, low, high, answer, factor=True
    )
    return around(source.chain(base)) if source.effects else base


def _scanned(work: Work, form: Form, rest: Chain, nodes: Sequence[tuple[float, Any]]) -> float:
    """Where a wall fits best, tried over its whole range: its cost has more than one valley."""
    costs = {}
    for value in np.linspace(form.low, form.high, 25):
        base = _based(work.source, _family(form, nodes, work.source.deck), form, float(value))
        trial = replace(rest, base=base)
        response = trial.response(work.data, trial.thetas, base.values)
        left = project(work.whiten, trial, work.data.output, response)[0]
        costs[float(value)] = float(left @ left)
    return min(costs, key=lambda v: costs[v])


def _error(chain: Chain, data: Data, whiten: Whitener) -> float:
    """Standard error of the deck's number."""
    plain = chain.response(data, chain.thetas, chain.base.values)
    columns = np.concatenate([base_columns(chain, data, plain), theta_columns(chain, data)], axis=2)
    flat = whiten(columns).reshape(-1, columns.shape[2])
    gram = flat.T @ flat
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    inverse = np.linalg.pinv(gram / np.outer(size, size), rcond=1e-10, hermitian=True)
    k = 1 + plain.shape[1]  # gain and offsets come first
    return float(np.sqrt(max(inverse[k, k], 0.0)) / size[k])


def mean_square(chain: Chain, data: Data) -> float:
    """Plain squared error of the training rows."""
    rows = data.train & data.known
    return float(np.mean((data.output - chain.predict(data))[rows] ** 2))


def _rmse(chain: Chain, data: Data, train: bool) -> float:
    rows = data.known & (data.train if train else ~data.train)
    return (
        float(np.sqrt(np.mean((data.output - chain.predict(data))[rows] ** 2)))
        if rows.any()
        else float("nan")
    )
