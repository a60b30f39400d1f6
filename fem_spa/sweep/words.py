"""The sentences of a sweep, on the terminal and on its page."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from operator import itemgetter
from textwrap import shorten

from fem_spa.output.words import number
from fem_spa.sweep.case import Line
from fem_spa.sweep.cases import Case, Plan
from fem_spa.sweep.state import Sweep
from fem_spa.sweep.table import main_output

_DIGITS = re.compile(r"\d+(\.\d+)?")
HEAD = {"done": "Done", "interrupted": "Interrupted", "stopped": "Stopped"}


def keys_words(plan: Plan, case: Case) -> str:
    """The values of a case: "geometry.wall 1.25 mm, loads.pressure 20 kPa"."""
    pairs = zip(plan.axes, case.values, strict=True)
    return ", ".join(f"{axis.key} {value.label} {axis.unit}".rstrip() for axis, value in pairs)


def with_unit(value: float, unit: str, digits: int = 3) -> str:
    """31.2°, 14 mm."""
    return f"{number(value, digits)}{'' if unit == '°' else ' '}{unit}"


def case_words(plan: Plan, case: Case, line: Line) -> str:
    """A case that ended: "geometry.wall 1.25 mm: done, 31.2°, 12 s"."""
    words = [line.status]
    output = main_output([line])
    if output.column in line.end:
        words.append(with_unit(line.end[output.column], output.unit))
    if "seconds" in line.cost:
        words.append(f"{line.cost['seconds']:.0f} s")
    reason = f" ({shorten(line.reason, 90, placeholder=' ...')})" if line.reason else ""
    return f"{keys_words(plan, case)}: {', '.join(words)}{reason}"


def extremes(sweep: Sweep) -> list[tuple[Case, float]]:
    """The solved cases with the smallest and the largest end of the main output."""
    column = sweep.output.column
    pairs = [
        (case, line.end[column])
        for case, line in zip(sweep.plan.cases, sweep.in_order(), strict=True)
        if line.status == "done" and math.isfinite(line.end.get(column, math.nan))
    ]
    if not pairs:
        return []
    return [min(pairs, key=itemgetter(1)), max(pairs, key=itemgetter(1))]


def verdict(sweep: Sweep) -> str:
    """One sentence: how many are solved, and between which values the main output is at their end."""
    total, solved = len(sweep.plan.cases), sweep.count("done")
    sentence = f"{HEAD[sweep.status]}: {solved} of {total} designs are solved"
    ends = extremes(sweep)
    if ends:
        low, high = (with_unit(value, sweep.output.unit) for _, value in ends)
        between = low if low == high else f"from {low} to {high}"
        sentence += f"; {sweep.output.name} at the end {between}"
    return sentence + "."


def best(sweep: Sweep) -> list[str]:
    """Which designs end with the smallest and the largest main output, a sentence each, where they differ."""
    ends, output = extremes(sweep), sweep.output
    if not ends or ends[0][1] == ends[1][1]:
        return []
    return [
        f"{which} {output.name} {with_unit(value, output.unit)}: {keys_words(sweep.plan, case)}."
        for which, (case, value) in zip(("Smallest", "Largest"), ends, strict=True)
    ]


STATUS = {
    "limit": "cannot bear the load",
    "diverged": "found no equilibrium",
    "interrupted": "interrupted",
    "refused": "cannot be solved",
    "lost": "died twice",
    "fault": "met a fault of the program",
    "waiting": "not run",
}
"""What is said of a case that is not done."""


def failures(sweep: Sweep) -> list[tuple[str, str, list[Case]]]:
    """Status, reason and cases of what is not done, the most frequent first.

    Reasons that differ in their numbers only are one, since each case has its own; the first's is told.
    """
    groups: dict[tuple[str, str], list[Case]] = {}
    for case in sweep.plan.cases:
        line = sweep.line(case)
        if line.status != "done":
            groups.setdefault((line.status, _DIGITS.sub("", line.reason)), []).append(case)
    return [
        (status, _reason([sweep.line(case).reason for case in cases]), cases)
        for (status, _), cases in sorted(groups.items(), key=lambda group: -len(group[1]))
    ]


def _reason(reasons: Sequence[str]) -> str:
    """The first of several that say the same with other numbers."""
    return reasons[0] if len(set(reasons)) == 1 else f"{reasons[0]} (the first of them)"


def time_left(seconds: float) -> str:
    """The end of a line of progress."""
    if seconds < 1.0:
        return ""
    return f"; about {seconds:.0f} s left" if seconds < 120 else f"; about {seconds / 60:.0f} min left"
