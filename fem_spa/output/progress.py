"""How far the run is: a live line on a terminal, plain lines of a log elsewhere. All on stderr."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Mapping, Sequence
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
        self._points: Sequence[Mapping[str, float]] = ()
        self._control = "pressure"
        self._reached = 0
        self._rest: dict[str, float] = {}
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

    def say(self, text: str, urgent: bool = False) -> None:
        """Show `text` now on a terminal; in a log unless the last line is younger than two seconds."""
        if self._quiet:
            return
        if self._status is not None:
            from rich.markup import escape

            self._status.update(escape(text))
        elif urgent or self._points == () or time.perf_counter() - self._said >= SECONDS_BETWEEN_LINES:
            self._said = time.perf_counter()
            print(text, file=sys.stderr, flush=True)

    def start(self, problem: Problem, space: Any) -> None:
        """The solver has accepted the problem."""
        self._begun = time.perf_counter()
        self._points = list(problem.loads.points)
        self._control = problem.loads.control

    def iteration(self, step: int, pressure: Mapping[str, float], iteration: int, residual: float) -> None:
        """A Newton iteration: seen only on a terminal."""
        if self._status is not None:
            at = pressures(pressure) if pressure else "gravity"
            self.say(f"step {step}  {at}  iteration {iteration}  {self._last}{self._time_left()}")

    def converged(self, state: State, row: Row) -> None:
        """A load step is in equilibrium."""
        self._count(row)
        self._last = f"angle {number(math.degrees(row.angle))}°  " if math.isfinite(row.angle) else ""
        text = f"step {row.step}  {pressures(row.pressure)}  {row.iterations} iterations  {self._last}{self._time_left()}"
        self.say(text.rstrip())

    def finished(self, result: Result) -> None:
        """The last word is the command's."""

    def _count(self, row: Row) -> None:
        if row.is_point:
            self._reached += 1
        self._row = row

    def fraction(self) -> float:
        """Share of the load path that is behind, 0 to 1; exact under pressure control, by points else."""
        total = max(1, len(self._points))
        if self._reached >= total:
            return 1.0
        inside = 0.0
        row = getattr(self, "_row", None)
        if row is not None and self._control == "pressure":
            target = self._points[self._reached]
            before = self._points[self._reached - 1] if self._reached else dict.fromkeys(target, 0.0)
            way = sum((target[name] - before[name]) ** 2 for name in target)
            gone = sum((row.pressure[name] - before[name]) * (target[name] - before[name]) for name in target)
            inside = min(1.0, max(0.0, gone / way)) if way > 0.0 else 0.0
        return (self._reached + inside) / total

    def _time_left(self) -> str:
        share = self.fraction()
        if not 0.0 < share < 1.0:
            return ""
        left = (time.perf_counter() - self._begun) * (1.0 - share) / share
        return f"about {left:.0f} s left" if left < 120 else f"about {left / 60:.0f} min left"
