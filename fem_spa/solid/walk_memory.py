"""What the rest of a load path depends on, as plain values and arrays: taken after a step, given back.

A walk that is given its memory back goes on as if it had never stopped: the same steps, the same iterations,
the same numbers to the last bit. So beside the state it holds what the step control and Newton's method have
learnt: the states that predictions are made from, the matrix whose factors are kept and Broyden's updates of
them, contact's accepted shape and stiffness and the shape its neighbours were found at, the pattern with it.

Arrays in a memory are never changed afterwards, so that they may be written by another thread.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from fem_spa.solid.predictor import Predictor
from fem_spa.solid.problem import Motion, Problem, Row, State
from fem_spa.solid.space import Space

if TYPE_CHECKING:
    from fem_spa.solid.path import Walk

Memory = dict[str, Any]
_BLOCK = 100


@dataclass
class Way:
    """Where a walk is on straight lines through load points.

    dead : these are the dead loads;  start : (n,) prescribed values at the beginning
    segment : line that is being walked, -1 before the first;  done : how far, measured as its length
    walked : the same from the start;  size : next step;  wait : steps to come without growth
    """

    dead: bool
    start: np.ndarray
    predictor: Predictor
    segment: int = -1
    done: float = 0.0
    walked: float = 0.0
    size: float = 0.0
    wait: int = 0


class Told:
    """A list that only grows, in blocks that are never changed: what was written once need not be again."""

    def __init__(self) -> None:
        self._blocks: list[tuple[Any, ...]] = []
        self._tail: list[Any] = []

    def __iter__(self) -> Iterator[Any]:
        return chain(*self._blocks, self._tail)

    def append(self, item: Any) -> None:
        """Add a plain value, which must not change any more."""
        self._tail.append(item)
        if len(self._tail) == _BLOCK:
            self._blocks.append(tuple(self._tail))
            self._tail = []

    def memory(self) -> list[Any]:
        """The blocks, each a tuple, and the rest."""
        return [*self._blocks, list(self._tail)]

    def recall(self, memory: Sequence[Sequence[Any]]) -> None:
        """Go on from what `memory` gave."""
        *blocks, tail = memory
        self._blocks, self._tail = [tuple(block) for block in blocks], list(tail)


def remember(walk: Walk) -> Memory:
    """The memory of a walk between two steps."""
    way, system = walk.way, walk.system
    assert way is not None
    plain = ("dead", "start", "segment", "done", "walked", "size", "wait")
    return {
        "way": {name: getattr(way, name) for name in plain},
        "order": way.predictor.order,
        "known": [list(known) for known in way.predictor.known],
        "x": walk.x,
        "pressure": walk.pressure,
        "rows": walk.told.memory(),
        "cavity_volume": dict(walk.state.cavity_volume) if walk.state else None,
        "angle": walk.angle.memory(),
        "cards": [list(walk.cards.ranged), list(walk.cards.stable)],
        "stability": walk.stability.memory(),
        "walls": walk.walls is not None,
        "touch": walk.touch,
        "warnings": list(walk.warnings),
        "fraction": walk.fraction,
        "holds_tip": system.holds_tip,
        "system": system.memory(),
        "contact": system.contact.memory() if system.contact is not None else None,
        "factors": walk.factors.memory(),
        "iterations": walk.iterations,
        "factorizations": walk.factorizations + walk.factors.solver.factorizations,
        "seconds": {
            "assembly": walk.seconds["assembly"] + system.seconds["assembly"],
            "contact": walk.seconds["contact"] + system.seconds["contact"],
            "linear": walk.seconds["linear"] + walk.factors.seconds,
            "total": time.perf_counter() - walk.started,
        },
    }


def recall(walk: Walk, memory: Mapping[str, Any]) -> None:
    """Put a new walk of the same problem where `memory` was taken."""
    if memory["holds_tip"] != walk.system.holds_tip:
        walk.setup(hold_tip=memory["holds_tip"])
    predictor = Predictor()
    predictor.order = memory["order"]
    predictor.known = [(length, x, pressure) for length, x, pressure in memory["known"]]
    walk.way = Way(predictor=predictor, **memory["way"])
    walk.x, walk.pressure = memory["x"], memory["pressure"]
    walk.told.recall(memory["rows"])
    walk.rows, walk.state = rows_and_state(memory, walk.problem, walk.space)
    walk.angle.recall(memory["angle"])
    ranged, stable = memory["cards"]
    walk.cards.ranged = {name: walk.cards.ranged[name] for name in ranged}
    walk.cards.stable = {name: walk.cards.stable[name] for name in stable}
    walk.stability.recall(memory["stability"])
    if not memory["walls"]:
        walk.walls = None
    walk.touch = memory["touch"]
    walk.warnings = list(memory["warnings"])
    walk.fraction = memory["fraction"]
    walk.system.recall(memory["system"])
    if walk.system.contact is not None:
        walk.system.contact.recall(memory["contact"])
    walk.factors.recall(memory["factors"], walk.system)
    walk.iterations = memory["iterations"]
    walk.factorizations = memory["factorizations"] - walk.factors.solver.factorizations
    seconds = dict(memory["seconds"])
    walk.started -= seconds.pop("total")
    walk.seconds = seconds


def rows_and_state(
    memory: Mapping[str, Any], problem: Problem, space: Space
) -> tuple[list[Row], State | None]:
    """The rows that a memory holds, and the state of the last one."""
    rows = [row_of(table) for block in memory["rows"] for table in block]
    if not rows:
        return [], None
    named = dict(zip(problem.mesh.cavities, memory["pressure"].tolist(), strict=True))
    points = memory["contact"]["added"] if memory["contact"] else ()
    return rows, state_of(space, memory["x"], named, rows[-1].step, memory["cavity_volume"], points)


def state_of(
    space: Space,
    x: np.ndarray,
    pressure: Mapping[str, float],
    step: int,
    volume: Mapping[str, float],
    contact_points: Iterable[int] = (),
) -> State:
    """The state of unknowns x (n_dofs,). pressure, volume : of the cavities; they and points as in a State"""
    n_u = 3 * space.n_nodes
    return State(
        step=step,
        displacement=x[:n_u].reshape(-1, 3).copy(),
        pressure_field=x[n_u:].copy(),
        cavity_pressure=dict(pressure),
        cavity_volume=dict(volume),
        contact_points=tuple(int(point) for point in contact_points),
    )


def row_memory(row: Row) -> Memory:
    """A row as plain values; its motion, if an observer has added it, too."""
    table = asdict(row)
    for name in ("tip", "force_vector", "obstacle_force"):
        if table[name] is not None:
            table[name] = np.asarray(table[name]).tolist()
    return table


def row_of(table: Mapping[str, Any]) -> Row:
    """The row that `row_memory` was made of."""
    given = dict(table)
    for name in ("tip", "force_vector", "obstacle_force"):
        if given[name] is not None:
            given[name] = np.array(given[name])
    if given["motion"] is not None:
        given["motion"] = Motion(**given["motion"])
    return Row(**given)
