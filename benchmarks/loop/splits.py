"""The figures split by protocol and visible size: one effect, two, one outside the library, none."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from benchmarks.loop.counts import (
    Row,
    Test,
    attributed,
    claims,
    counted,
    empty,
    family,
    first,
    holds,
    middle,
    percent,
    right,
    share,
    sizes,
    table,
    unexplained,
    visible,
    worse,
)
from benchmarks.loop.session import PROTOCOLS

Cells = Callable[[Sequence[Row]], list[str]]


def splits(rows: Sequence[Row]) -> str:
    """All tables by protocol."""
    found = [one(visible(rows, "single")), two(visible(rows, "pair"))]
    found += [outside(visible(rows, "strange")), none(empty(rows))]
    return "\n\n".join(part for part in found if part)


def one(rows: Sequence[Row]) -> str:
    """One effect: the class, then what else is said."""

    def rest(mine: Sequence[Row]) -> list[str]:
        named = [r for r in mine if claims(r)]
        return [
            counted(r["verdict"] for r in mine),
            share(named, holds),
            middle(named, "set_size"),
            middle(mine, "reduction"),
            share(mine, worse),
        ]

    heading = ("", "verdicts", "the set holds the truth", "names in the set", "held-out reduction")
    return (
        "## One effect: right class by protocol and visible size\n\n"
        + crossed(rows, right)
        + "\n\nThe set, and the error held out:\n\n"
        + lined(rows, (*heading, "made worse"), rest)
    )


def two(rows: Sequence[Row]) -> str:
    """Two effects: both names, then what is said in part."""
    if not rows:
        return ""

    def rest(mine: Sequence[Row]) -> list[str]:
        return [
            share(mine, right),
            share(mine, family),
            share(mine, first),
            counted(r["verdict"] for r in mine),
            middle(mine, "reduction"),
        ]

    heading = ("", "both right, no third", "by family", "the first named is one of them", "verdicts")
    return (
        "## Two effects: both right and no third, by protocol and visible size of each\n\n"
        + crossed(rows, right)
        + "\n\n"
        + lined(rows, (*heading, "held-out reduction"), rest)
    )


def outside(rows: Sequence[Row]) -> str:
    """An effect that the library has not."""
    if not rows:
        return ""
    return "## Outside the library: unexplained, by protocol and visible size\n\n" + crossed(
        rows, unexplained
    )


def none(rows: Sequence[Row]) -> str:
    """No effect, with harmless faults or not."""
    if not rows:
        return ""

    def rest(mine: Sequence[Row]) -> list[str]:
        return [share(mine, claims), share(mine, attributed), share(mine, unexplained)]

    heading = ("", "an effect named", "`attributed` only", "unexplained")
    return "## No effect: by protocol\n\n" + lined(rows, heading, rest, by_size=False)


def crossed(rows: Sequence[Row], test: Test) -> str:
    """A table of protocols by visible sizes, with their sums."""
    columns = sizes(rows)
    lines = []
    for protocol in (*PROTOCOLS, "all"):
        mine = [r for r in rows if protocol in (r["protocol"], "all")]
        lines.append(
            [
                protocol,
                *(share([r for r in mine if r["target"] == s], test) for s in columns),
                share(mine, test),
            ]
        )
    return table(("protocol", *map(percent, columns), "all sizes"), lines)


def lined(rows: Sequence[Row], heading: Sequence[str], cells: Cells, by_size: bool = True) -> str:
    """A line a protocol, then a line a visible size, then all."""
    lines = [[f"protocol {p}", *cells([r for r in rows if r["protocol"] == p])] for p in PROTOCOLS]
    if by_size:
        lines += [[percent(s), *cells([r for r in rows if r["target"] == s])] for s in sizes(rows)]
    return table(heading, [*lines, ["all", *cells(rows)]])
