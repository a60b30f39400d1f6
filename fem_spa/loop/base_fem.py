"""Kind "fem": the deck is solved once; the loop works on its curve, or a surface over several pressures."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.errors import InputError
from fem_spa.reduced.curve import Curve, from_columns, read_columns
from fem_spa.reduced.surface import Surface, surface

LEVELS = {2: 5, 3: 3}
"""Pressures a network that are solved, by the number of networks."""


def solved_deck(table: Mapping[str, Any], where: Path) -> Curve | Surface:
    """The map of `deck` (a path relative to `where`); `output` chooses the column.

    Several networks, each with an end of its own in the deck: a grid of pressures up to them, in one run.
    Records number their pressures as the deck's table of them is written.

    Raises
    ------
    InputError
        for an unknown key, no deck, a deck that is wrong, or a run that does not give the map
    """
    unknown = sorted(set(table) - {"kind", "deck", "output"})
    if unknown:
        raise InputError(f"given model.{unknown[0]}: kind 'fem' takes deck and output")
    if not isinstance(table.get("deck"), str):
        raise InputError("given no model.deck: kind 'fem' needs the path of a deck, deck = 'finger.toml'")
    path = where / str(table["deck"])
    if not path.is_file():
        raise InputError(f"given {path} for model.deck: there is no such file")
    from fem_spa.deck import read_deck
    from fem_spa.deck_tables import Measure
    from fem_spa.run import run_deck

    deck = read_deck(path)
    ends = {name: end.si for name, end in (deck.loads.pressure or {}).items()}
    several = len(ends) > 1 and deck.loads.control == "pressure"
    stops = np.zeros((0, len(ends)))
    if several:
        if len(ends) not in LEVELS:
            raise InputError(f"given a deck of {len(ends)} networks: kind 'fem' takes at most {max(LEVELS)}")
        stops = serpentine([np.linspace(0.0, end, LEVELS[len(ends)]) for end in ends.values()])
        texts = [{n: f"{p:.10g} Pa" for n, p in zip(ends, stop, strict=True)} for stop in stops[1:]]
        last = {n: Measure(texts[-1][n], float(p)) for n, p in zip(ends, stops[-1], strict=True)}
        loads = deck.loads.model_copy(update={"pressure": last, "path": texts[:-1], "points": None})
        deck = deck.model_copy(update={"loads": loads})
    with tempfile.TemporaryDirectory() as folder:
        run_deck(deck, folder, quiet=True)
        found = Path(folder) / "curve.csv"
        if not found.is_file():
            raise InputError(f"the deck {path} gives no curve; see what `fem-spa solve {path.name}` says")
        columns, rows = read_columns(found)
    if not several:
        return from_columns(columns, rows, table.get("output"), f"{path.name}, solved")
    return _surface(columns, rows, list(ends), stops, table.get("output"), path.name)


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
            at = ", ".join(f"{n} {p / 1e3:g} kPa" for n, p in zip(names, stop, strict=True))
            raise InputError(f"the deck {deck} is not solved as far as {at}; give lower pressures in it")
        picked.append(near)
    # a column of one pressure, so that the output is read as of any curve
    row = np.arange(len(picked), dtype=float)
    rest = [i for i, name in enumerate(columns) if not name.startswith("pressure")]
    plain = ["pressure [kPa]", *(columns[i] for i in rest)]
    curve = from_columns(plain, np.column_stack([row, rows[picked][:, rest]]), output, deck)
    values = curve.at(1e3 * row)
    axes = [np.unique(stops[:, j]) for j in range(len(names))]
    place = [tuple(int(np.argmin(np.abs(axes[j] - p))) for j, p in enumerate(stop)) for stop in stops]
    grid = np.full([len(axis) for axis in axes], np.nan)
    for at_, value in zip(place, values, strict=True):
        grid[at_] = value
    return surface(axes, grid, curve.outputs[0].name, f"{deck}, solved")
