"""A model file with its effects over the drive of records; nothing is fitted."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fem_spa.loop.base import base_of
from fem_spa.loop.compose import Chain
from fem_spa.loop.data import build
from fem_spa.loop.model_file import Source, read_source
from fem_spa.loop.physical import whole
from fem_spa.loop.prepare import outputs_of
from fem_spa.loop.records import Record, read_records
from fem_spa.loop.report_json import rmse, unit_size
from fem_spa.output.files import write_whole
from fem_spa.reduced.checks import outside
from fem_spa.reduced.model import Drive


def simulate(model: Path, paths: Sequence[Path], out: Path) -> list[str]:
    """Write predictions/<record>.csv into `out`; a line of words a record.

    Raises
    ------
    InputError
        where model or records are wrong, or do not fit each other
    """
    source = read_source(model, out)
    records = read_records(paths)
    names = outputs_of(source.model, records)
    lines = []
    (out / "predictions").mkdir(parents=True, exist_ok=True)
    for record, found in zip(records, predicted(source, records, names), strict=True):
        measured = np.stack([record.outputs[name] for name in names], axis=1)
        unit = record.units[names[0]]
        error = rmse(measured - found)
        heads = ["time [s]", *(f"{name} [{record.units[name]}]" for name in names)]
        sizes = [unit_size(record.units[name], name) for name in names]
        table = np.column_stack([record.time, found / sizes])
        text = "\n".join([",".join(heads), *(",".join(f"{v:.9g}" for v in row) for row in table)])
        write_whole(out / "predictions" / f"{record.name}.csv", text + "\n")
        words = "nothing measured" if error is None else f"error {error / sizes[0]:.4g} {unit}"
        beyond = outside(source.model, Drive(record.time, record.pressures))
        lines.append(f"{record.name}: {words}" + (f"; {beyond}" if beyond else ""))
    return lines


def predicted(
    source: Source, records: Sequence[Record], names: Sequence[str], chain: Chain | None = None
) -> list[np.ndarray]:
    """(n, d) in SI at each record's own samples, by a model file and its whole motion, or by `chain`."""
    data = build(records, [True] * len(records), names, 10**9)
    if chain is None:
        base = base_of(source.model, names, data.pressure.min(axis=0), data.pressure.max(axis=0))
        d = len(names)
        nothing = Chain(base, 1.0, np.zeros(d), (), (), np.ones(d), np.zeros(d), 1, 1, 1)
        chain = source.chain(base) if source.effects else nothing
        rows = whole(chain).predict(data)
        if source.model.kind == "kelvin-voigt" and "offset" in source.model.parameters:
            rows = rows + source.model.parameters["offset"].value
    else:
        rows = chain.predict(data)
    out = []
    for record, run in zip(records, data.runs, strict=True):
        grid = record.time[0] + run.step * np.arange(run.part.stop - run.part.start)
        out.append(np.stack([np.interp(record.time, grid, column) for column in rows[run.part].T], axis=1))
    return out
