"""`fem-spa calibrate` as a person calls it: files, words, exit status, and wrong input in one line."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from fem_spa.cli import main
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import model_text, read_model

DECK = """
[geometry]
shape = "pneunet"
slow_chambers = 0
fast_chambers = 1
size = "7 mm"
[materials.body]
law = "neo-hooke"
C10 = "0.11 MPa"
[layers.paper]
modulus = "2 GPa"
thickness = "0.1 mm"
[loads]
pressure = "20 kPa"
contact = false
"""


@pytest.fixture
def records(tmp_path, monkeypatch, creeping):
    """Three records of a known bellow, and a model file that begins elsewhere; the folder is current."""
    monkeypatch.chdir(tmp_path)
    time = np.arange(0.0, 60.0, 0.5)
    for k, top in enumerate((30e3, 40e3, 50e3)):
        pressure = top * (0.5 - 0.5 * np.cos(2 * np.pi * time / (10 + 7 * k)))
        values = 1e3 * creeping.simulate(Drive(time, pressure[:, None]))[:, 0]
        rows = "".join(f"{t},{p / 1e3:.6f},{y:.7f}\n" for t, p, y in zip(time, pressure, values, strict=True))
        Path(f"r{k}.csv").write_text("time [s],pressure [kPa],displacement [mm]\n" + rows)
    Path("model.toml").write_text(model_text(creeping.with_values(k1=100e6, k2=9e6)))
    return ["model.toml", "r0.csv", "r1.csv", "r2.csv"]


def test_a_model_and_what_is_left(records, capsys, creeping):
    assert main(["calibrate", *records, "--vary", "k1", "k2", "eta1", "eta2"]) == 0
    out = Path("out") / "model"
    assert {p.name for p in out.iterdir()} == {
        "calibrated.toml",
        "calibration.json",
        "calibration.png",
        "report.html",
    }
    found = read_model(out / "calibrated.toml")
    assert found.parameters["k1"].value == pytest.approx(creeping.parameters["k1"].value, rel=1e-3)
    assert found.valid.high == pytest.approx((40e3,), rel=1e-3)
    table = json.loads((out / "calibration.json").read_text())
    assert table["status"] == "done" and table["error"]["unit"] == "mm"
    assert table["error"]["heldout"]["after"] < 0.01 * table["error"]["heldout"]["before"]
    assert table["parameters"]["k1"]["unit"] == "kPa/mm"
    k1 = table["parameters"]["k1"]
    assert k1["low"] <= k1["value"] <= k1["high"]
    assert [r["role"] for r in table["error"]["records"]] == ["train", "train", "heldout"]
    said = capsys.readouterr().out
    assert "k1 = " in said and "beyond the range of the fit" in said
    page = (out / "report.html").read_text()
    assert "data:image/png" in page and "k1" in page
    # the same call gives the same file
    before = (out / "calibrated.toml").read_bytes()
    assert main(["calibrate", *records, "--vary", "k1", "k2", "eta1", "eta2", "--out", "again"]) == 0
    assert Path("again/calibrated.toml").read_bytes() == before


def test_named_hold_out(records):
    assert main(["calibrate", *records[:2], "--holdout", "r1.csv", "--vary", "k2", "--out", "o"]) == 0
    table = json.loads(Path("o/calibration.json").read_text())
    assert {r["file"]: r["role"] for r in table["error"]["records"]} == {
        "r0.csv": "train",
        "r1.csv": "heldout",
    }


@pytest.mark.slow
def test_a_deck_is_calibrated_and_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("finger.toml").write_text(DECK)
    assert main(["solve", "finger.toml", "--set", "materials.body.C10='0.13 MPa'", "--out", "bench"]) == 0
    call = ["calibrate", "finger.toml", "bench/curve.csv", "--vary", "materials.body.C10", "--out", "fit"]
    assert main(call) == 0
    table = json.loads(Path("fit/calibration.json").read_text())
    assert table["kind"] == "finite elements" and table["FE runs"] <= 5
    assert table["parameters"]["materials.body.C10"]["value"] == pytest.approx(0.13e6, rel=1e-3)
    deck = tomllib.loads(Path("fit/calibrated.toml").read_text())
    assert deck["materials"]["body"]["C10"].startswith(("130", "129.9"))
    assert (
        Path("fit/calibrated.toml").read_text().startswith("# Calibrated from bench/curve.csv: 0 to 20 kPa")
    )
    # walls: the mesh comes beside the deck
    capsys.readouterr()
    call = ["calibrate", "finger.toml", "bench/curve.csv", "--vary", "walls.scale", "--out", "walls"]
    assert main(call) == 0
    assert Path("walls/mesh.msh").is_file()
    assert main(["mesh", "walls/calibrated.toml", "--out", "walls/again.vtu"]) == 0
    scale = json.loads(Path("walls/calibration.json").read_text())["parameters"]["walls.scale"]
    assert 1.0 < scale["value"] <= 1.25 or not scale["accepted"]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (["calibrate", "model.toml", "r0.csv"], "--vary"),
        (["calibrate", "model.toml", "--vary", "k1"], "record"),
        (["calibrate", "none.toml", "r0.csv", "--vary", "k1"], "none.toml"),
        (["calibrate", "model.toml", "none.csv", "--vary", "k1"], "none.csv"),
        (["calibrate", "model.toml", "r0.csv", "--vary", "k7"], "did you mean"),
        (["calibrate", "model.toml", "r0.csv", "r0.csv", "--vary", "k1"], "twice"),
        (["calibrate", "model.toml", "r0.csv", "--vary", "k1", "--output", "angle"], "share"),
        (["calibrate", "deck.toml", "r0.csv", "--vary", "materials.body.C10", "k1"], "no such number"),
        (["calibrate", "deck.toml", "r0.csv", "--vary", "materials.rim.C10"], "materials.body"),
        (
            ["calibrate", "deck.toml", "r0.csv", "--vary", "walls.scale", "geometry.lateral_wall"],
            "one of them",
        ),
        (["calibrate", "r0.csv", "r1.csv", "--vary", "k1"], "TOML"),
    ],
)
def test_wrong_input_is_one_line(records, capsys, call, words):
    Path("deck.toml").write_text(DECK)
    assert main(call) == 2
    captured = capsys.readouterr()
    assert words in captured.err and len(captured.err.strip().splitlines()) == 1
    assert not Path("out").exists()


def test_ctrl_c_keeps_the_best_so_far(records, monkeypatch):
    from fem_spa.reduced import viscoelastic

    real, count = viscoelastic.KelvinVoigt.simulate, [0]

    def simulate(self, drive):
        count[0] += 1
        if count[0] == 20:
            raise KeyboardInterrupt
        return real(self, drive)

    monkeypatch.setattr(viscoelastic.KelvinVoigt, "simulate", simulate)
    assert main(["calibrate", *records, "--vary", "k1", "k2", "--out", "o"]) == 1
    table = json.loads(Path("o/calibration.json").read_text())
    assert table["status"] == "interrupted"
    assert table["parameters"]["k1"]["low"] is None
    assert table["error"]["train"]["after"] <= table["error"]["train"]["before"]
    assert math.isfinite(read_model("o/calibrated.toml").parameters["k1"].value)


def test_law_of_a_piece(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("piece.toml").write_text(DECK.replace("fast_chambers = 1", "fast_chambers = 3"))
    call = ["calibrate", "piece.toml", "--segment", "fast", "--gauge", "8 mm", "15 mm", "--reach", "3 mm"]
    extra = ["--set", "loads.pressure='2 kPa'", "--set", "materials.body.density='1080 kg/m^3'"]
    row = ["--count", "6", "--pitch", "7 mm"]
    assert main([*call, *extra, *row, "--out", "law"]) == 0
    assert "bending stiffness" in capsys.readouterr().out
    rod = {"kind": "rod", "preset": "am-i-support", "law": "law.csv"}
    law = read_model({"model": rod}, Path("law")).law
    assert law.pressure[-1] == pytest.approx(2e3) and law.curvature[-1] > 0 and law.bending_stiffness > 0
    chambers = read_model("law/segments.toml")
    assert chambers.count == 6 and chambers.parameters["mass"].value > 1e-4
    turned = chambers.at(np.array([2e3]))[0, 0]
    assert turned == pytest.approx(7e-3 * law.curvature[-1], rel=1e-6)
    for wrong, words in (
        (["calibrate", "piece.toml", "--segment", "fast"], "--gauge"),
        ([*call, "--count", "6"], "--pitch"),
        ([*call[:3], "slow", *call[4:]], "cavities fast"),
        ([*call[:6], "900 mm", "--reach", "3 mm"], "long"),
    ):
        assert main(wrong) == 2
        said = capsys.readouterr().err.strip()
        assert words in said and len(said.splitlines()) == 1, said


@pytest.mark.parametrize(("cut", "words"), [(slice(40, 90), "gap of"), (None, "times do not increase")])
def test_broken_records_are_refused(records, capsys, cut, words):
    # a model run over what is missing, or over a clock that was set back
    lines = Path("r0.csv").read_text().splitlines()
    head, rows = lines[0], lines[1:]
    if cut is None:
        rows = [*rows[:60], *rows[50:]]
    else:
        del rows[cut]
    Path("broken.csv").write_text("\n".join([head, *rows]) + "\n")
    assert main(["calibrate", "model.toml", "broken.csv", "--vary", "k1"]) == 2
    captured = capsys.readouterr()
    assert words in captured.err and len(captured.err.strip().splitlines()) == 1
