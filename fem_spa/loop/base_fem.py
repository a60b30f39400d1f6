"""Kind "fem": the deck is solved once, and the loop works on its curve."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fem_spa.errors import InputError
from fem_spa.reduced.curve import Curve, from_columns, read_columns


def solved_deck(table: Mapping[str, Any], where: Path) -> Curve:
    """The curve of `deck` (a path relative to `where`); `output` chooses the column.

    Raises
    ------
    InputError
        for an unknown key, no deck, a deck that is wrong, or a run that gives no curve
    """
    unknown = sorted(set(table) - {"kind", "deck", "output"})
    if unknown:
        raise InputError(f"given model.{unknown[0]}: kind 'fem' takes deck and output")
    if not isinstance(table.get("deck"), str):
        raise InputError("given no model.deck: kind 'fem' needs the path of a deck, deck = 'finger.toml'")
    deck = where / str(table["deck"])
    if not deck.is_file():
        raise InputError(f"given {deck} for model.deck: there is no such file")
    from fem_spa.run import run_deck

    with tempfile.TemporaryDirectory() as folder:
        run_deck(deck, folder, quiet=True)
        found = Path(folder) / "curve.csv"
        if not found.is_file():
            raise InputError(f"the deck {deck} gives no curve; see what `fem-spa solve {deck.name}` says")
        columns, rows = read_columns(found)
    return from_columns(columns, rows, table.get("output"), f"{deck.name}, solved")
