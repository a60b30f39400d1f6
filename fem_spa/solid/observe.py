"""Observers see each converged state and cannot change it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from fem_spa.solid.problem import Problem, Result, Row, State
from fem_spa.solid.space import Space


class Observer(Protocol):
    """What `solve` tells those who listen. Pressures in Pa by cavity; `fraction` of the load path, 0 to 1."""

    def start(self, problem: Problem, space: Space) -> None: ...

    def iteration(self, step: int, pressure: Mapping[str, float], iteration: int, error: float) -> None: ...

    def converged(self, state: State, row: Row, fraction: float) -> None: ...

    def finished(self, result: Result) -> None: ...


class Silent:
    """Observes nothing; others override what they need."""

    def start(self, problem: Problem, space: Space) -> None:
        pass

    def iteration(self, step: int, pressure: Mapping[str, float], iteration: int, error: float) -> None:
        pass

    def converged(self, state: State, row: Row, fraction: float) -> None:
        pass

    def finished(self, result: Result) -> None:
        pass


class KeepStates(Silent):
    """Keeps every state, for studies and tests on small meshes."""

    def __init__(self) -> None:
        self.states: list[State] = []

    def converged(self, state: State, row: Row, fraction: float) -> None:
        self.states.append(state)
