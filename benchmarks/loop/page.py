"""docs/loop.md from the rows of one or more result folders."""

from __future__ import annotations

import datetime
import os
import platform
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
from scipy.stats import beta

from benchmarks.loop.classes import FAMILY
from benchmarks.loop.kinds_page import kinds_of, kinds_section, put
from benchmarks.loop.session import PROTOCOLS
from benchmarks.loop.tables import rows_of

DATA = """## Where the measured data are from

None of them is in this repository. The studies look in the folder that `FEM_SPA_DATA` names.

| folder | source | licence |
|---|---|---|
| eth_ds10_cantilever | github.com/srl-ethz/diffPD_sim2real, python/realbeam_experiments | MIT |
| zigzag_spa_ubc | github.com/HiroshanGunawardane/ML_SelectiveStiffness-, Modular_Stiffness- | MIT |
| asu_4chamber_arm | github.com/ASU-RISE-Lab/4-chamber-softarm-control | MIT |
| ecoflex_compression_qmul | github.com/abubakardawood/tissue-phantom-material-database | CC BY 4.0 |"""
Row = dict[str, str]
Test = Callable[[Row], bool]


REMARKS = Path(__file__).with_name("remarks.md")
"""What a person says of the tables: where it falls short, and why."""


def write_page(folders: Sequence[Path], page: Path, engine: str = "") -> None:
    """Write the page of result folders; `engine` names the version that ran.

    A folder `without-FAMILY` holds cases run with that family left out, `timing` those of full length,
    `studies` what the studies printed. A truncated run of some folders is as good as a whole one. Where all
    folders are of `kinds` (kinds.csv), only that section of a page that is there is written anew.
    """
    if page.is_file() and folders and all((f / "kinds.csv").is_file() for f in folders):
        put(page, kinds_section(kinds_of(folders), engine))
        return
    special = ("without-", "timing", "studies")
    full = [row for f in folders if not f.name.startswith(special) for row in rows_of(f / "results.csv")]
    full = list({row["name"]: row for row in full}.values())
    timed = [row for f in folders if f.name == "timing" for row in rows_of(f / "results.csv")]
    left_out: dict[str, list[Row]] = {}
    for f in folders:
        if f.name.startswith("without-"):
            left_out.setdefault(f.name.removeprefix("without-"), []).extend(rows_of(f / "results.csv"))
    remarks = REMARKS.read_text(encoding="utf-8").strip() if REMARKS.is_file() else ""
    parts = [
        head(full, engine),
        aims(full),
        remarks,
        by_protocol(full),
        by_effect(full),
        confusion(full),
        others(full),
        reliability(full),
    ]
    parts += [families(left_out)] if left_out else []
    parts += [timing(timed)] if timed else []
    kinds = kinds_of(folders)
    parts += [kinds_section(kinds, engine)] if kinds else []
    parts += [limits(full), *(told_by(f) for f in folders), DATA]
    page.write_text("\n\n".join(part for part in parts if part) + "\n", encoding="utf-8")


def of(rows: Iterable[Row], *tiers: str) -> list[Row]:
    """Rows of tiers that ran to their end."""
    return [row for row in rows if row["tier"] in tiers and row["status"] == "0"]


def share(rows: Sequence[Row], test: Test) -> str:
    """`83 % (25 of 30; 65 to 94)`, the bounds those of Clopper and Pearson at 95 %."""
    n = len(rows)
    if n == 0:
        return "no case"
    k = sum(map(test, rows))
    low = 0.0 if k == 0 else float(beta.ppf(0.025, k, n - k + 1))
    high = 1.0 if k == n else float(beta.ppf(0.975, k + 1, n - k))
    return f"{100 * k / n:.0f} % ({k} of {n}; {100 * low:.0f} to {100 * high:.0f})"


def right(row: Row) -> bool:
    return row["right"] == "1"


def claims(row: Row) -> bool:
    """Whether an effect is named."""
    return row["verdict"] in ("attributed", "ambiguous")


def unexplained(row: Row) -> bool:
    return row["verdict"] == "unexplained"


def _first(row: Row) -> bool:
    """Whether the first name is right, whatever else is said."""
    return row["lenient"] == "1"


def worse(row: Row) -> bool:
    return bool(row["after"]) and float(row["after"]) > 1.001 * float(row["before"])


def middle(rows: Sequence[Row], column: str) -> str:
    """Median and mean of a column of figures."""
    values = [float(row[column]) for row in rows if row[column] not in ("", "None")]
    if not values:
        return "no case"
    return f"median {np.median(values):.2f}, mean {np.mean(values):.2f} ({len(values)})"


def table(heading: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(heading) + " |", "|" + "---|" * len(heading)]
    return "\n".join([*lines, *("| " + " | ".join(cells) + " |" for cells in rows)])


def reliability(rows: Sequence[Row]) -> str:
    """How often the first name was the truth's, by the probability that the report gave it."""
    told = [r for r in of(rows, "single", "pair", "strange", "distractor", "null") if r.get("probability")]
    if not told:
        return ""
    lines = []
    for low, high in ((0.0, 0.3), (0.3, 0.5), (0.5, 0.7), (0.7, 0.85), (0.85, 1.0)):
        some = [r for r in told if low <= float(r["probability"]) < high]
        mean = f"{np.mean([float(r['probability']) for r in some]):.2f}" if some else ""
        exact = share(some, lambda r: r["effects"].split("+")[0] in r["truth"].split("+"))
        lines.append((f"{low:g} to {high:g}", mean, exact, share(some, _first)))
    heading = ("probability of the first name", "its mean", "it was the truth's name", "it was of its class")
    return "## Probabilities\n\n" + table(heading, lines)


def head(rows: Sequence[Row], engine: str) -> str:
    today = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d")
    count = Counter(row["tier"] for row in rows)
    told = ", ".join(f"{n} {tier}" for tier, n in count.items())
    failed = [row for row in rows if row["status"] != "0"]
    return f"""# The loop, tested blind

Written by `python -m benchmarks.loop page` on {today}; {platform.machine()}, {os.cpu_count()} cores with
other work on them, one thread a case. Program: {engine or "this version"}.

The records come from `benchmarks/loop`, a generator that shares no code and no functional form with the
library of effects: relays and a Duhem equation for hysteresis, power laws and Eyring flow for creep,
orifices for pressure lag, a heavy chain of links for gravity, tables for softening, and so on. The size
of an effect is what the refitted base model leaves of it, RMS as a share of the span. Each record has
white and AR(1) noise and an offset and a gain of its own. The program is given the base model and the
records, by files, and is run as a user runs it. Half of the cases name their held-out records, in the
others the program chooses.

Cases: {len(rows)} ({told}); {len(failed)} did not end with status 0. Brackets: k of n; 95 % interval.
Seeds of this page were kept apart while the program was made (see below). More: `python -m benchmarks.loop
run`."""


def aims(rows: Sequence[Row]) -> str:
    """The first table of loop.md, measured."""
    null = [row for row in of(rows, "null", "distractor") if not row["truth"]]
    single, pair = ([r for r in of(rows, tier) if shown(r)] for tier in ("single", "pair"))
    strange = [r for r in of(rows, "strange") if shown(r)]
    hidden = [r for r in of(rows, "single", "pair", "strange") if not shown(r)]

    def at(*protocols: str) -> list[Row]:
        return [row for row in single if row["protocol"] in protocols]

    ended = [row for row in rows if row["status"] == "0"]
    named = [row for row in single if claims(row)]
    known = [*null, *single]
    lines = [
        ("null data: an effect named", "<= 2 %", share(null, claims)),
        ("the same, verdict `attributed` only", "", share(null, lambda r: r["verdict"] == "attributed")),
        ("right class, D+", ">= 92 %", share(at("D+"), right)),
        ("right class, D", ">= 88 %", share(at("D"), right)),
        ("right class, five equal cycles (B)", ">= 70 %", share(at("B"), right)),
        ("right class, one slow loop (A)", "about 60 %", share(at("A"), right)),
        ("right class, staircase (C)", "", share(at("C"), right)),
        (
            "of those named at all: first name in the right class",
            "",
            share(named, _first),
        ),
        (
            "the set holds the truth",
            ">= 95 %",
            share(named, lambda r: r["holds"] == "1"),
        ),
        ("names in the set", "<= 2.0", middle(named, "set_size")),
        ("classes in the set", "", middle(named, "set_classes")),
        ("seen in held-out records only (counted nowhere else): one named", "", share(hidden, claims)),
        ("two effects, both right and no third", ">= 65 %", share(pair, right)),
        ("two effects, by family", ">= 88 %", share(pair, lambda r: r["family"] == "1")),
        (
            "outside the library: unexplained",
            ">= 80 %",
            share(strange, unexplained),
        ),
        (
            "false `unexplained`",
            "<= 10 %",
            share(known, unexplained),
        ),
        ("held-out reduction, one effect", ">= 0.75", middle(single, "reduction")),
        ("the same where the class is right", "", middle([r for r in single if right(r)], "reduction")),
        ("held-out error made worse (by over 0.1 %)", "< 1 %", share(ended, worse)),
        ("seconds a case, this machine", "< 60", middle(ended, "seconds")),
        ("largest memory of a case, MB", "< 2000", middle(ended, "peak_mb")),
        ("breaches of the contract found by the scorer", "0", share(ended, lambda r: bool(r["problems"]))),
    ]
    return "## Aims\n\n" + table(("quantity", "aim", "measured"), lines)


def shown(row: Row) -> bool:
    """Whether the records that the program may learn from show the effects: half of the size aimed at."""
    return not row["trained"] or float(row["trained"]) >= 0.5 * float(row["target"])


def by_protocol(rows: Sequence[Row]) -> str:
    single = [r for r in of(rows, "single") if shown(r)]
    sizes = sorted({row["target"] for row in single}, key=float)
    lines = []
    for protocol in PROTOCOLS:
        cells = [protocol]
        for size in sizes:
            cells.append(
                share([r for r in single if r["protocol"] == protocol and r["target"] == size], right)
            )
        mine = [r for r in single if r["protocol"] == protocol]
        verdicts = Counter(row["verdict"] for row in mine)
        cells.append(", ".join(f"{v} {n}" for v, n in verdicts.most_common()))
        cells.append(middle(mine, "reduction"))
        lines.append(cells)
    heading = ("protocol", *(f"visible {100 * float(s):g} %" for s in sizes), "verdicts", "reduction")
    return "## One effect: right class by protocol and visible size\n\n" + table(heading, lines)


def by_effect(rows: Sequence[Row]) -> str:
    single = [r for r in of(rows, "single") if shown(r)]
    lines = []
    for name in FAMILY:
        mine = [r for r in single if r["truth"] == name]
        if mine:
            unnamed = [r for r in mine if not claims(r)]
            lines.append((name, share(mine, right), str(len(unnamed)), middle(mine, "reduction")))
    return "## One effect: by name\n\n" + table(("truth", "right class", "not named", "reduction"), lines)


def confusion(rows: Sequence[Row]) -> str:
    """What was said where the class was not right."""
    wrong = [r for r in of(rows, "single") if shown(r) and not right(r)]
    lines = []
    for truth in FAMILY:
        said = Counter(r["effects"] or r["verdict"] for r in wrong if r["truth"] == truth)
        if said:
            lines.append((truth, ", ".join(f"{name} {n}" for name, n in said.most_common())))
    return "## What was said where the class was wrong\n\n" + table(("truth", "said"), lines)


def others(rows: Sequence[Row]) -> str:
    parts = []
    strange = [r for r in of(rows, "strange") if shown(r)]
    if strange:
        lines = []
        for name in sorted({r["truth"] for r in strange}):
            mine = [r for r in strange if r["truth"] == name]
            said = Counter(r["effects"] or r["verdict"] for r in mine)
            lines.append((name, ", ".join(f"{w} {n}" for w, n in said.most_common())))
        parts.append("## Outside the library: what was said\n\n" + table(("truth", "said"), lines))
    pair = of(rows, "pair")
    if pair:
        both = [
            (
                protocol,
                share([r for r in pair if r["protocol"] == protocol], right),
                share([r for r in pair if r["protocol"] == protocol], _first),
            )
            for protocol in PROTOCOLS
        ]
        parts.append(
            "## Two effects\n\n"
            + table(("protocol", "both right, no third", "the first named is one of them"), both)
        )
    faulty = of(rows, "distractor")
    if faulty:
        cells = []
        for fault in ("metadata missing", "outliers", "dropouts", "jitter", "fine steps"):
            mine = [r for r in faulty if fault in r["faults"].split("+")]
            null, one = [r for r in mine if not r["truth"]], [r for r in mine if r["truth"]]
            cells.append((fault, share(null, claims), share(one, right)))
        parts.append(
            "## Harmless faults\n\n"
            + table(("fault", "no effect: one named", "one effect: right class"), cells)
        )
    placebo = of(rows, "placebo")
    if placebo:
        parts.append(
            "## Placebo\n\nEach record shows what the effect did to another one. Named all the same: "
            + share(placebo, _first)
            + "; verdicts: "
            + ", ".join(f"{v} {n}" for v, n in Counter(r["verdict"] for r in placebo).most_common())
            + "."
        )
    return "\n\n".join(parts)


def families(left_out: dict[str, list[Row]]) -> str:
    """Cases whose family the program did not have."""
    lines = []
    for family, rows in sorted(left_out.items()):
        mine = [r for r in of(rows, "single") if FAMILY.get(r["truth"]) == family]
        said = Counter(r["effects"] for r in mine if r["effects"])
        lines.append(
            (
                family,
                share(mine, unexplained),
                share(mine, lambda r: r["verdict"] == "attributed"),
                ", ".join(f"{w} {n}" for w, n in said.most_common()),
            )
        )
    return "## One family left out of the library\n\n" + table(
        ("family", "unexplained", "attributed to another", "named"), lines
    )


def timing(rows: Sequence[Row]) -> str:
    """Eight records of five thousand samples."""
    heading = ("case", "verdict", "seconds", "peak MB")
    lines = [(r["name"], r["verdict"] or r["problems"], r["seconds"], r["peak_mb"]) for r in rows]
    return "## Time: eight records of 5 000 samples, whole library, static map\n\n" + table(heading, lines)


def told_by(folder: Path) -> str:
    """What the studies printed: text files of a folder `studies`."""
    if folder.name != "studies":
        return ""
    parts = ["## Measured data: what the studies print"]
    for path in sorted(folder.glob("*.txt")):
        parts.append(f"### {path.stem}\n\n```text\n{path.read_text(encoding='utf-8').strip()}\n```")
    return "\n\n".join(parts)


def limits(rows: Sequence[Row]) -> str:
    """Faults of the program that were met."""
    broken = Counter(p for r in rows if r["problems"] for p in r["problems"].split("; "))
    if not broken:
        return ""
    lines = [f"- {what[:160]} ({n})" for what, n in broken.most_common(12)]
    return "## Breaches and failures\n\n" + "\n".join(lines)
