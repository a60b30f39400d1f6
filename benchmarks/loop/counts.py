"""Rows of results.csv: which of them count, what they say, and how often, as cells of a table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from scipy.stats import beta

Row = dict[str, str]
Test = Callable[[Row], bool]


def of(rows: Iterable[Row], *tiers: str) -> list[Row]:
    """Rows of tiers that ran to their end."""
    return [row for row in rows if row["tier"] in tiers and row["status"] == "0"]


def shown(row: Row) -> bool:
    """Whether the records that the program may learn from show the effects: half of the size aimed at."""
    return not row["trained"] or float(row["trained"]) >= 0.5 * float(row["target"])


def visible(rows: Iterable[Row], *tiers: str) -> list[Row]:
    """Those of tiers whose training records show the effects."""
    return [row for row in of(rows, *tiers) if shown(row)]


def empty(rows: Iterable[Row]) -> list[Row]:
    """Those without an effect, with harmless faults or not."""
    return [row for row in of(rows, "null", "distractor") if not row["truth"]]


def right(row: Row) -> bool:
    return row["right"] == "1"


def claims(row: Row) -> bool:
    """Whether an effect is named."""
    return row["verdict"] in ("attributed", "ambiguous")


def attributed(row: Row) -> bool:
    return row["verdict"] == "attributed"


def unexplained(row: Row) -> bool:
    return row["verdict"] == "unexplained"


def first(row: Row) -> bool:
    """Whether the first name is right, whatever else is said."""
    return row["lenient"] == "1"


def family(row: Row) -> bool:
    """Whether every effect is told by its family, and no more."""
    return row["family"] == "1"


def holds(row: Row) -> bool:
    """Whether effects and rivals together hold the truth."""
    return row["holds"] == "1"


def worse(row: Row) -> bool:
    return bool(row["after"]) and float(row["after"]) > 1.001 * float(row["before"])


def sizes(rows: Iterable[Row]) -> list[str]:
    """Visible sizes aimed at, smallest first."""
    return sorted({row["target"] for row in rows}, key=float)


def percent(size: str) -> str:
    return f"visible {100 * float(size):g} %"


def share(rows: Sequence[Row], test: Test) -> str:
    """`83 % (25 of 30; 65 to 94)`, the bounds those of Clopper and Pearson at 95 %."""
    n = len(rows)
    if n == 0:
        return "no case"
    k = sum(map(test, rows))
    low = 0.0 if k == 0 else float(beta.ppf(0.025, k, n - k + 1))
    high = 1.0 if k == n else float(beta.ppf(0.975, k + 1, n - k))
    return f"{100 * k / n:.0f} % ({k} of {n}; {100 * low:.0f} to {100 * high:.0f})"


def middle(rows: Sequence[Row], column: str) -> str:
    """Median and mean of a column of figures."""
    values = [float(row[column]) for row in rows if row[column] not in ("", "None")]
    if not values:
        return "no case"
    return f"median {np.median(values):.2f}, mean {np.mean(values):.2f} ({len(values)})"


def counted(words: Iterable[str]) -> str:
    """`hysteresis 3, none 1`, the most frequent first."""
    return ", ".join(f"{word} {n}" for word, n in Counter(words).most_common())


def said(row: Row) -> str:
    """The names given, or the verdict."""
    return row["effects"] or row["verdict"]


def table(heading: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(heading) + " |", "|" + "---|" * len(heading)]
    return "\n".join([*lines, *("| " + " | ".join(cells) + " |" for cells in rows)])
