"""report.html of a calibration: one self-contained page."""

from __future__ import annotations

from pathlib import Path

from fem_spa.calibration.outcome import Outcome
from fem_spa.calibration.words import quantity_text, verdict
from fem_spa.output.files import write_whole
from fem_spa.output.page import document, escaped, notes, pictures, tiles

PICTURES = (("calibration.png", "Measured and calculated; held-out data were never used to fit."),)


def write_page(path: Path, outcome: Outcome, given: str, calibrated: str, command: str) -> None:
    """Write the page beside calibration.png, which it holds as data.

    given : file that was calibrated;  calibrated : text of the calibrated file;  command : to run it again
    """
    name = path.parent.resolve().name
    kind = {"done": "done", "interrupted": "interrupted"}.get(outcome.status, "stopped")
    sections = [
        f'<header class="{kind}"><p class="name">{escaped(name)}: calibration of {escaped(given)}, '
        f"{escaped(outcome.kind)}</p><h1>{escaped(verdict(outcome))}</h1></header>\n",
        _tiles(outcome),
        notes("To know beside the numbers", [escaped(text) for text in outcome.warnings]),
        _parameters(outcome),
        pictures(path.parent, PICTURES),
        _records(outcome),
        notes("What the reader of the files saw", [escaped(text) for text in outcome.notes]),
        f"<section><h2>The calibrated file</h2><p>calibrated.toml</p><pre>{escaped(calibrated.strip())}</pre>"
        f"</section>\n<section><h2>How to run it again</h2><pre>{escaped(command)}</pre></section>\n",
    ]
    write_whole(path, document(name, sections))


def _tiles(outcome: Outcome) -> str:
    unit, shown = outcome.unit, outcome.shown
    low, high = (", ".join(f"{p / 1e3:.4g}" for p in end) for end in (outcome.valid.low, outcome.valid.high))
    runs = "FE runs" if outcome.kind == "finite elements" else "simulations"
    numbers = [
        ("error held out, before", f"{shown(outcome.before[1]):.3g} {unit}"),
        ("error held out, after", f"{shown(outcome.after[1]):.3g} {unit}"),
        ("error of the fit", f"{shown(outcome.after[0]):.3g} {unit}"),
        ("range of validity", f"{low} to {high} kPa"),
        (runs, str(outcome.evaluations)),
    ]
    return tiles(numbers)


def _parameters(outcome: Outcome) -> str:
    rows = []
    for number in outcome.parameters:
        low, high = (quantity_text(end, number.unit) for end in (number.low, number.high))
        least, most = (quantity_text(end, number.unit) for end in number.bounds)
        value = quantity_text(number.value, number.unit)
        remark = ""
        if number.wanted is not None:
            value = f"kept at {value}"
            remark = (
                f"not accepted: the data ask for {quantity_text(number.wanted, number.unit)} ({number.why}). "
                f"Missing effect? {number.advice}; fem-spa diagnose looks for it."
            )
            low = high = ""
        ends = f"{low} to {high}" if low else ""
        start = quantity_text(number.start, number.unit)
        cells = (number.name, start, value, ends, f"{least} to {most}", remark)
        rows.append("<tr>" + "".join(f"<td>{escaped(cell)}</td>" for cell in cells) + "</tr>")
    head = "".join(
        f"<th>{escaped(cell)}</th>" for cell in ("number", "before", "after", "95 % interval", "allowed", "")
    )
    return (
        "<section><h2>Numbers</h2><div class='scroll'><table><thead><tr>"
        f"{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div></section>\n"
    )


def _records(outcome: Outcome) -> str:
    rows = []
    for run, role, before, after in outcome.runs:
        cells = (
            run.path.name,
            "held out" if role == "heldout" else "fitted",
            int(run.use.sum()),
            f"{outcome.shown(before):.3g}",
            f"{outcome.shown(after):.3g}",
        )
        rows.append("<tr>" + "".join(f"<td>{escaped(cell)}</td>" for cell in cells) + "</tr>")
    unit = outcome.unit
    head = "".join(
        f"<th>{escaped(cell)}</th>"
        for cell in ("file", "role", "rows", f"before [{unit}]", f"after [{unit}]")
    )
    return (
        "<section><h2>Data</h2><table class='numbers'><thead><tr>"
        f"{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></section>\n"
    )
