"""Cases run with the family of their effect taken out of the library: what was said, and whether it fits."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.loop.classes import FAMILY, same_class
from benchmarks.loop.counts import Row, claims, counted, share, table, unexplained, visible
from benchmarks.loop.signature import clauses, fits, leads
from benchmarks.loop.tables import rows_of

PREFIX = "without-"
WORDS = """The family of the effect was taken out of the library. A signature fits by fixed rules on its words
(`benchmarks/loop/signature.py`): loops between rise and fall for what is rate-independent; held commands and
the last seconds for creep and leaks; small while held, rate, fractions of a second for lags; the pressure
itself for structure, saturation and thresholds; cycle, time or the largest pressure so far for history. The
last column is what chance would give: how often those words stand in the signatures of the other families.
A classmate (as viscous-lag of pressure-lag) is of another family, so still in the library, and one output
does not tell it apart: to name it and nothing else is no error, but no test of `unexplained` either."""


def left_out(folders: Sequence[Path]) -> dict[str, list[Row]]:
    """Family -> its cases in folders `without-FAMILY`, each with its `signature`."""
    found: dict[str, list[Row]] = {}
    for folder in folders:
        if folder.name.startswith(PREFIX):
            family = folder.name.removeprefix(PREFIX)
            rows = visible(rows_of(folder / "results.csv"), "single")
            mine = [r | {"signature": signature_of(folder, r)} for r in rows]
            found.setdefault(family, []).extend(r for r in mine if FAMILY.get(r["truth"]) == family)
    return {family: rows for family, rows in sorted(found.items()) if rows}


def signature_of(folder: Path, row: Row) -> str:
    """From the row, or from the report where the row is of an older scorer."""
    report = folder / "results" / row["name"] / "report.json"
    if row.get("signature") or not report.is_file():
        return row.get("signature") or ""
    return str(json.loads(report.read_text(encoding="utf-8"))["signature"] or "")


def families(found: Mapping[str, Sequence[Row]]) -> str:
    """A line a family, then a line a case."""
    if not found:
        return ""
    lines, every = [], [row for rows in found.values() for row in rows]
    for family, rows in (*found.items(), ("all", every)):
        told = [r for r in rows if unexplained(r)]
        lines.append(
            (
                family,
                share(rows, unexplained),
                counted(r["effects"] for r in rows if near(r)),
                counted(r["effects"] for r in rows if claims(r) and not near(r)),
                share(told, _fits),
                share(told, lambda r: leads(r["truth"], r["signature"])),
                by_chance(rows, every),
            )
        )
    named = ("named: a classmate", "named: another")
    heading = ("family", "unexplained", *named, "signature fits", "its first words do", "by chance")
    cases = [
        (r["truth"], f"{100 * float(r['target']):g} %", _verdict(r), "; ".join(clauses(r["signature"])))
        for r in every
    ]
    return (
        f"## One family left out of the library\n\n{WORDS}\n\n"
        + table(heading, lines)
        + "\n\n"
        + table(("truth", "visible", "verdict", "signature"), cases)
    )


def _fits(row: Row) -> bool:
    return fits(row["truth"], row["signature"])


def _verdict(row: Row) -> str:
    if claims(row):
        return f"{row['verdict']}: {row['effects'].replace('+', ', ')}"
    if not unexplained(row):
        return row["verdict"]
    return "unexplained, fits" if _fits(row) else "unexplained, does not fit"


def near(row: Row) -> bool:
    """Whether a classmate of the effect is named, and nothing else."""
    return claims(row) and row["effects"] in same_class(row["truth"], row["protocol"] == "D+")


def by_chance(rows: Sequence[Row], every: Sequence[Row]) -> str:
    """How often signatures of other families fit the effects of these rows."""
    pairs = [
        fits(row["truth"], other["signature"])
        for row in rows
        for other in every
        if unexplained(other) and FAMILY[other["truth"]] != FAMILY[row["truth"]]
    ]
    return f"{100 * sum(pairs) / len(pairs):.0f} %" if pairs else ""
