"""What workers do: draw a mesh, solve a case; and the line of the table that a case's folder gives."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fem_spa.deck import Deck

ENDS = ("done", "limit", "diverged")
"""Statuses of a run that came to its own end; such a case is not run again."""


@dataclass(frozen=True)
class Line:
    """What is known of a case.

    status : `done`, `limit`, `diverged`, `interrupted` as `solve` has them; `refused` (the input cannot be
        solved), `lost` (its process died twice), `fault` (of the program), `waiting` (not run yet)
    reason : why it is not done
    end : the last row of curve.csv by column, `step` among them
    cost : `first touch [kPa]`, `dofs`, `elements`, `newton iterations`, `seconds`, `memory [MB]` (largest of
        its process so far)
    """

    status: str
    reason: str = ""
    end: dict[str, float] = field(default_factory=dict)
    cost: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Task:
    """A case to be solved: its deck and its folder; `again`: whether what is there counts for nothing."""

    deck: Deck
    folder: Path
    again: bool = False


def draw(deck: Deck) -> None:
    """Make the mesh of a deck and keep it in the deck's folder of meshes."""
    from fem_spa.prepare import make_mesh

    make_mesh(deck)


def solve(task: Task) -> Line:
    """Solve a case, if it is not solved, from its last checkpoint on; what its folder says then."""
    from fem_spa.checkpoint import FOLDER
    from fem_spa.errors import InputError
    from fem_spa.run import run_deck

    found = read_line(task.folder)
    if found is not None and found.status in ENDS and not task.again:
        return found
    try:
        run_deck(task.deck, task.folder, quiet=True, resume=not task.again)
    except InputError:
        if task.again or not (task.folder / FOLDER).is_dir():
            raise
        run_deck(task.deck, task.folder, quiet=True)  # its checkpoint is of a mesh that is no longer there
    return read_line(task.folder) or Line("fault", f"nothing readable is in {task.folder}")


def read_line(folder: Path) -> Line | None:
    """What a folder that `solve` left says; None where it says nothing whole.

    A run that a fault of the program ended is `fault`, as it may go well elsewhere.
    """
    try:
        table = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        rows = _curve_rows(folder)
        end = {name: float(value) for name, value in rows[-1].items()} if rows else {}
        status, message = str(table["status"]), str(table["message"])
        if (folder / "error.log").is_file():
            status = "fault"
        return Line(status, "" if status == "done" else message, end, _cost(table))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None


def _curve_rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "curve.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _cost(table: dict[str, Any]) -> dict[str, float]:
    touch = table.get("first touch [kPa]")
    if isinstance(touch, dict):
        touch = max(touch.values(), default=None)
    memory = table.get("peak_rss_mb")
    return {
        "first touch [kPa]": math.nan if touch is None else float(touch),
        "dofs": float(table["dofs"]),
        "elements": float(table["elements"]),
        "newton iterations": float(table["newton_iterations"]),
        "seconds": float(table["seconds"]["total"]),
        "memory [MB]": math.nan if memory is None else float(memory),
    }


def read_curve(folder: Path) -> dict[str, list[float]]:
    """Columns of a case's curve.csv; none where there is no curve."""
    try:
        rows = _curve_rows(folder)
        return {name: [float(row[name]) for row in rows] for name in rows[0]} if rows else {}
    except (OSError, ValueError, TypeError):
        return {}
