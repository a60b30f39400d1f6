"""Studies of the reduced models: each runs, and a number of each is right."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from fem_spa.cli import main
from studies import zigzag_stiffness


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


def test_zigzag_links() -> None:
    """Three links give the printed stiffness, links on the folds one like the linear actuator's."""
    lines = {line.split()[0]: line.split() for line in zigzag_stiffness.sensitivity().splitlines() if line}
    assert 0.14 < float(lines["3"][5]) < 0.17
    assert float(lines["40"][5]) / float(lines["15"][5]) == pytest.approx(40 / 15, rel=0.02)
    assert "632 N/m" in zigzag_stiffness.assumptions()
    assert "T1 '1'" in zigzag_stiffness.pieces()


@pytest.mark.slow
def test_zigzag_stiffness(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two chambers: the torque map and, of each layer, a stiffness of the order of the linear one; a
    thicker layer is stiffer."""
    deck = zigzag_stiffness.DECK.read_text(encoding="utf-8")
    small = tmp_path / "small.toml"
    deck = deck.replace("chambers = 6", "chambers = 2").replace("points = 7", "points = 3")
    small.write_text(deck.replace('"140 kPa"', '"170 kPa"'), encoding="utf-8")
    monkeypatch.setattr(zigzag_stiffness, "DECK", small)
    monkeypatch.setattr(zigzag_stiffness, "LAYERS", (1.0, 2.0))
    out = tmp_path / "out"
    assert main(["study", "zigzag_stiffness", "--out", str(out)]) == 0
    torque = [float(row["torque [N*m]"]) for row in rows(out / "torque.csv")]
    assert torque[0] == 0 and np.all(np.diff(torque) > 0) and 0.3 < torque[-1] < 0.6
    ours = [float(row["ours [N*m/rad]"]) for row in rows(out / "stiffness.csv")]
    assert 0.3 < ours[0] < ours[1] < 3.0
    said = capsys.readouterr().out
    assert "overshoot 0.0 %" in said and (out / "zigzag.png").stat().st_size > 10_000
