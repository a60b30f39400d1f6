"""What was asked of a sweep, and how it stands."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from fem_spa.sweep.case import Line
from fem_spa.sweep.cases import Case, Plan
from fem_spa.sweep.table import Output, main_output


@dataclass(frozen=True)
class Request:
    """What was asked for.

    again : also cases that ended by themselves, but not at the end of their path, are solved once more
    """

    deck: Path
    vary: tuple[str, ...]
    sample: str | None = None
    seed: int = 0
    overrides: tuple[str, ...] = ()
    scheduler: str | None = None
    workers: int | None = None
    again: bool = False
    command: str = "fem-spa sweep ..."


@dataclass
class Sweep:
    """How it goes.

    status : `done`, `interrupted` or `stopped`
    lines : name of a case -> what is known of it
    found : cases that had ended before;  seconds : of this call;  engine : in words
    """

    plan: Plan
    folder: Path
    status: str = "done"
    message: str = ""
    lines: dict[str, Line] = field(default_factory=dict)
    found: int = 0
    seconds: float = 0.0
    engine: str = "nothing was left to run"

    def line(self, case: Case) -> Line:
        """What is known of a case."""
        return self.lines.get(case.name, Line("waiting", "not run"))

    def in_order(self) -> list[Line]:
        """What is known of every case, in the plan's order."""
        return [self.line(case) for case in self.plan.cases]

    def count(self, status: str) -> int:
        """Cases of this status."""
        return sum(line.status == status for line in self.in_order())

    @property
    def output(self) -> Output:
        """What the sweep is about."""
        return main_output(self.in_order())
