"""The studies of measured data: what they make of the files and hold out. The loop has its own tests."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fem_spa.cli import main
from fem_spa.engine.interface import Ended
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
from studies.loop_records import arm

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


class Here:
    """An engine that runs everything in this process."""

    def __enter__(self) -> Here:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def run(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Any:
        for number, task in enumerate(tasks):
            yield Ended(number, function(task))


def test_arm_records_are_of_the_whole_rod(
    told: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """All protocols together and each alone, for each component: one left out would be missing here."""
    monkeypatch.setattr(loop_records, "diagnose", told)
    monkeypatch.setattr(loop_arm, "open_engine", lambda most: Here())
    for name, seconds in {"SECONDS": 1.0, "SITTING": 1.0}.items():
        monkeypatch.setattr(loop_arm, name, seconds)
    monkeypatch.setattr(loop_arm, "COMPONENTS", ("gravity", "damping"))
    assert loop_arm.run(tmp_path) == 0
    alone = ["stretch", "bend1", "bend2", "sine", "babble", "level"]
    held = [held for _, held in told.calls]
    assert held[0] == held[7] == set(loop_arm.HELD)
    assert [len(h) for h in held[1:7]] == [1] * 6
    assert [h.pop()[:-1] for h in held[1:7]] == alone
    assert all(len(train) >= 2 for train, _ in told.calls)
    said = capsys.readouterr().out
    assert "without gravity: not found (expected gravity)" in said
    for protocol in alone:
        assert f"gravity      {protocol}" in said


def test_what_a_component_shows_is_nothing_where_it_does_nothing() -> None:
    """No pressure: valve and gains do nothing, weight is an offset; a turned, bent arm shows it."""
    n, rate = 20, 10.0
    idle = (np.zeros((n, 3)), 0.0), (np.zeros((n, 3)), 0.0)
    for component in ("gravity", "strain_gains", "valve"):
        assert arm.shows(component, idle, rate) == pytest.approx(0.0, abs=1e-6)
    bent = np.full((n, 3), [300.0, 0.0, 0.0])
    moved = (np.zeros((n, 3)), 90.0), (bent, 90.0)
    assert arm.shows("gravity", moved, rate) > 2.0


def test_a_finished_diagnosis_is_not_done_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, told: Any
) -> None:
    """The report in the folder is taken for the same files only: not for another record or hold-out."""
    from fem_spa.loop.report_json import inputs, versions

    model, *files = (tmp_path / f"{name}.csv" for name in ("model", "a", "b"))
    for path in (model, *files):
        path.write_text(f"time [s],pressure [kPa],angle [deg]\n{path.stem},0,0\n", encoding="utf-8")
    calls = []

    def diagnose(model: Path, records: Any, out: Path, holdout: Any = (), seed: int = 1) -> dict[str, Any]:
        calls.append(out.name)
        rows = [{"file": p.name, "role": "train"} for p in records]
        rows += [{"file": p.name, "role": "heldout"} for p in holdout]
        report = {"inputs": inputs([model, *records, *holdout]), "versions": versions()}
        report["error"] = {"records": rows}
        out.mkdir(exist_ok=True)
        (out / "report.json").write_text(json.dumps(report), encoding="utf-8")
        return report

    monkeypatch.setattr(loop_records, "diagnose", diagnose)
    out = tmp_path / "out"
    first = loop_records.kept(model, files[:1], out, files[1:])
    assert loop_records.kept(model, files[:1], out, files[1:]) == first
    assert len(calls) == 1
    loop_records.kept(model, files[1:], out, files[:1])
    assert len(calls) == 2
    files[0].write_text("time [s],pressure [kPa],angle [deg]\n1,0,0\n", encoding="utf-8")
    loop_records.kept(model, files[1:], out, files[:1])
    assert len(calls) == 3
    (out / "report.json").write_text("{", encoding="utf-8")
    loop_records.kept(model, files[1:], out, files[:1])
    assert len(calls) == 4


def test_an_arm_is_judged_by_what_is_named() -> None:
    """A confident other name is wrong; one class is told from it; silence is right where nothing shows."""

    def report(*names: str, rivals: Sequence[str] = ()) -> dict[str, Any]:
        return {
            "verdict": "ambiguous",
            "effects": [{"name": n, "rivals": list(rivals)} for n in names],
            "candidates": [*names, *rivals],
        }

    judged = loop_arm.judged
    assert judged("gravity", report("gravity"), 3.0) == "right"
    assert judged("gravity", report("payload", rivals=["gravity"]), 3.0) == "in the set"
    assert judged("gravity", report("payload"), 3.0) == "its like"
    assert judged("gravity", report("creep"), 3.0) == "wrong"
    assert judged("gravity", report("gravity", "creep"), 3.0) == "and creep"
    assert judged("gravity", report(), 0.1) == "hidden"
    assert judged("gravity", report(), 3.0) == "missed"
    assert judged("gravity", {**report(), "verdict": "insufficient"}, 3.0) == "refused"
    assert judged("valve", report("pressure-lag", "dead-band"), 3.0) == "right"


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
