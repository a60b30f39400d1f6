"""What was said: by name of the truth, where it was wrong, outside the library, with faults, in a placebo."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.loop.classes import FAMILY, same_class
from benchmarks.loop.counts import (
    Row,
    claims,
    counted,
    first,
    middle,
    of,
    right,
    said,
    share,
    table,
    visible,
)


def answers(rows: Sequence[Row]) -> str:
    """All tables of answers."""
    parts = [by_name(visible(rows, "single")), wrong_one(visible(rows, "single"))]
    parts += [wrong_two(visible(rows, "pair")), strange(visible(rows, "strange"))]
    parts += [faults(of(rows, "distractor")), placebo(of(rows, "placebo")), reliability(rows)]
    return "\n\n".join(part for part in parts if part)


def by_name(single: Sequence[Row]) -> str:
    lines = []
    for name in FAMILY:
        mine = [r for r in single if r["truth"] == name]
        if mine:
            unnamed = [r for r in mine if not claims(r)]
            lines.append((name, share(mine, right), str(len(unnamed)), middle(mine, "reduction")))
    return "## One effect: by name\n\n" + table(("truth", "right class", "not named", "reduction"), lines)


def wrong_one(single: Sequence[Row]) -> str:
    """One effect, where the class was not right."""
    wrong = [r for r in single if not right(r)]
    lines = [(n, counted(said(r) for r in wrong if r["truth"] == n)) for n in FAMILY]
    told = [line for line in lines if line[1]]
    return "## One effect: what was said where the class was wrong\n\n" + table(("truth", "said"), told)


def wrong_two(pair: Sequence[Row]) -> str:
    """Two effects, where not both were told, or a third was."""
    wrong = [r for r in pair if not right(r)]
    if not wrong:
        return ""
    truths = sorted({_sorted(r["truth"]) for r in wrong})
    lines = [(t, counted(_sorted(said(r)) for r in wrong if _sorted(r["truth"]) == t)) for t in truths]
    return (
        "## Two effects: what was said where it was not right\n\n"
        + f"Of {len(pair)}, {len(wrong)}: {counted(map(miss, wrong))}. A classmate that the records do not"
        + " set apart counts as the effect itself.\n\n"
        + table(("truth", "said"), lines)
    )


def _sorted(names: str) -> str:
    return " + ".join(sorted(names.split("+")))


def miss(row: Row) -> str:
    """In what way an answer to two effects is not right."""
    if not claims(row):
        return row["verdict"]
    apart = row["protocol"] == "D+"
    classes = [same_class(name, apart, apart, apart) for name in row["truth"].split("+")]
    names = row["effects"].split("+")
    hit = sum(any(name in group for name in names) for group in classes)
    stray = any(all(name not in group for group in classes) for name in names)
    if hit == len(classes):
        return "both and a third" if len(names) > len(classes) else "both, one by a neighbour's name"
    if hit:
        return "one, and one that is not there" if stray else "one of the two"
    return "neither"


def strange(rows: Sequence[Row]) -> str:
    if not rows:
        return ""
    names = sorted({r["truth"] for r in rows})
    lines = [(name, counted(said(r) for r in rows if r["truth"] == name)) for name in names]
    return "## Outside the library: what was said\n\n" + table(("truth", "said"), lines)


def faults(rows: Sequence[Row]) -> str:
    """Records with faults that are no effect."""
    if not rows:
        return ""
    cells = []
    for fault in ("metadata missing", "outliers", "dropouts", "jitter", "fine steps"):
        mine = [r for r in rows if fault in r["faults"].split("+")]
        null, one = [r for r in mine if not r["truth"]], [r for r in mine if r["truth"]]
        cells.append((fault, share(null, claims), share(one, right)))
    heading = ("fault", "no effect: one named", "one effect: right class")
    return "## Harmless faults\n\n" + table(heading, cells)


def placebo(rows: Sequence[Row]) -> str:
    if not rows:
        return ""
    told = counted(r["verdict"] for r in rows)
    return (
        "## Placebo\n\nEach record shows what the effect did to another one. Named all the same: "
        f"{share(rows, first)}; verdicts: {told}."
    )


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
        lines.append((f"{low:g} to {high:g}", mean, exact, share(some, first)))
    heading = ("probability of the first name", "its mean", "it was the truth's name", "it was of its class")
    return "## Probabilities\n\n" + table(heading, lines)
