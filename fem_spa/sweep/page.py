"""report.html of a sweep: the verdict, what failed, pictures, and every case with the way to its own page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from fem_spa.output.files import write_whole
from fem_spa.output.page import document, escaped, facts, notes, pictures, tiles
from fem_spa.output.words import number
from fem_spa.sweep.case import Line
from fem_spa.sweep.cases import Case
from fem_spa.sweep.state import Request, Sweep
from fem_spa.sweep.table import folder_of, merged
from fem_spa.sweep.words import STATUS, best, failures, keys_words, verdict

MOST_ROWS = 500
MOST_NAMED = 4
COLUMNS = ("pressure", "angle [deg]", "force", "extension [mm]", "max stretch", "min gap [mm]")
"""Beginnings of the columns of curve.csv that the page shows; sweep.csv has all."""
PICTURES = (
    ("curves.png", "Every design's curve."),
    ("keys.png", "The end of the path over each key; lines join designs that differ in that key alone."),
    ("maps.png", "The end of the path over two keys; x: not solved."),
)

_STYLE = """
.sweep td:first-child, .sweep th:first-child { text-align: left; }
.sweep th { cursor: pointer; position: sticky; top: 0; background: #fff; }
.sweep th[data-order]::after { content: " \\25B2"; color: var(--soft); }
.sweep th[data-order="-1"]::after { content: " \\25BC"; }
.sweep .key { background: #f3f6fa; }
.sweep tr.bad td { color: var(--bad); }
.sweep .word { text-align: left; }
figure.keys, figure.maps { flex-basis: 100%; }
figure.keys img { max-height: none; }
figure.maps img { max-height: 900px; }
.sweep a { color: #1f5fa8; }
"""
# sorts the table by the column that is clicked; without it the page says the same
_SCRIPT = """
document.querySelectorAll("table.sweep").forEach(table => {
  const heads = [...table.querySelectorAll("th")], body = table.tBodies[0];
  heads.forEach((head, place) => head.addEventListener("click", () => {
    const order = head.dataset.order === "1" ? -1 : 1;
    heads.forEach(other => delete other.dataset.order);
    head.dataset.order = order;
    const of = row => row.cells[place].dataset.value ?? row.cells[place].textContent;
    [...body.rows].sort((a, b) => {
      const x = of(a), y = of(b), d = parseFloat(x) - parseFloat(y);
      if (x === "" || y === "") return (x === "") - (y === "");
      return order * (isNaN(d) ? x.localeCompare(y) : d);
    }).forEach(row => body.appendChild(row));
  }));
});
"""


def write_page(path: Path, sweep: Sweep, request: Request, warnings: Sequence[str]) -> None:
    """Write the page beside the pictures, which it holds as data.

    Parameters
    ----------
    warnings : of the pictures
    """
    name = path.parent.resolve().name
    sections = [
        _verdict(sweep, name),
        _tiles(sweep),
        _failures(sweep, warnings),
        pictures(path.parent, PICTURES),
        _table(sweep),
        _what_was_run(sweep, request),
    ]
    write_whole(path, document(name, sections, _STYLE, _SCRIPT))


def _verdict(sweep: Sweep, name: str) -> str:
    solved = sweep.count("done")
    kind = "done" if solved == len(sweep.plan.cases) else "interrupted" if solved else "stopped"
    lines = [sweep.message] if sweep.message else []
    message = "".join(f"<p>{escaped(text)}</p>" for text in (*lines, *best(sweep)))
    return (
        f'<header class="{kind}"><p class="name">{escaped(name)}: a sweep of fem_spa</p>'
        f"<h1>{escaped(verdict(sweep))}</h1>{message}</header>\n"
    )


def _tiles(sweep: Sweep) -> str:
    lines, solved = sweep.in_order(), sweep.count("done")
    work = sum(line.cost.get("seconds", 0.0) for line in lines)
    numbers = [
        ("designs", str(len(lines))),
        ("solved", str(solved)),
        ("not solved", str(len(lines) - solved)),
    ]
    if sweep.found:
        numbers.append(("of them run before this call", str(sweep.found)))
    numbers.append(("work of all cases", _duration(work)))
    numbers.append(("this call took", _duration(sweep.seconds)))
    return tiles(numbers)


def _duration(seconds: float) -> str:
    if seconds < 120:
        return f"{number(seconds, 3)} s"
    return f"{number(seconds / 60, 3)} min" if seconds < 7200 else f"{number(seconds / 3600, 3)} h"


def _failures(sweep: Sweep, warnings: Sequence[str]) -> str:
    items = []
    for status, reason, cases in failures(sweep):
        named = "; ".join(escaped(keys_words(sweep.plan, case)) for case in cases[:MOST_NAMED])
        more = f" and {len(cases) - MOST_NAMED} more" if len(cases) > MOST_NAMED else ""
        count = "1 design" if len(cases) == 1 else f"{len(cases)} designs"
        why = f": {escaped(reason)}" if reason and status != "waiting" else ""
        items.append(f"<b>{count} {STATUS.get(status, status)}</b>{why}<br><small>{named}{more}</small>")
    return notes("What is not solved", [*items, *map(escaped, warnings)])


def _table(sweep: Sweep) -> str:
    """A row a case: keys, how it ended, the end of its curve, the way to its page."""
    plan = sweep.plan
    lines = sweep.in_order()
    known = merged(line.end for line in lines)
    shown = [n for n in known if n.startswith((sweep.output.column, *COLUMNS)) and _any(lines, n)]
    names = [*(axis.title for axis in plan.axes), "status", *shown, "seconds", "case"]
    head = "".join(
        f'<th class="{"key" if k < len(plan.axes) else ""}">{escaped(name)}</th>'
        for k, name in enumerate(names)
    )
    rows = list(zip(plan.cases, lines, strict=True))[:MOST_ROWS]
    body = "".join(_row(sweep, case, line, shown) for case, line in rows)
    more = len(plan.cases) - MOST_ROWS
    rest = f"<p>{more} more are in sweep.csv.</p>" if more > 0 else ""
    return (
        "<section><h2>All designs</h2><p><small>A design's status leads to its own page, a click on a "
        "heading sorts; sweep.csv has further columns, and the folder of each.</small></p>"
        f'<div class="scroll"><table class="numbers sweep"><thead><tr>{head}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>{rest}</section>\n"
    )


def _any(lines: Sequence[Line], name: str) -> bool:
    """Whether a column has numbers; one of zeros (the angle of a straight actuator) says nothing."""
    return any(math.isfinite(value) and value for line in lines if (value := line.end.get(name)) is not None)


def _row(sweep: Sweep, case: Case, line: Line, shown: Sequence[str]) -> str:
    cells = []
    for value in case.values:
        data = "" if value.number is None else f' data-value="{value.number!r}"'
        cells.append(f'<td class="key"{data}>{escaped(value.label)}</td>')
    title = f' title="{escaped(line.reason)}"' if line.reason else ""
    place = folder_of(case)
    has_page = (sweep.folder / place / "report.html").is_file()
    word = f'<a href="{place}/report.html">{line.status}</a>' if has_page else line.status
    cells.append(f'<td class="word"{title}>{word}</td>')
    for name in (*shown, "seconds"):
        found = line.end.get(name, line.cost.get(name, math.nan))
        data, text = (repr(found), escaped(number(found, 4))) if math.isfinite(found) else ("", "")
        cells.append(f'<td data-value="{data}">{text}</td>')
    cells.append(f'<td class="word">{case.name}</td>')
    return f'<tr class="{"" if line.status == "done" else "bad"}">{"".join(cells)}</tr>'


def _what_was_run(sweep: Sweep, request: Request) -> str:
    plan = sweep.plan
    pairs = [("deck", str(request.deck))]
    for axis in plan.axes:
        if plan.sample and axis.interval:
            values = f"{axis.interval[0]:g} to {axis.interval[1]:g} {axis.unit}"
        else:
            listed = ", ".join(value.label for value in axis.values[:12])
            more = f" and {len(axis.values) - 12} more" if len(axis.values) > 12 else ""
            values = f"{listed}{more} {axis.unit}"
        pairs.append((axis.key, values.strip()))
    how = (
        f"{plan.sample} points of a Sobol sequence, seed {request.seed}"
        if plan.sample
        else "every combination"
    )
    pairs.append(("designs", how + (f"; {plan.twins} are the same as others" if plan.twins else "")))
    for text in request.overrides:
        pairs.append(("set", text))
    meshes = len({case.mesh for case in plan.cases if case.mesh})
    pairs.append(("meshes", f"{meshes}, shared by the designs that differ in materials and loads only"))
    pairs.append(("run by", sweep.engine))
    memory = [line.cost.get("memory [MB]", math.nan) for line in sweep.in_order()]
    known = [value for value in memory if math.isfinite(value)]
    if known:
        pairs.append(("memory", f"{max(known):.0f} MB at most in one process"))
    table = facts((name, escaped(value)) for name, value in pairs)
    return (
        f"<section><h2>What was run</h2>{table}</section>\n"
        "<section><h2>How to go on</h2><p>The same call runs only what has not ended yet; with more "
        f"values, only those that are new.</p><pre>{escaped(request.command)}</pre></section>\n"
    )
