"""A study on a smaller deck through the command line: its own words and files, in seconds."""

from __future__ import annotations

import csv
import importlib
import json
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from fem_spa.cli import main
from fem_spa.deck import set_value
from fem_spa.output.toml import to_toml


@dataclass
class Run:
    """What a study left: exit status, printed words, columns of its curve.csv, its (first) result.json."""

    status: int
    said: str
    curve: dict[str, list[float]]
    result: dict[str, Any]


@pytest.fixture
def study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., Run]:
    """(name, overrides of its deck) -> Run, through `fem-spa study NAME`."""

    def run(name: str, *overrides: str) -> Run:
        module = importlib.import_module(f"studies.{name}")
        tables = tomllib.loads(module.DECK.read_text(encoding="utf-8"))
        for override in overrides:
            set_value(tables, override)
        small = tmp_path / f"{name}.toml"
        small.write_text(to_toml(tables), encoding="utf-8")
        monkeypatch.setattr(module, "DECK", small)
        monkeypatch.chdir(tmp_path)
        status = main(["study", name])
        folder = tmp_path / "out" / name
        with open(folder / "curve.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        curve = {key: [float(row[key] or "nan") for row in rows] for key in rows[0]}
        record = next(iter(sorted(folder.rglob("result.json"))))
        assert (record.parent / "report.html").is_file() and (record.parent / "shape.png").is_file()
        result = json.loads(record.read_text(encoding="utf-8"))
        return Run(status, capsys.readouterr().out, curve, result)

    return run
