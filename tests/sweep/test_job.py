"""A sweep's folder: one row a case, solved ones kept, failures told, interruptions survived."""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
import stand_ins

from fem_spa.cli import main
from fem_spa.errors import InputError
from fem_spa.output.claim import Claim
from fem_spa.sweep import job
from fem_spa.sweep.job import run_sweep
from fem_spa.sweep.state import Request, Sweep

PRESSURES = "loads.pressure=1kPa:3kPa:3"
MODULI = "materials.body.C10=1MPa,2MPa"


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "sweep.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def tried(folder: Path) -> list[int]:
    """How often each case was run."""
    return sorted(len(path.read_text()) for path in folder.glob("cases/*/tried"))


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(job, "solve", stand_ins.quick)


def sweep(deck: Path, folder: Path, *vary: str, **more: object) -> Sweep:
    return run_sweep(Request(deck, vary, **more), folder)  # type: ignore[arg-type]


def test_fe_rows_are_the_ends_of_solves_own_curves(deck: Path, tmp_path: Path) -> None:
    """The only one with finite elements: the same numbers as `fem-spa solve`, one mesh for two pressures."""
    out = tmp_path / "out"
    assert main(["sweep", str(deck), "--vary", "loads.pressure=2kPa,4kPa", "--out", str(out)]) == 0
    found = rows(out)
    assert [row["status"] for row in found] == ["done", "done"]
    assert [row["loads.pressure [kPa]"] for row in found] == ["2", "4"]
    assert len(list((out / "meshes").iterdir())) == 1
    alone = tmp_path / "alone"
    assert main(["solve", str(deck), "--out", str(alone)]) == 0
    with (alone / "curve.csv").open() as file:
        last = list(csv.DictReader(file))[-1]
    for name in ("pressure [kPa]", "volume [mm^3]", "max stretch", "extension [mm]"):
        assert float(found[1][name]) == pytest.approx(float(last[name]), rel=1e-8), name
    case = out / found[1]["folder"]
    assert (case / "report.html").is_file() and json.loads((case / "result.json").read_text())[
        "status"
    ] == "done"
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "2 of 2 designs are solved" in page and f"{found[1]['folder']}/report.html" in page
    assert json.loads((out / "sweep.json").read_text())["cases"] == {"done": 2}


def test_a_solved_case_is_not_run_again_and_a_larger_sweep_runs_what_is_new(
    deck: Path, tmp_path: Path, quick: None
) -> None:
    out = tmp_path / "out"
    assert sweep(deck, out, PRESSURES).found == 0
    assert tried(out) == [1, 1, 1]
    assert sweep(deck, out, PRESSURES).found == 3
    assert tried(out) == [1, 1, 1]
    wider = sweep(deck, out, "loads.pressure=3kPa,1kPa,0.06bar")
    assert wider.found == 2 and tried(out) == [1, 1, 1, 1]
    assert [row["pressure [kPa]"] for row in rows(out)] == ["3", "1", "6"]


def test_the_table_has_keys_with_units_and_the_end_of_each_curve(
    deck: Path, tmp_path: Path, quick: None
) -> None:
    out = tmp_path / "out"
    sweep(deck, out, PRESSURES, MODULI)
    found = rows(out)
    assert len(found) == 6 and len(list((out / "meshes").iterdir())) == 1
    for row in found:
        pressure, C10 = float(row["loads.pressure [kPa]"]), float(row["materials.body.C10 [MPa]"])
        assert float(row["angle [deg]"]) == pytest.approx(pressure / C10)
        assert (row["status"], row["reason"], row["steps"]) == ("done", "", "1")
        assert (out / row["folder"] / "curve.csv").is_file() and row["folder"] == f"cases/{row['case']}"
    assert all((out / name).is_file() for name in job.WRITTEN)


def test_a_failed_case_is_a_row_with_its_reason_and_the_sweep_goes_on(
    deck: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(job, "solve", stand_ins.troubled)
    out = tmp_path / "out"
    done = sweep(deck, out, "loads.pressure=1kPa:6kPa:6")
    assert done.status == "done" and done.count("done") == 2
    found = {row["loads.pressure [kPa]"]: (row["status"], row["reason"]) for row in rows(out)}
    assert found["1"] == found["6"] == ("done", "")
    assert found["2"] == ("limit", "the volume grows without bound")
    assert found["3"] == ("fault", "ZeroDivisionError: by zero")
    assert found["4"][0] == "lost" and "died twice" in found["4"][1]
    assert found["5"] == ("refused", "the mesh has no tip")
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "the mesh has no tip" in page and "died twice" in page
    # what ended by itself stays; what died or was at fault has another chance
    monkeypatch.setattr(job, "solve", stand_ins.quick)
    assert sweep(deck, out, "loads.pressure=1kPa:6kPa:6").count("done") == 5
    assert sweep(deck, out, "loads.pressure=1kPa:6kPa:6", again=True).count("done") == 6


def test_sizes_that_do_not_go_together_are_a_row_too(deck: Path, tmp_path: Path, quick: None) -> None:
    out = tmp_path / "out"
    sweep(deck, out, "geometry.inner_radius=4mm,20mm")
    assert [row["status"] for row in rows(out)] == ["done", "refused"]
    assert "inner_radius = 20 mm" in rows(out)[1]["reason"]


def test_a_worker_that_dies_costs_a_second_try_only(
    deck: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(job, "solve", stand_ins.dies_once)
    assert sweep(deck, tmp_path / "out", PRESSURES, workers=2).count("done") == 3


def test_ctrl_c_ends_with_status_1_and_keeps_what_is_solved(
    deck: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(job, "solve", stand_ins.interrupts_its_sweep)
    out = tmp_path / "out"
    words = ["sweep", str(deck), "--vary", "loads.pressure=1kPa:5kPa:5", "--workers", "1", "--out", str(out)]
    begun = time.monotonic()
    assert main(words) == 1
    assert time.monotonic() - begun < 25  # it does not wait for the case
    assert "interrupted" in capsys.readouterr().err
    assert [row["status"] for row in rows(out)] == ["done", "interrupted", "waiting", "waiting", "waiting"]
    assert children() == []
    assert "Interrupted: 1 of 5 designs" in (out / "report.html").read_text(encoding="utf-8")
    monkeypatch.setattr(job, "solve", stand_ins.quick)
    assert main(words) == 0
    assert tried(out) == [1] * 5


def test_one_sweep_a_folder(deck: Path, tmp_path: Path, quick: None) -> None:
    out = tmp_path / "out"
    out.mkdir()
    with Claim(out), pytest.raises(InputError, match="another run is writing there"):
        sweep(deck, out, PRESSURES)
    assert sweep(deck, out, PRESSURES).count("done") == 3
    assert not (out / ".lock").exists()


@pytest.mark.slow
def test_an_interrupted_case_goes_on_from_its_checkpoint(deck: Path, tmp_path: Path) -> None:
    """The sweep is killed, workers and all; the curves are then those of a sweep that nothing disturbed."""
    words = [sys.executable, "-m", "fem_spa.cli", "sweep", str(deck), "--set", "solver.imposed_steps=40"]
    words += ["--vary", "loads.pressure=3kPa,4kPa", "--out"]
    whole, out = tmp_path / "whole", tmp_path / "out"
    subprocess.run([*words, str(whole)], check=True, capture_output=True)
    shutil.copytree(whole / "meshes", out / "meshes")
    killed = subprocess.Popen([*words, str(out)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    curves = [path.relative_to(whole) for path in whole.glob("cases/*/curve.csv")]
    until = time.monotonic() + 120
    while sum(lines(out / curve) > 5 for curve in curves) < 2 and killed.poll() is None:
        assert time.monotonic() < until
        time.sleep(0.05)
    killed.kill()
    killed.wait()
    time.sleep(0.5)
    assert killed.returncode == -9
    subprocess.run([*words, str(out)], check=True, capture_output=True)
    for curve in curves:
        assert (out / curve).read_bytes() == (whole / curve).read_bytes()


def lines(path: Path) -> int:
    return path.read_text(encoding="utf-8").count("\n") if path.is_file() else 0


def children() -> list[str]:
    """Worker processes of this one that live."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = path.read_text().rpartition(")")[2].split()[:2]
            words = path.with_name("cmdline").read_text()
        except OSError:
            continue
        if int(parent) == os.getpid() and state != "Z" and "fem_spa.engine.worker" in words:
            found.append(words)
    return found


def test_wrong_input_is_status_2_and_leaves_nothing(
    deck: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    for more in (["geometry.wal=1mm:2mm:3"], ["loads.pressure=1mm,2mm"], ["geometry.end_wall=1mm:2mm:99999"]):
        assert main(["sweep", str(deck), "--vary", *more, "--out", str(out)]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and more[0].partition("=")[0] in said
        assert not out.exists()
    assert main(["sweep", "--vary", "loads.pressure=1kPa,2kPa", "--out", str(out)]) == 2
    assert "given no deck" in capsys.readouterr().err
    file = tmp_path / "file"
    file.touch()
    assert main(["sweep", str(deck), "--vary", "loads.pressure=1kPa,2kPa", "--out", str(file)]) == 2
    assert "is a file" in capsys.readouterr().err
    with pytest.raises(InputError, match=r"no Dask scheduler|Dask is not installed"):
        sweep(deck, out, PRESSURES, scheduler="tcp://")
    assert not out.exists()


def test_the_deck_may_stand_behind_the_keys(deck: Path, tmp_path: Path, quick: None) -> None:
    words = ["sweep", "--vary", "loads.pressure=1kPa,2kPa", str(deck), "--out", str(tmp_path / "out")]
    assert main(words) == 0
    assert len(rows(tmp_path / "out")) == 2
