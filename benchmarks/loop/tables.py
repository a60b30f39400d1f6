"""CSV files: records and predictions as columns, results as rows that are added one by one."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np


def columns_of(path: Path) -> dict[str, np.ndarray]:
    """Columns of a CSV, lines from # on passed over, empty cells nan."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.reader(line for line in file if not line.startswith("#"))]
    values = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows[1:]])
    return dict(zip(rows[0], values.T, strict=True))


def rows_of(table: Path) -> list[dict[str, str]]:
    """Rows of a results file, none where there is none."""
    if not table.is_file():
        return []
    with table.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def add_row(table: Path, columns: Sequence[str], row: Mapping[str, Any]) -> None:
    """Append a row to a results file, which begins with its columns and keeps those that it began with."""
    fresh = not table.exists()
    if not fresh:
        with table.open(encoding="utf-8", newline="") as file:
            columns = next(csv.reader(file))
    with table.open("a", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, extrasaction="ignore")
        if fresh:
            writer.writeheader()
        writer.writerow(row)
