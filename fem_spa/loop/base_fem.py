"""Kind "fem": the deck is solved once; the loop works on its curve, or a surface over several pressures.

[model]
kind = "fem"
deck = "finger.toml"
output = "angle"          # optional, as in kind "curve"; gain and offset likewise
gravity = 1.0             # share of its weight, in each record's orientation; solved for each of them
payload = "30 g"          # at the tip in every record;  payload_share: of what the records state
forms = "named"           # which effects the deck is solved again for: "set" (rivals too), "none"; without
                          # the key as "set", as long as that is quick (`deck_word.QUICK`)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from fem_spa.errors import InputError
from fem_spa.loop.deck_solve import SOLVES, DeckSolve, Loaded
from fem_spa.reduced.checks import check_drive
from fem_spa.reduced.curve import Curve, from_columns
from fem_spa.reduced.model import Drive, Output, Parameter, Range
from fem_spa.reduced.surface import Surface, surface
from fem_spa.reduced.tables import changed, common_table, read_parameters, refuse_unknown, shown
from fem_spa.units import brief, quantity

LEVELS = {2: 5, 3: 3}
"""Pressures a network that are solved, by the number of networks."""
STANDARD = 9.81
"""m/s^2"""
KEYS = ("deck", "output", "gain", "offset", "gravity", "payload", "payload_share", "forms")
FORMS = ("auto", "set", "named", "none")
Map = Curve | Surface


@dataclass(frozen=True, eq=False)
class DeckModel:
    """A deck as a model; what it does under a load is solved when it is asked for.

    Attributes
    ----------
    solve : the deck; with several networks loaded over a grid, whose pressures are `stops` (k, m) Pa
    output : name of the column, None: the first that varies
    gravity : share of its weight;  payload : kg;  payload_share : of what records state
    parameters : `gain` and `offset`
    """

    solve: DeckSolve
    stops: np.ndarray
    output: str | None
    outputs: tuple[Output, ...]
    parameters: Mapping[str, Parameter]
    valid: Range | None
    gravity: float = 0.0
    payload: float = 0.0
    payload_share: float = 0.0
    kind: str = "fem"
    maps: dict[tuple[float, float], Map] = field(default_factory=dict)

    @property
    def chambers(self) -> int:
        """One a network."""
        return max(self.stops.shape[1], 1)

    def with_values(self, **values: float) -> Self:
        """A copy with another gain or offset (SI)."""
        return replace(self, parameters=changed(self.parameters, values, self.kind))

    def changed(self, **changes: Any) -> Self:
        """A copy with another deck or loads; what was solved of this one is not its own."""
        return replace(self, maps={}, **changes)

    def map_at(self, orientation: float, stated: float) -> Map:
        """The map of records so inclined (rad), with a stated payload (kg); no gain, no offset."""
        mass = self.payload + self.payload_share * stated
        key = (round(orientation, 6) if self.gravity or mass else 0.0, round(mass, 9))
        if key not in self.maps:
            self.maps[key] = self._map(self._loaded(*key))
        return self.maps[key]

    def _loaded(self, orientation: float, mass: float) -> Loaded:
        if not (self.gravity or mass):
            return Loaded()
        frame = self.solve.frame()
        if frame is None:
            raise InputError(
                f"{self.solve.path.name}: its tip does not turn; gravity has no way to act on it"
            )
        down = STANDARD * frame.down(orientation)
        label = [f"gravity {self.gravity:.4g}"] if self.gravity else []
        label += [f"payload {1e3 * mass:.4g} g"] if mass else []
        own = tuple(float(f"{x:.12g}") for x in self.gravity * down) if self.gravity else None
        tip = tuple(float(f"{x:.12g}") for x in mass * down) if mass else None
        words = f"{' '.join(label)} at {np.degrees(orientation):.4g} deg"
        return Loaded(words, own, tip)  # type: ignore[arg-type]

    def _map(self, loaded: Loaded) -> Map:
        columns, rows = self.solve.rows(loaded)
        return map_of(columns, rows, self.stops, self.output, self.solve)

    def simulate(self, drive: Drive) -> np.ndarray:
        """(n, 1), the output at each row of pressures; no memory."""
        _, pressure = check_drive(drive, self.chambers, self.kind)
        found = at(self.map_at(drive.orientation, drive.payload), pressure)
        return np.asarray(self.parameters["gain"].value * found + self.parameters["offset"].value)[:, None]

    def table(self) -> dict[str, Any]:
        """The `[model]` table; the deck's path as it is here."""
        found: dict[str, Any] = common_table(self.kind, self.parameters, None, self.outputs)
        found |= {"deck": str(self.solve.path), "output": self.outputs[0].name}
        if self.gravity:
            found["gravity"] = float(f"{self.gravity:.10g}")
        if self.payload:
            found["payload"] = shown(self.payload, "g")
        if self.payload_share:
            found["payload_share"] = float(f"{self.payload_share:.10g}")
        return found


def at(given: Map, pressure: np.ndarray) -> np.ndarray:
    """(n,) of a map at pressures (n, m) Pa."""
    return given.at(pressure[:, 0]) if isinstance(given, Curve) else given.at(pressure)


def read_deck_model(
    table: Mapping[str, Any],
    where: Path,
    out: Path | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> DeckModel:
    """The deck of a `[model]` table, solved as it is or found among what was; paths from `where`.

    Several networks, each with an end of its own in the deck: a grid of pressures up to them, in one run.
    Records number their pressures as the deck's table of them is written.

    Parameters
    ----------
    out : folder of results whose solves are kept; None: they are not
    say : told of every solve

    Raises
    ------
    InputError
        for an unknown key, no deck, a deck that is wrong, or a run that does not give the map
    """
    refuse_unknown(table, KEYS)
    if not isinstance(table.get("deck"), str):
        raise InputError("given no model.deck: kind 'fem' needs the path of a deck, deck = 'finger.toml'")
    if table.get("forms", FORMS[0]) not in FORMS:
        raise InputError(f"given {brief(table['forms'])} for model.forms: allowed are {', '.join(FORMS)}")
    path = where / str(table["deck"])
    if not path.is_file():
        raise InputError(f"given {path} for model.deck: there is no such file")
    gravity = quantity(table.get("gravity", 0.0), "1", "model.gravity", low=0.0, high=10.0, zero=True)
    payload = quantity(table.get("payload", 0.0), "kg", "model.payload", low=0.0, high=10.0, zero=True)
    share = quantity(
        table.get("payload_share", 0.0), "1", "model.payload_share", low=0.0, high=10.0, zero=True
    )
    from fem_spa.deck import read_deck
    from fem_spa.deck_tables import Measure

    deck = read_deck(path)
    ends = {name: end.si for name, end in (deck.loads.pressure or {}).items()}
    stops = np.zeros((0, 1))
    if len(ends) > 1 and deck.loads.control == "pressure":
        if len(ends) not in LEVELS:
            raise InputError(f"given a deck of {len(ends)} networks: kind 'fem' takes at most {max(LEVELS)}")
        stops = serpentine([np.linspace(0.0, end, LEVELS[len(ends)]) for end in ends.values()])
        texts = [{n: f"{p:.10g} Pa" for n, p in zip(ends, stop, strict=True)} for stop in stops[1:]]
        last = {n: Measure(texts[-1][n], float(p)) for n, p in zip(ends, stops[-1], strict=True)}
        loads = deck.loads.model_copy(update={"pressure": last, "path": texts[:-1], "points": None})
        deck = deck.model_copy(update={"loads": loads})
    look = [where / SOLVES, *([] if out is None else [out / SOLVES])]
    keep = None if out is None else out / SOLVES
    if keep is not None:
        deck = deck.with_meshes(keep / "meshes")
    solve = DeckSolve(path, deck, tuple(look), keep, say)
    found = map_of(*solve.rows(), stops, table.get("output"), solve)
    return DeckModel(
        solve,
        stops,
        table.get("output"),
        found.outputs,
        read_parameters(table, found.parameters),
        found.valid,
        gravity,
        payload,
        share,
    )


def plain(model: DeckModel) -> Map:
    """The map of the deck as it is, with the model's gain and offset."""
    return replace(model.map_at(0.0, 0.0), parameters=model.parameters)


def map_of(columns: Sequence[str], rows: np.ndarray, stops: np.ndarray, output: Any, solve: DeckSolve) -> Map:
    """The map of what was solved."""
    name = solve.path.name
    if not len(stops):
        return from_columns(columns, rows, output, f"{name}, solved")
    networks = list(solve.deck.loads.pressure or {})
    return _surface(list(columns), rows, networks, stops, output, name)


def serpentine(axes: Sequence[np.ndarray]) -> np.ndarray:
    """(points, chambers) all points of a grid, from the origin on, neighbours one step apart."""
    if len(axes) == 1:
        return axes[0][:, None]
    inner = serpentine(axes[1:])
    parts = [
        np.column_stack([np.full(len(inner), p), inner[:: 1 if k % 2 == 0 else -1]])
        for k, p in enumerate(axes[0])
    ]
    return np.concatenate(parts)


def _surface(
    columns: list[str], rows: np.ndarray, names: list[str], stops: np.ndarray, output: Any, deck: str
) -> Surface:
    """The map from the rows whose pressures are those of the grid."""
    heads = [f"pressure {name} [kPa]" for name in names]
    if any(head not in columns for head in heads):
        raise InputError(f"the curve of {deck} has {', '.join(columns)}; needed are {', '.join(heads)}")
    own = [columns.index(head) for head in heads]
    pressure = 1e3 * rows[:, own]
    size = float(np.abs(stops).max())
    picked = []
    for stop in stops:
        off = np.abs(pressure - stop).max(axis=1)
        near = int(np.argmin(off))
        if off[near] > 1e-4 * size:
            at_ = ", ".join(f"{n} {p / 1e3:g} kPa" for n, p in zip(names, stop, strict=True))
            raise InputError(f"the deck {deck} is not solved as far as {at_}; give lower pressures in it")
        picked.append(near)
    # a column of one pressure, so that the output is read as of any curve
    row = np.arange(len(picked), dtype=float)
    rest = [i for i, name in enumerate(columns) if not name.startswith("pressure")]
    plain_ = ["pressure [kPa]", *(columns[i] for i in rest)]
    curve = from_columns(plain_, np.column_stack([row, rows[picked][:, rest]]), output, deck)
    values = curve.at(1e3 * row)
    axes = [np.unique(stops[:, j]) for j in range(len(names))]
    place = [tuple(int(np.argmin(np.abs(axes[j] - p))) for j, p in enumerate(stop)) for stop in stops]
    grid = np.full([len(axis) for axis in axes], np.nan)
    for where, value in zip(place, values, strict=True):
        grid[where] = value
    return surface(axes, grid, curve.outputs[0].name, f"{deck}, solved")
