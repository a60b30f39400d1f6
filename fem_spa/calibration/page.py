"""report.html of a calibration: one self-contained page."""

from __future__ import annotations

import base64
import html
from pathlib import Path
from typing import Any

from fem_spa.calibration.outcome import Outcome
from fem_spa.calibration.words import quantity_text, verdict
from fem_spa.output.files import write_whole
from fem_spa.output.report_style import STYLE


def write_page(path: Path, outcome: Outcome, given: str, calibrated: str, command: str) -> None:
    """Write the page beside calibration.png, which it holds as data.

    given : file that was calibrated;  calibrated : text of the calibrated file;  command : to run it again
    """
    name = path.parent.resolve().name
    kind = {"done": "done", "interrupted": "interrupted"}.get(outcome.status, "stopped")
    picture = path.parent / "calibration.png"
    figure = ""
    if picture.is_file():
        data = base64.b64encode(picture.read_bytes()).decode("ascii")
        figure = (
            '<section class="pictures"><figure><img alt="measured and calculated" '
            f'src="data:image/png;base64,{data}"><figcaption>Held-out data were never used to fit.'
            "</figcaption></figure></section>\n"
        )
    body = [
        f'<header class="{kind}"><p class="name">{_text(name)}: calibration of {_text(given)}, '
        f"{_text(outcome.kind)}</p><h1>{_text(verdict(outcome))}</h1></header>\n",
        _tiles(outcome),
        _list("To know beside the numbers", outcome.warnings),
        _parameters(outcome),
        figure,
        _records(outcome),
        _list("What the reader of the files saw", outcome.notes),
        f"<section><h2>The calibrated file</h2><p>calibrated.toml</p><pre>{_text(calibrated.strip())}</pre>"
        f"</section>\n<section><h2>How to run it again</h2><pre>{_text(command)}</pre></section>\n",
    ]
    write_whole(
        path,
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{_text(name)} - fem_spa</title>'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><style>{STYLE}</style></head>\n'
        f"<body><main>\n{''.join(body)}</main></body></html>\n",
    )


def _text(value: Any) -> str:
    return html.escape(str(value))


def _list(title: str, texts: list[str]) -> str:
    if not texts:
        return ""
    items = "".join(f"<li>{_text(text)}</li>" for text in texts)
    return f'<section class="warnings"><h2>{_text(title)}</h2><ul>{items}</ul></section>\n'


def _tiles(outcome: Outcome) -> str:
    unit, shown = outcome.unit, outcome.shown
    low, high = (", ".join(f"{p / 1e3:.4g}" for p in end) for end in (outcome.valid.low, outcome.valid.high))
    runs = "FE runs" if outcome.kind == "finite elements" else "simulations"
    tiles = [
        ("error held out, before", f"{shown(outcome.before[1]):.3g} {unit}"),
        ("error held out, after", f"{shown(outcome.after[1]):.3g} {unit}"),
        ("error of the fit", f"{shown(outcome.after[0]):.3g} {unit}"),
        ("range of validity", f"{low} to {high} kPa"),
        (runs, str(outcome.evaluations)),
    ]
    cells = "".join(
        f"<div><strong>{_text(value)}</strong><span>{_text(label)}</span></div>" for label, value in tiles
    )
    return f'<section class="tiles">{cells}</section>\n'


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
        rows.append("<tr>" + "".join(f"<td>{_text(cell)}</td>" for cell in cells) + "</tr>")
    head = "".join(
        f"<th>{_text(cell)}</th>" for cell in ("number", "before", "after", "95 % interval", "allowed", "")
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
        rows.append("<tr>" + "".join(f"<td>{_text(cell)}</td>" for cell in cells) + "</tr>")
    unit = outcome.unit
    head = "".join(
        f"<th>{_text(cell)}</th>" for cell in ("file", "role", "rows", f"before [{unit}]", f"after [{unit}]")
    )
    return (
        "<section><h2>Data</h2><table class='numbers'><thead><tr>"
        f"{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></section>\n"
    )
