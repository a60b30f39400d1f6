"""docs/loop.md from the rows of one or more result folders."""

from __future__ import annotations

import datetime
import os
import platform
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from benchmarks.loop.aims import aims
from benchmarks.loop.answers import answers
from benchmarks.loop.classes import SAME_FORM
from benchmarks.loop.counts import Row, table
from benchmarks.loop.kinds_page import kinds_of, kinds_section, put
from benchmarks.loop.left_out import PREFIX, families, left_out
from benchmarks.loop.splits import splits
from benchmarks.loop.tables import rows_of

DATA = """## Where the measured data are from

None of them is in this repository. The studies look in the folder that `FEM_SPA_DATA` names.

| folder | source | licence |
|---|---|---|
| eth_ds10_cantilever | github.com/srl-ethz/diffPD_sim2real, python/realbeam_experiments | MIT |
| zigzag_spa_ubc | github.com/HiroshanGunawardane/ML_SelectiveStiffness-, Modular_Stiffness- | MIT |
| asu_4chamber_arm | github.com/ASU-RISE-Lab/4-chamber-softarm-control | MIT |
| ecoflex_compression_qmul | github.com/abubakardawood/tissue-phantom-material-database | CC BY 4.0 |"""
REMARKS = Path(__file__).with_name("remarks.md")
"""What a person says of the tables: where it falls short, and why."""


def write_page(folders: Sequence[Path], page: Path, engine: str = "") -> None:
    """Write the page of result folders; `engine` names the version that ran.

    A folder `without-FAMILY` holds cases run with that family left out, `timing` those of full length,
    `studies` what the studies printed. A truncated run of some folders is as good as a whole one. Where all
    folders are of `kinds` (kinds.csv), only that section of a page that is there is written anew.
    """
    kinds = kinds_of(folders)
    if page.is_file() and folders and all((f / "kinds.csv").is_file() for f in folders):
        put(page, kinds_section(kinds, engine))
        return
    special = (PREFIX, "timing", "studies")
    full = [row for f in folders if not f.name.startswith(special) for row in rows_of(f / "results.csv")]
    full = list({row["name"]: row for row in full}.values())
    timed = [row for f in folders if f.name == "timing" for row in rows_of(f / "results.csv")]
    parts = [
        head(full, engine),
        aims(full, timed, kinds),
        REMARKS.read_text(encoding="utf-8").strip() if REMARKS.is_file() else "",
        splits(full),
        answers(full),
        families(left_out(folders)),
        timing(timed) if timed else "",
        kinds_section(kinds, engine) if kinds else "",
        limits(full),
        *(told_by(f) for f in folders),
        DATA,
    ]
    page.write_text("\n\n".join(part for part in parts if part) + "\n", encoding="utf-8")


def head(rows: Sequence[Row], engine: str) -> str:
    today = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d")
    count = Counter(row["tier"] for row in rows)
    told = ", ".join(f"{n} {tier}" for tier, n in count.items())
    failed = [row for row in rows if row["status"] != "0"]
    return f"""# The loop, tested blind

Written by `python -m benchmarks.loop page` on {today}; {platform.machine()}, {os.cpu_count()} cores with
other work on them, one thread a case. Program: {engine or "this version"}.

The records come from `benchmarks/loop`, a generator that shares no code with the library of effects and has
other functional forms: relays and a Duhem equation for hysteresis, power laws and Eyring flow for creep,
orifices for pressure lag, a heavy chain of links for gravity, tables for softening, and so on. Three forms
are alike all the same, but for their parameters, and have a row of their own among the aims:
{"; ".join(SAME_FORM.values())}.
In part alike: friction of both has a limit that is affine in the motion (`_rub` in the angle, the library
stick + rub |s|), the way up to it is another; a dead time is a dead time (the generator's is longer at low
pressure); and over some ten kelvin Arrhenius is nearly linear.

The size of an effect is what the refitted base model leaves of it, RMS as a share of the span. Each record
has white and AR(1) noise and an offset and a gain of its own. The program is given the base model and the
records, by files, and is run as a user runs it. Half of the cases name their held-out records, in the
others the program chooses.

Cases: {len(rows)} ({told}); {len(failed)} did not end with status 0. Brackets: k of n; 95 % interval.
Seeds of this page were kept apart while the program was made (see below). More: `python -m benchmarks.loop
run`."""


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
