"""The verdict `insufficient`: a report that says why, the predictions all the same, and a short page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.loop.audit import remarks
from fem_spa.loop.compose import Chain
from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.model_file import Source
from fem_spa.loop.records import Record
from fem_spa.loop.report_json import (
    clean,
    empty_errors,
    errors,
    inputs,
    prediction_table,
    versions,
)
from fem_spa.loop.simulate import predicted
from fem_spa.output.files import write_whole


def unable(
    why: str,
    records: Sequence[Record],
    train: Sequence[bool],
    source: Source,
    files: Sequence[Path],
    seed: int,
    out: Path,
    page: bool = True,
    chain: Chain | None = None,
) -> dict[str, Any]:
    """Write everything and return the report.

    Parameters
    ----------
    records : as read, each whole;  train : which may be fitted; both () where none could be read
    chain : the refitted base, where it came so far; else the model as it is predicts
    """
    have = set(records[0].outputs) if records else set()
    names = [o.name for o in source.model.outputs if not have or o.name in have]
    first = next((n for n in ("angle", "displacement", "force") if n in names), None)
    names = names if first is None else [first]
    rows: list[np.ndarray] = []
    if records and all(len(r.time) > 1 for r in records):
        rows = predicted(source, records, names, chain)
    table = empty_errors(records, train, names)
    if rows and all(np.isfinite(r.outputs[n]).any() for r in records for n in names):
        table = errors(records, train, names, rows, rows, None, "")
    report: dict[str, Any] = {
        "verdict": "insufficient",
        "effects": [],
        "candidates": [],
        "error": table,
        "signature": "",
        "excluded": [],
        "untestable": [{"name": name, "why": why} for name in EFFECTS],
        "next_experiment": None,
        "seed": seed,
        "versions": versions(),
        "inputs": inputs(files),
        "reasons": [why],
        "audit": [{"file": r.path.name, "notes": remarks(r)} for r in records],
    }
    report = clean(report)
    (out / "predictions").mkdir(parents=True, exist_ok=True)
    for record, row in zip(records, rows, strict=False):
        text = prediction_table(record, names, row, row)
        write_whole(out / "predictions" / f"{record.name}.csv", text)
    if page:
        from fem_spa.loop.page import write_short_page

        write_short_page(report, records, names, rows, out)
    write_whole(out / "report.json", json.dumps(report, indent=1) + "\n")
    return report
