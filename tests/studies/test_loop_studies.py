"""The studies of measured data: what they make of the files and hold out. The loop has its own tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fem_spa.cli import main
from fem_spa.errors import InputError
from fem_spa.loop.records import read_record
from studies import (
    ecoflex_compression,
    loop_arm,
    loop_asu_arm,
    loop_cantilever,
    loop_finger,
    loop_records,
    loop_zigzag,
)

STUDIES = {
    "ecoflex_compression": (ecoflex_compression, "ecoflex_compression_qmul"),
    "loop_asu_arm": (loop_asu_arm, "asu_4chamber_arm"),
    "loop_cantilever": (loop_cantilever, "eth_ds10_cantilever"),
    "loop_zigzag": (loop_zigzag, "zigzag_spa_ubc"),
}
Told = Callable[..., dict[str, Any]]


def data(name: str) -> Path:
    try:
        return loop_records.data_folder(name)
    except InputError:
        pytest.skip("needs the measured data: name their folder in FEM_SPA_DATA (see docs/loop.md)")


@pytest.fixture
def told() -> Told:
    """A diagnose that reads its records as the program does, notes them, and names one effect."""
    calls: list[tuple[set[str], set[str]]] = []

    def diagnose(
        model: Path, records: Sequence[Path], out: Path, holdout: Sequence[Path] = (), seed: int = 1
    ) -> dict[str, Any]:
        assert model.is_file()
        for path in (*records, *holdout):
            read_record(path)
        calls.append(({p.stem for p in records}, {p.stem for p in holdout}))
        period = {"value": 0.2, "unit": "s", "low": 0.1, "high": 0.3}
        effect = {"name": "inertia", "rivals": [], "parameters": {"period": period}}
        held = {"before": 2.0, "after": 1.0, "floor": 0.5, "floor_from": "repeats"}
        rows = [
            {"file": p.name, "role": role, "before": 2.0, "after": 1.0}
            for role, paths in (("train", records), ("heldout", holdout))
            for p in paths
        ]
        return {
            "verdict": "attributed",
            "effects": [effect],
            "candidates": ["inertia"],
            "signature": "",
            "error": {"unit": "mm", "heldout": held, "records": rows},
        }

    diagnose.calls = calls  # type: ignore[attr-defined]
    return diagnose


@pytest.mark.parametrize("name", STUDIES)
def test_without_data_one_line_says_where_they_go(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FEM_SPA_DATA", str(tmp_path))
    assert main(["study", name, "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "FEM_SPA_DATA" in said


@pytest.mark.parametrize("name", STUDIES)
def test_held_out_records_are_others(
    name: str, told: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each record is read by the program's reader; none is both trained on and held out."""
    module, source = STUDIES[name]
    data(source)
    monkeypatch.setattr(module, "diagnose", told)
    assert module.run(tmp_path) == 0
    assert told.calls
    for train, held in told.calls:
        assert train and held and not train & held
    assert "before 2 mm, after 1 mm, floor 0.5 mm" in capsys.readouterr().out


def test_a_knee_at_one_pressure_is_found_there() -> None:
    """Curves of any size that flatten at 200 kPa: seven points of smoothing may shift it."""
    p = np.arange(0, 341, 8.5)
    shape = (np.minimum(p, 200) + 0.1 * np.maximum(p - 200, 0)) / 214
    for size in (12.0, -50.0):
        curve = np.column_stack([p, size * shape])
        assert loop_zigzag.knee(curve) == pytest.approx(200, abs=20)


def test_mass_from_frequency_is_the_hung_mass() -> None:
    """A massless cantilever with a mass at its end: T = 2 pi sqrt(m c); a wrong unit would be far off."""
    drops = [6.0, 16.0, 26.0]
    compliance = 1e-2 / 0.51012
    reports = {}
    for name, mass in zip(loop_cantilever.LOADS, (0.02, 0.07, 0.12), strict=True):
        period = {"value": 2 * np.pi * np.sqrt(mass * compliance), "unit": "s"}
        reports[name] = {"effects": [{"name": "inertia", "parameters": {"period": period}}]}
    lines = loop_cantilever.mass_words(reports, drops).splitlines()
    found = [float(line.split()[2]) for line in lines[1:4]]
    assert found == pytest.approx([20, 70, 120], rel=0.05)
    reports["gravity"]["effects"] = []
    assert "nothing is said" in loop_cantilever.mass_words(reports, drops)


def test_cards_are_too_soft_in_compression() -> None:
    """Ten tests, mean at 30 %: about twice the card, as the page of the data says of 00-30."""
    source = data("ecoflex_compression_qmul") / "EF30_0T"
    tests = {p.stem[-2:]: ecoflex_compression.read_test(p) for p in sorted(source.glob("*.csv"))}
    assert len(tests) == 10
    assert ecoflex_compression.stiffness_ratio("30", tests) == pytest.approx(1.9, abs=0.1)


def test_arm_records_are_of_the_whole_rod(
    told: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(loop_arm, "diagnose", told)
    monkeypatch.setattr(loop_arm, "SECONDS", 1.0)
    assert loop_arm.run(tmp_path) == 0
    assert [held for _, held in told.calls] == [set(loop_arm.HELD)] * len(loop_arm.COMPONENTS)
    assert "without gravity: not found (expected gravity)" in capsys.readouterr().out


def test_finger_truth_is_told_after_the_verdict(
    told: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A curve in place of the solver's; the records' folder must not hold the truth."""

    def small(deck: Path, out: Path, changes: list[str]) -> Any:
        out.mkdir(parents=True)
        p = np.linspace(0, 60e3, 13)
        rows = [SimpleNamespace(pressure={"slow": x}, angle=2e-5 * x + 2e-10 * x**2) for x in p]
        (out / "curve.csv").write_text("pressure [kPa],angle [deg]\n0,0\n60,100\n", encoding="utf-8")
        return SimpleNamespace(result=SimpleNamespace(rows=rows), exit_status=0)

    monkeypatch.setattr(loop_finger, "run_deck", small)
    monkeypatch.setattr(loop_finger, "diagnose", told)
    monkeypatch.setattr(loop_finger, "CASES", (0,))
    assert loop_finger.run(tmp_path) == 0
    said = capsys.readouterr().out
    assert said.index("attributed") < said.index("truth:")
    assert not list((tmp_path / "case0" / "records").glob("*truth*"))


def test_the_two_that_solve_have_words_for_the_list() -> None:
    """`fem-spa study --list` shows them; that they run is shown above."""
    for name, module in {"loop_arm": loop_arm, "loop_finger": loop_finger}.items():
        assert module.__name__ == f"studies.{name}"
        assert len(module.SUMMARY) < 110
