"""The arm's studies on the first seconds of each protocol: their words, files and what they must find."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from fem_spa.cli import main
from fem_spa.reduced.rod_protocols import PROTOCOLS
from studies import arm_ablation, arm_protocols


def test_protocols(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Twelve rows in each comparison; the refit finds the truth; the gains' 20 and 10 mm are printed."""
    monkeypatch.setattr(arm_protocols, "SECONDS", 6.0)
    monkeypatch.setattr(arm_protocols, "FINE", 12)
    assert main(["study", "arm_protocols", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "20.8, 9.8 mm" in said and "0.0392 kg" in said and "293 x 315 x 205" in said
    with open(tmp_path / "protocols.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4 * len(PROTOCOLS)
    refitted = [float(row["mean e/L [%]"]) for row in rows if row["against"] == "refitted"]
    assert max(refitted) < 0.5
    records = sorted((tmp_path / "tips").glob("*.csv"))
    assert len(records) == len(PROTOCOLS)
    assert records[0].read_text().splitlines()[1].startswith("time [s],pressure 1 [kPa]")
    assert (tmp_path / "protocols.png").is_file()


def test_ablation_resumes_and_ranks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every cell filled; nothing is simulated twice; the full rod is off by the noise alone."""
    monkeypatch.setattr(arm_ablation, "SECONDS", 5.0)
    assert main(["study", "arm_ablation", "--out", str(tmp_path)]) == 0
    first = capsys.readouterr().out
    assert first.count("order in the paper") == 3

    def refuse(*_: object) -> np.ndarray:
        raise AssertionError("simulated again")

    monkeypatch.setattr("fem_spa.reduced.rod.Rod.simulate", refuse)
    assert main(["study", "arm_ablation", "--out", str(tmp_path)]) == 0
    assert capsys.readouterr().out == first
    with open(tmp_path / "ablation.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * len(PROTOCOLS) * 5
    noise = 100 * arm_ablation.NOISE * np.sqrt(8 / np.pi) / 0.19  # mean norm of three normal deviates
    own = {
        float(row["full [%]"]) for row in rows if row["data"] == "noise" and row["protocol"] != "Workspace"
    }
    assert np.allclose(sorted(own), noise, rtol=0.1)


def test_protocols_are_the_papers() -> None:
    """Levels, order, lengths and limits of section IV.B."""
    by_name = {protocol.name: protocol for protocol in PROTOCOLS}
    stretching = by_name["Stretching"].drive()
    assert stretching.pressure[-1] == pytest.approx([3.5e5] * 3) and stretching.time.size == 4000
    bending = by_name["Bending 1"].drive()
    assert bending.pressure[4100] == pytest.approx([0, 0, 0])  # rest at 40 s
    assert bending.pressure[4600] == pytest.approx([0, 0.5e5, 0])
    assert len(np.unique(by_name["Workspace"].commands(2560.0), axis=0)) == 512
    walk = by_name["Babbling 20 Hz"].commands(300.0)
    steps = np.unique(np.round(np.diff(walk, axis=0)))
    assert set(steps) == {-5000.0, 0.0, 5000.0} and walk.min() == 0 and walk.max() <= 3.5e5
    wave = by_name["Sinusoids 0.10 Hz"].drive().pressure
    assert wave.min() > 0.49e5 and wave.max() < 3.51e5 and wave[0, 0] == pytest.approx(2e5)
