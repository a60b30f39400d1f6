"""How far the run is: a live line on a terminal, plain lines of a log elsewhere. All on stderr."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Mapping
from typing import Any

from fem_spa.output.words import number, pressures
from fem_spa.solid.problem import Problem, Result, Row, State

SECONDS_BETWEEN_LINES = 2.0


class Progress:
    """An observer that tells a person step, pressure, Newton iterations, angle and time left.

    Parameters
    ----------
    quiet : say nothing
    """

    def __init__(self, quiet: bool = False) -> None:
        self._quiet = quiet
        self._status: Any = None
        self._begun = self._said = time.perf_counter()
        self._started = False
        self._fraction = 0.0
        self._last = ""

    def __enter__(self) -> Progress:
        if not self._quiet and sys.stderr.isatty():
            from rich.console import Console

            self._status = Console(stderr=True).status("starting", spinner="dots")
            self._status.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._status is not None:
            self._status.stop()
            self._status = None

    def say(self, text: str) -> None:
        """Show `text` now on a terminal.

        In a log: only once the solver has accepted the problem, so that a wrong input has one line and
        no more, and only when the last line is older than two seconds.
        """
        if self._quiet:
            return
        if self._status is not None:
            from rich.markup import escape

            self._status.update(escape(text))
        elif self._started and time.perf_counter() - self._said >= SECONDS_BETWEEN_LINES:
            self._said = time.perf_counter()
            print(text, file=sys.stderr, flush=True)

    def note(self, text: str) -> None:
        """A line that stays."""
        if self._quiet:
            return
        if self._status is not None:
            from rich.markup import escape

            self._status.console.print(escape(text))
        else:
            print(text, file=sys.stderr, flush=True)

    def start(self, problem: Problem, space: Any) -> None:
        """The solver has accepted the problem."""
        self._begun = time.perf_counter()
        self._started = True
        self._said = -SECONDS_BETWEEN_LINES
        unknowns = f"{len(problem.mesh.tets)} elements, {space.n_dofs} unknowns"
        self.say(f"solving: {unknowns} (the first run on a machine also compiles, about a minute)")

    def iteration(self, step: int, pressure: Mapping[str, float], iteration: int, residual: float) -> None:
        """A Newton iteration: seen only on a terminal."""
        if self._status is not None:
            at = pressures(pressure) if pressure else "gravity"
            self.say(f"step {step}  {at}  iteration {iteration}  {self._last}{self._time_left()}")

    def converged(self, state: State, row: Row, fraction: float) -> None:
        """A load step is in equilibrium; `fraction` of the load path is behind."""
        self._fraction = fraction
        self._last = f"angle {number(math.degrees(row.angle))}°  " if math.isfinite(row.angle) else ""
        text = f"step {row.step}  {pressures(row.pressure)}  {row.iterations} iterations  {self._last}"
        text += self._time_left()
        self.say(text.rstrip())

    def finished(self, result: Result) -> None:
        """The last word is the command's."""

    def _time_left(self) -> str:
        share = self._fraction
        if not 0.0 < share < 1.0:
            return ""
        left = (time.perf_counter() - self._begun) * (1.0 - share) / share
        return f"about {left:.0f} s left" if left < 120 else f"about {left / 60:.0f} min left"
