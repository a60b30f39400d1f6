"""report.html of a diagnosis: one page for a person, the verdict first, then what one would ask next."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.signatures.told import cells
from fem_spa.output.files import write_whole
from fem_spa.output.page import document, escaped, pictures
from fem_spa.output.words import number

if TYPE_CHECKING:
    from fem_spa.loop.diagnose import Study
    from fem_spa.loop.records import Record

COLOUR = {"attributed": "done", "none": "done", "ambiguous": "interrupted"}
NEEDED = (
    "What it takes: records with time, pressure and an output that moves, some 40 samples at least, of the "
    "actuator that the model describes, with the right units in their headers."
)
MEANS = {
    "attributed": "The remainder has the shape of this effect, and the model with it fits left-out records. "
    "That is consistent with the effect; an experiment of its own would confirm it.",
    "ambiguous": "Several effects account for the remainder about equally well with these records. "
    "The next experiment below is the one that would tell them apart.",
    "unexplained": "There is structure that follows from what was done to the actuator, but no effect of the "
    "library, alone or together, accounts for enough of it. Nothing was added to the model.",
    "none": "What is left looks like noise and the scatter from record to record. "
    "The limits below say how small each effect must be to have escaped.",
}


def write_page(study: Study, report: dict[str, Any], out: Path) -> None:
    """Write the page and its pictures into `out`."""
    from fem_spa.loop.pictures import certificate_picture, loops, motion, rates

    first = [
        (motion(study), "motion.png", "Measured, model before and model after; beneath, what each leaves."),
        (loops(study), "residual.png", "What is left over the pressure, by direction: a loop is memory."),
    ]
    more = [
        (rates(study), "rates.png", "Loops by rate, and how long the remainder remembers itself."),
        (
            certificate_picture(study),
            "certificate.png",
            "From the commands alone: dark pairs look alike in these records, whatever was measured.",
        ),
    ]
    for data, file, _ in (*first, *more):
        write_whole(out / file, data)
    name = out.resolve().name
    page = document(
        name,
        [
            _verdict(report, escaped(name)),
            _tiles(report),
            _warnings(report),
            *(pictures(out, [(file, words)]) for _, file, words in first),
            _effects(report),
            _solved_again(report),
            _next(report, out),
            _records(study, report),
            _places(report),
            _excluded(report),
            _section("Behind it", "".join(pictures(out, [(file, words)]) for _, file, words in more)),
            _audit(report),
        ],
    )
    write_whole(out / "report.html", page)


def write_short_page(
    report: dict[str, Any],
    records: Sequence[Record],
    names: Sequence[str],
    rows: Sequence[np.ndarray],
    out: Path,
) -> None:
    """The page of `insufficient`: why, what would do, what was measured beside the model.

    rows : (n, d) predictions of each record in SI, or none
    """
    from fem_spa.loop.pictures import measured_beside

    name = out.resolve().name
    above = f"{escaped(name)}: a diagnosis by fem_spa &middot; verdict <b>insufficient</b>"
    words = "Nothing was added to the model, and nothing can be said about any effect. " + NEEDED
    reason = escaped(report["reasons"][0])
    sections = [
        f'<header class="stopped"><p class="name">{above}</p>'
        f"<h1>These records cannot tell: {reason}.</h1><p>{escaped(words)}</p></header>\n"
    ]
    if len(rows):
        data = measured_beside(records[0], names, rows[0])
        write_whole(out / "motion.png", data)
        sections.append(pictures(out, [("motion.png", "The first record, and the model on its pressures.")]))
    write_whole(out / "report.html", document(name, [*sections, _audit(report)]))


def _section(title: str, content: str) -> str:
    return f"<section><h2>{title}</h2>{content}</section>\n"


def _row(cells: Sequence[str], tag: str = "td") -> str:
    """A table row; with `th` as tag its first cell heads it."""
    if tag == "th":
        return f"<tr><th>{cells[0]}</th>" + "".join(f"<td>{cell}</td>" for cell in cells[1:]) + "</tr>"
    return "<tr>" + "".join(f"<{tag}>{cell}</{tag}>" for cell in cells) + "</tr>"


def _heads(cells: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<th>{cell}</th>" for cell in cells) + "</tr>"


def _verdict(report: dict[str, Any], name: str) -> str:
    from fem_spa.loop.told import sentence

    kind = COLOUR.get(report["verdict"], "stopped")
    words = MEANS.get(report["verdict"], "")
    signature = f"<p>It looks like this: {escaped(report['signature'])}.</p>" if report["signature"] else ""
    above = f"{name}: a diagnosis by fem_spa &middot; verdict <b>{escaped(report['verdict'])}</b>"
    return (
        f'<header class="{kind}"><p class="name">{above}</p>'
        f"<h1>{escaped(sentence(report))}</h1><p><b>{escaped(plainly(report))}</b></p>"
        f"<p>{escaped(words)}</p>{signature}</header>\n"
    )


def plainly(report: dict[str, Any]) -> str:
    """What it comes to, for one who knows the actuator and no statistics."""
    held, unit, span = report["error"]["heldout"], report["error"]["unit"], report["error"]["span"]
    if held["before"] is None:
        return ""
    before = f"On records kept aside the model errs by {number(held['before'], 3)} {unit}"
    before += f" ({100 * held['before'] / span:.2g} % of the range)"
    if not report["effects"]:
        return before + "."
    after, names = held["after"], [e["name"] for e in report["effects"]]
    less = 100 * (1.0 - after / held["before"]) if held["before"] else 0.0
    change = f"{less:.0f} % less" if less >= 0 else f"{-less:.0f} % more"
    text = f"{before}; with {' and '.join(names)} in it by {number(after, 3)} {unit}, {change}."
    return f"{text} " + " ".join(f"What {n} looks like: {EFFECTS[n].words}." for n in names)


def _tiles(report: dict[str, Any]) -> str:
    held, unit = report["error"]["heldout"], escaped(report["error"]["unit"])
    repeated = held["floor_from"].startswith("repeats")
    labels = {
        "before": "error before, records not used",
        "after": "error after, the same records",
        "floor": "how far repeats differ" if repeated else "about the least that any model could reach",
    }
    tiles = [(f"{number(held[k], 3)} {unit}", word) for k, word in labels.items() if held[k] is not None]
    tiles.append((f"{number(report['error']['span'], 3)} {unit}", "range of the output"))
    if report["effects"]:
        tiles.append((f"{100 * report['explained']:.0f} %", "of what could be explained is explained"))
    cells = (f"<div><strong>{value}</strong><span>{escaped(label)}</span></div>" for value, label in tiles)
    return f'<section class="tiles">{"".join(cells)}</section>\n'


def _warnings(report: dict[str, Any]) -> str:
    """What a reader must know beside the verdict."""
    said = list(report["reasons"])
    if report["provisional"]:
        said.append("one record only: its last third was held out, and the verdict is provisional")
    train, held = report["error"]["train"]["before"], report["error"]["heldout"]["before"]
    if train and held and held > 3.0 * train:
        said.append(
            f"the held-out records err {held / train:.1f} times more than the training records before "
            "anything is added: they ask for something that the training records do not show"
        )
    if not said:
        return ""
    items = "".join(f"<li>{escaped(text)}</li>" for text in said)
    return f'<section class="warnings"><h2>To know beside it</h2><ul>{items}</ul></section>\n'


def _effects(report: dict[str, Any]) -> str:
    if not report["effects"]:
        return ""
    rows = _heads(["effect", "weight", "what it looks like", "parameters (95 %)", "as good in its place"])
    for effect in report["effects"]:
        name = effect["name"]
        numbers = "<br>".join(_parameter(n, p) for n, p in effect["parameters"].items())
        weight = f"{100 * effect['probability']:.0f} %"
        rivals = escaped(", ".join(effect["rivals"]) or "none")
        rows += _row([escaped(name), weight, escaped(EFFECTS[name].words), numbers, rivals], "th")
    after = (
        "<p>The model with it is <code>model_next.toml</code>; <code>fem-spa diagnose</code> and "
        "<code>fem-spa simulate</code> read it.</p>"
    )
    return _section("What was added", f"<table>{rows}</table>{after}{_marks(report)}")


def _marks(report: dict[str, Any]) -> str:
    """A row an effect: its own mark in what the model leaves, before and after."""
    rows = _heads(["effect", "its own mark", "left before", "left after", ""])
    marks = [(e["name"], e["signature"]) for e in report["effects"] if e["signature"]]
    if not marks:
        return ""
    for name, mark in marks:
        place = f" <small>({escaped(mark['at'])})</small>" if mark["at"] else ""
        rows += _row([escaped(name), escaped(mark["statistic"]) + place, *map(escaped, cells(mark))], "th")
    words = (
        "A model that lacks an effect leaves the effect's own mark in its error: it should be there before "
        "and gone after. Figures within three times their noise may be noise."
    )
    return f'<p>{words}</p><div class="scroll"><table>{rows}</table></div>'


def _solved_again(report: dict[str, Any]) -> str:
    """Effects in the deck itself: a row each, its error beside the block's."""
    if not report["solved_again"]:
        return ""
    unit = escaped(report["error"]["unit"])
    heads = ["effect", "what was solved", "number (95 %)", "block", "deck", "last word"]
    rows = _heads([f"{h}, not used [{unit}]" if h in ("block", "deck") else h for h in heads])
    for row in report["solved_again"]:
        p = row["parameter"]
        numbers = "" if p is None else _parameter(p["name"], p)
        errors = [
            "" if row[k]["heldout"] is None else number(row[k]["heldout"], 3) for k in ("block", "deck")
        ]
        rows += _row(
            [escaped(row["name"]), escaped(row["form"]), numbers, *errors, "deck" if row["used"] else ""],
            "th",
        )
    words = (
        "A block stands for an effect on the pressure or the output. Here the deck was solved with it, too; "
        "training records alone chose between the two."
    )
    return _section("Solved again", f'<p>{words}</p><div class="scroll"><table>{rows}</table></div>')


def _parameter(name: str, p: dict[str, Any]) -> str:
    text = f"{escaped(name)} {number(p['value'], 3)} {escaped(p['unit'])}"
    if p["low"] is None:
        return text
    return f"{text} <small>({number(p['low'], 3)} to {number(p['high'], 3)})</small>"


def _next(report: dict[str, Any], out: Path) -> str:
    plan = report["next_experiment"]
    if plan is None:
        return ""
    words = f"<b>{escaped(plan['what'])}</b>: {escaped(plan['why'])}."
    file = f"The pressures to command are in <code>{escaped(plan['profile'])}</code>."
    picture = ""
    if "foretold" in plan:
        file += f" What each explanation foretells is in <code>{escaped(plan['foretold'])}</code>."
        caption = "What each explanation foretells: where the bands part, one run decides."
        picture = pictures(out, [("next_experiment.png", caption)])
    return _section("Next experiment", f"<p>{words} {file}</p>{picture}")


def _records(study: Study, report: dict[str, Any]) -> str:
    """A row a record: error before and after, as a share of the span, the largest error, the learner's."""
    from fem_spa.loop.report_json import unit_size

    unit, span = report["error"]["unit"], report["error"]["span"]
    names = study.after.base.names
    size = unit_size(unit, names[0])
    heads = ["record", "role", "before", "after", "after, % of range", "largest after", "floor (learner)"]
    rows = _heads([f"{h} [{escaped(unit)}]" if 1 < i != 4 else h for i, h in enumerate(heads)])
    for row, record, after, floor in zip(
        report["error"]["records"], study.case.split.records, study.after_rows, study.floor_rows, strict=True
    ):
        y = np.stack([record.outputs[name] for name in names], axis=1)
        most = float(np.nanmax(np.linalg.norm(y - after, axis=1))) / size
        least = float(np.sqrt(np.nanmean(np.sum((y - floor) ** 2, axis=1)))) / size
        word = "not used" if row["role"] == "heldout" else "training"
        if record.name == study.case.split.extrapolating:
            word += ", goes furthest"
        share = f"{100 * row['after'] / span:.2f}"
        figures = [
            number(row["before"], 3),
            number(row["after"], 3),
            share,
            number(most, 3),
            number(least, 3),
        ]
        rows += _row([escaped(row["file"]), word, *figures], "th")
    return _section("Error by record", f'<div class="scroll"><table class="numbers">{rows}</table></div>')


def _places(report: dict[str, Any]) -> str:
    """Where in the chain what the model left before sits: a row a slot."""
    if not report["localisation"]:
        return ""
    rows = _heads(["slot of the chain", "number that may wander", "foretold, left out", "how it goes"])
    for place in report["localisation"]:
        share = f"{100 * max(place['explained'], 0.0):.0f} %"
        rows += _row([escaped(place["slot"]), escaped(place["knob"]), share, escaped(place["path"])], "th")
    words = (
        "If one number of the chain were free to wander through the records: how much of what the model "
        "leaves (before anything is added) it would foretell on stretches of time left out. The slot at "
        "fault has one that does well and is steady, or goes along with its cause. The verdict does not use "
        "it."
    )
    return _section("Where it sits", f"<p>{words}</p><table>{rows}</table>")


def _excluded(report: dict[str, Any]) -> str:
    parts = ""
    if report["excluded"]:
        rows = "".join(
            _row([escaped(item["name"]), f"{number(item['limit'], 2)} {escaped(item['unit'])}"], "th")
            for item in report["excluded"]
            if item["limit"] is not None
        )
        parts += _folded("not seen: how large each may still be (RMS that would have shown)", rows)
    if report["untestable"]:
        rows = "".join(_row([escaped(i["name"]), escaped(i["why"])], "th") for i in report["untestable"])
        parts += _folded("not testable with these records", rows)
    return _section("What it is not", parts) if parts else ""


def _folded(summary: str, rows: str) -> str:
    return f"<details><summary>{summary}</summary><table>{rows}</table></details>"


def _audit(report: dict[str, Any]) -> str:
    notes = "".join(
        _row([escaped(item["file"]), escaped("; ".join(item["notes"]) or "nothing odd")], "th")
        for item in report["audit"]
    )
    files = "".join(
        _row([escaped(item["file"]), f"<small>sha256 {item['sha256'][:16]}</small>"], "th")
        for item in report["inputs"]
    )
    versions = ", ".join(f"{name} {text}" for name, text in report["versions"].items())
    again = f"<p><small>seed {report['seed']}; {escaped(versions)}</small></p>"
    return _section("Audit of the records", f"<table>{notes}</table>") + _section(
        "To run it again", f"<table>{files}</table>{again}"
    )
