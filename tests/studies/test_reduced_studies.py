"""Studies of the reduced models: each runs, and a number of each is right."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from fem_spa.cli import main


def rows(path: Path) -> list[dict[str, str]]:
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_bellow_creep(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The printed final parameters lie in the intervals of the fit, and the study says what (6) does to
    noise."""
    assert main(["study", "bellow_creep", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    found = {
        row["parameter"]: {k: float(v) for k, v in row.items() if k != "parameter"}
        for row in rows(tmp_path / "fit.csv")
    }
    assert found["k1"]["printed final"] == 82.85 and found["eta2"]["printed initial"] == 1.784
    for name in ("k1", "k2", "eta1", "eta2"):
        assert found[name]["one step"] == pytest.approx(found[name]["printed final"], rel=0.3)
        assert found[name]["low"] < found[name]["seven steps (6)"] < found[name]["high"]
    assert "8.75 kPa/mm" in said and "Divided by the model" in said
    assert (tmp_path / "creep.png").stat().st_size > 10_000
    assert np.isfinite(found["k1"]["high"])
