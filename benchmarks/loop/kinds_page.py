"""The section of docs/loop.md on the other base kinds, from kinds.csv; put in the page's place of it."""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks.loop.kinds import KINDS
from benchmarks.loop.tables import rows_of

TITLE = "## Other base models"
BEFORE = "## Measured data"
"""Heading that it comes before where the page has no such section yet."""
Row = dict[str, str]


def kinds_of(folders: Sequence[Path]) -> list[Row]:
    """Rows of kinds.csv in these folders, each case once."""
    found = [row for f in folders if (f / "kinds.csv").is_file() for row in rows_of(f / "kinds.csv")]
    return list({row["name"]: row for row in found}.values())


def kinds_section(rows: Sequence[Row], engine: str = "") -> str:
    """The section: counts a kind, then every case."""
    program = f" Program: {engine}." if engine else ""
    today = f"{datetime.date.today():%Y-%m-%d}"
    words = f"""`python -m benchmarks.loop kinds` on {today}, one core of a shared machine;
{len(rows)} cases, effects drawn by the seed or named.{program}
The actuator is of the same kind with another stiffness (the rod also another clamp and number of elements),
and has an effect by the generator's own physics, 3 % of the span visible, or a component, as large as it is,
that the model file leaves out. A case has 6 to 11 records of 9 to 27 s, 25 rows a second. Errors in deg, of
the rod in mm."""
    done = [row for row in rows if row["status"] == "0"]
    counts = ["| kind | cases | ended | null, none named | right, exactly | the set holds it | problems |"]
    counts.append("|---|---|---|---|---|---|---|")
    for kind in KINDS:
        own = [row for row in rows if row["kind"] == kind]
        if not own:
            continue
        ended = [row for row in own if row in done]
        null, one = ([r for r in ended if _shows(r) is given] for given in (False, True))
        cells = [
            str(len(own)),
            str(len(ended)),
            _of(null, lambda r: not r["effects"]),
            _of(one, lambda r: r["right"] == "1"),
            _of(one, lambda r: r["holds"] == "1"),
            str(sum(bool(r["problems"]) for r in own)),
        ]
        counts.append("| " + " | ".join([kind, *cells]) + " |")
    heads = "case effect visible verdict named rivals before after reduction seconds".split()
    table = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for row in rows:
        cells = [
            "-".join(row["name"].split("-")[:2]),
            row["effect"] or "none",
            f"{100 * float(row['visible']):.1f} %" if row["effect"] else "",
            row["verdict"] or f"status {row['status']}",
            row["effects"].replace("+", ", "),
            row["rivals"].replace("+", ", "),
            *(row[key] for key in ("before", "after", "reduction", "seconds")),
        ]
        table.append("| " + " | ".join(cells) + " |")
    return "\n".join([TITLE, "", words, "", *counts, "", *table])


def _shows(row: Row) -> bool:
    """Whether there is anything to be found."""
    return bool(row["effect"]) and float(row["visible"]) > 1e-3


def _of(rows: Sequence[Row], test: Callable[[Row], bool]) -> str:
    return f"{sum(map(test, rows))} of {len(rows)}" if rows else ""


def put(page: Path, section: str) -> None:
    """The section into a page that is there, in its place or before the measured data."""
    text = page.read_text(encoding="utf-8")
    old = re.search(rf"^{re.escape(TITLE)}\n.*?(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    if old is not None:
        text = text[: old.start()] + section + "\n\n" + text[old.end() :]
    else:
        at = text.find(f"\n{BEFORE}")
        at = len(text) if at < 0 else at + 1
        text = text[:at] + section + "\n\n" + text[at:]
    page.write_text(text.rstrip() + "\n", encoding="utf-8")
