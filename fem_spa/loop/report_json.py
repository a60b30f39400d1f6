"""report.json and the predictions: the contract's keys, in the units of the records."""

from __future__ import annotations

import hashlib
import importlib.metadata
import math
import platform
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa import __version__
from fem_spa.loop.records import OUTPUTS, Record
from fem_spa.units import quantity


def unit_size(unit: str, name: str) -> float:
    """SI units in one unit shown."""
    return quantity(f"1 {unit}", OUTPUTS[name], name)


def rmse(residual: np.ndarray) -> float | None:
    """Root of the mean squared norm of (n, d) errors; None where there is no sample."""
    good = np.isfinite(residual).all(axis=1)
    return float(np.sqrt(np.mean(np.sum(residual[good] ** 2, axis=1)))) if good.any() else None


def errors(
    records: Sequence[Record],
    train: Sequence[bool],
    names: Sequence[str],
    before: Sequence[np.ndarray],
    after: Sequence[np.ndarray],
    floor: Sequence[np.ndarray] | None,
    floor_from: str,
) -> dict[str, Any]:
    """The `error` table. `before`, `after`, `floor`: predictions (n, d) at the records' own samples."""
    unit = records[0].units[names[0]]
    size = unit_size(unit, names[0])

    def measured(record: Record) -> np.ndarray:
        return np.stack([record.outputs[name] for name in names], axis=1)

    def over(predictions: Sequence[np.ndarray], role: bool) -> float | None:
        rows = [measured(r) - p for r, p, t in zip(records, predictions, train, strict=True) if t is role]
        value = rmse(np.concatenate(rows)) if rows else None
        return None if value is None else value / size

    spans = []
    for j in range(len(names)):
        column = np.concatenate([measured(r)[:, j] for r in records])
        spans.append(float(np.ptp(column[np.isfinite(column)])) / size)
    table = []
    for record, fit, b, a in zip(records, train, before, after, strict=True):
        pair = [rmse(measured(record) - p) for p in (b, a)]
        table.append(
            {
                "file": record.path.name,
                "role": "train" if fit else "heldout",
                "before": None if pair[0] is None else pair[0] / size,
                "after": None if pair[1] is None else pair[1] / size,
            }
        )
    return {
        "unit": unit,
        "span": max(spans),
        "train": {"before": over(before, True), "after": over(after, True)},
        "heldout": {
            "before": over(before, False),
            "after": over(after, False),
            "floor": None if floor is None else over(floor, False),
            "floor_from": floor_from,
        },
        "records": table,
    }


def empty_errors(records: Sequence[Record], train: Sequence[bool], names: Sequence[str]) -> dict[str, Any]:
    """The `error` table without figures."""
    unit = records[0].units.get(names[0]) if records else None
    none = {"before": None, "after": None}
    return {
        "unit": unit,
        "span": None,
        "train": dict(none),
        "heldout": {**none, "floor": None, "floor_from": ""},
        "records": [
            {"file": r.path.name, "role": "train" if t else "heldout", **none}
            for r, t in zip(records, train, strict=True)
        ],
    }


def prediction_table(record: Record, names: Sequence[str], before: np.ndarray, after: np.ndarray) -> str:
    """CSV of one record: time, and each output before and after, in the record's units."""
    header, columns = ["time [s]"], [record.time]
    for j, name in enumerate(names):
        unit = record.units[name]
        size = unit_size(unit, name)
        for word, values in (("before", before), ("after", after)):
            header.append(f"{word} {name} [{unit}]")
            columns.append(values[:, j] / size)
    lines = [",".join(header)]
    lines += [",".join(f"{v:.9g}" for v in row) for row in np.stack(columns, axis=1)]
    return "\n".join(lines) + "\n"


def versions() -> dict[str, str]:
    """What the numbers depend on."""
    found = {"fem_spa": __version__, "python": platform.python_version()}
    for name in ("numpy", "scipy"):
        found[name] = importlib.metadata.version(name)
    return found


def inputs(paths: Sequence[Path]) -> list[dict[str, str]]:
    """Base names and hashes of everything that was read, what model and deck name included."""
    every = dict.fromkeys(q for p in paths if p.is_file() for q in (p, *_named_in(p)))
    return [{"file": p.name, "sha256": hashlib.sha256(p.read_bytes()).hexdigest()} for p in every]


def _named_in(path: Path) -> list[Path]:
    """Files beside a TOML file whose names stand in it, and in those."""
    if path.suffix != ".toml":
        return []
    waiting: list[Any] = [tomllib.loads(path.read_text(encoding="utf-8"))]
    found: list[Path] = []
    while waiting:
        item = waiting.pop()
        if isinstance(item, (Mapping, list)):
            waiting += [*item.values()] if isinstance(item, Mapping) else item
        elif isinstance(item, str) and 0 < len(item) < 250 and "\0" not in item:
            file = path.parent / item
            if file.is_file() and file not in found:
                found += [file, *_named_in(file)]
    return found


def clean(value: Any) -> Any:
    """Plain numbers, and null where one is not finite."""
    if isinstance(value, Mapping):
        return {str(k): clean(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [clean(v) for v in value]
    if isinstance(value, (np.floating, float)):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, np.integer):
        return int(value)
    return value
