"""The aims, each with the figure measured beside it."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.loop.classes import SAME_FORM
from benchmarks.loop.counts import (
    Row,
    attributed,
    claims,
    empty,
    family,
    first,
    holds,
    middle,
    of,
    right,
    share,
    shown,
    table,
    unexplained,
    visible,
    worse,
)

REDUCTION = """Held-out reduction is (before - after) / (before - best). The best possible error is that of
the truth itself: noise, offsets and gains of the held-out records. It can be a little above 1, as the refit
follows gains. Cases in which the base model is within a quarter of the best are left out of it."""


def aims(rows: Sequence[Row], timed: Sequence[Row] = (), kinds: Sequence[Row] = ()) -> str:
    """The table; `timed`: cases of 8 records of 5 000 samples, `kinds`: rows of kinds.csv."""
    null, single, pair = empty(rows), visible(rows, "single"), visible(rows, "pair")
    hidden = [r for r in of(rows, "single", "pair", "strange") if not shown(r)]
    ended = [row for row in rows if row["status"] == "0"]
    named = [row for row in single if claims(row)]
    same = [row for row in single if row["forms"] in SAME_FORM]
    other = [row for row in single if row["forms"] not in SAME_FORM]

    def at(protocol: str) -> list[Row]:
        return [row for row in single if row["protocol"] == protocol]

    lines = [
        ("null data: an effect named", "<= 2 %", share(null, claims)),
        ("the same, verdict `attributed` only", "", share(null, attributed)),
        ("right class, D+", ">= 92 %", share(at("D+"), right)),
        ("right class, D", ">= 88 %", share(at("D"), right)),
        ("right class, five equal cycles (B)", ">= 70 %", share(at("B"), right)),
        ("right class, one slow loop (A)", "about 60 %", share(at("A"), right)),
        ("right class, staircase (C)", "", share(at("C"), right)),
        ("of those named at all: first name in the right class", "", share(named, first)),
        ("the set holds the truth", ">= 95 %", share(named, holds)),
        ("names in the set", "<= 2.0", middle(named, "set_size")),
        ("classes in the set", "", middle(named, "set_classes")),
        ("seen in held-out records only (counted nowhere else): one named", "", share(hidden, claims)),
        ("two effects, both right and no third", ">= 65 %", share(pair, right)),
        ("two effects, by family", ">= 88 %", share(pair, family)),
        ("outside the library: unexplained", ">= 80 %", share(visible(rows, "strange"), unexplained)),
        ("false `unexplained`", "<= 10 %", share([*null, *single], unexplained)),
        ("held-out reduction (best possible: 1), one effect, other form", ">= 0.75", reduced(other)),
        (
            "the same where the class is right",
            "",
            reduced([r for r in other if right(r)]),
        ),
        ("held-out reduction, one effect, same form (those named above)", ">= 0.90", reduced(same)),
        ("held-out error made worse (by over 0.1 %)", "< 1 %", share(ended, worse)),
        ("8 records of 5 000 samples, static map: seconds, one core", "< 60", seconds(timed)),
        ("the same: largest memory, MB", "< 2000", largest(timed)),
        (
            "a rod case (cases and samples: see below): seconds, one core",
            "< 180 (contract), < 600 (design)",
            seconds([row for row in kinds if row["kind"] == "rod"]),
        ),
        ("seconds a blind case, this machine", "< 60", middle(ended, "seconds")),
        ("largest memory of a blind case, MB", "< 2000", largest(ended)),
        ("breaches of the contract found by the scorer", "0", share(ended, lambda r: bool(r["problems"]))),
    ]
    return f"## Aims\n\n{table(('quantity', 'aim', 'measured'), lines)}\n\n{REDUCTION}"


def reduced(rows: Sequence[Row]) -> str:
    """Share of the held-out error above the truth's own that is gone, where that can be said."""
    return middle(rows, "reduction")


def seconds(rows: Sequence[Row]) -> str:
    """Least and largest time of cases that ended, and how many did not."""
    ended = [float(row["seconds"]) for row in rows if row["status"] == "0"]
    if not rows:
        return "no case"
    failed = f", {len(rows) - len(ended)} not ended" if len(ended) < len(rows) else ""
    if not ended:
        return f"none of {len(rows)} ended"
    span = f"{ended[0]:.0f}" if len(ended) == 1 else f"{min(ended):.0f} to {max(ended):.0f}"
    return f"{span} ({len(ended)}{failed})"


def largest(rows: Sequence[Row]) -> str:
    """Largest memory of all cases."""
    values = [float(row["peak_mb"]) for row in rows if row["peak_mb"]]
    return f"{max(values):.0f} ({len(values)})" if values else "no case"
