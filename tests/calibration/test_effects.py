"""A model file with effects: they stay as they are, errors are with them, the calibrated file has them."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fem_spa.calibration.carried import carried
from fem_spa.calibration.observation import read_runs
from fem_spa.calibration.reduced import calibrate
from fem_spa.cli import main
from fem_spa.errors import InputError
from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.model_file import Source, read_source
from fem_spa.loop.records import read_records
from fem_spa.loop.simulate import predicted
from fem_spa.reduced.registry import read_model

TABLES = """
[scales]
pressure = "50 kPa"
response = [0.004]
rest = [0.0]
cycles = 12.0
seconds = 400.0

[effects.friction]
stick = 0.05
rub = 0.03
hold = 0.9
spread = 0.6

[effects.pressure-lag]
rise = 0.7
fall = 1.5
slew = 0.0
"""
TRUE = """
[model]
kind = "kelvin-voigt"
k1 = "80 kPa/mm"
eta1 = "800 kPa*s/mm"
k2 = "12 kPa/mm"
eta2 = "3.6 kPa*s/mm"
"""
GIVEN = ["r0.csv", "r1.csv", "r2.csv"]
NOISE = 0.004  # mm


def drives(count: int, chambers: int = 1, top: float = 50.0) -> list[np.ndarray]:
    """kPa, (n, chambers) a record at 0.1 s: triangles of three rates, each going less far than the last."""
    t = np.arange(0.0, 40.0, 0.1)[:, None]
    late = np.arange(chambers)
    shares = [1.0 - np.abs(1.0 - 2.0 * ((t + late) / (4.0 + 3.0 * k) % 1.0)) for k in range(count)]
    return [top * (1.0 - 0.15 * k) * share for k, share in enumerate(shares)]


def write(names: list[str], pressures: list[np.ndarray], outputs: dict[str, list[np.ndarray]]) -> None:
    """Records one after another in a session; what is logged of the chamber would mislead."""
    for k, (name, p) in enumerate(zip(names, pressures, strict=True)):
        number = [""] if p.shape[1] == 1 else [f" {j + 1}" for j in range(p.shape[1])]
        heads = ["time [s]", *(f"{w}pressure{j} [kPa]" for w in ("", "measured ") for j in number), *outputs]
        table = np.column_stack([0.1 * np.arange(len(p)), p, 0.5 * p, *(y[k] for y in outputs.values())])
        rows = "\n".join(",".join(f"{v:.10g}" for v in row) for row in table)
        Path(name).write_text(f"# start: 2026-03-01T10:0{k}:00\n{','.join(heads)}\n{rows}\n")


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Records of a bellow that creeps, rubs and gets its pressure late; model.toml begins 20 % off in k1."""
    monkeypatch.chdir(tmp_path)
    Path("true.toml").write_text(TRUE + TABLES)
    Path("model.toml").write_text(TRUE.replace('"80 kPa', '"96 kPa') + TABLES)
    pressures = drives(3)
    write(GIVEN, pressures, {"displacement [mm]": [0.0 * p for p in pressures]})
    told = predicted(read_source(Path("true.toml")), read_records(GIVEN), ["displacement"])
    rng = np.random.default_rng(0)
    noisy = [1e3 * y[:, 0] + NOISE * rng.standard_normal(len(y)) for y in told]
    write(GIVEN, pressures, {"displacement [mm]": noisy})


def simulated(model: str, capsys: pytest.CaptureFixture[str]) -> dict[str, float]:
    """What `fem-spa simulate` says of a model file: record -> error, mm."""
    capsys.readouterr()
    assert main(["simulate", model, *GIVEN, "--out", "told"]) == 0
    lines = [line.split(": error ") for line in capsys.readouterr().out.splitlines() if ": error " in line]
    return {f"{name}.csv": float(rest.split()[0]) for name, rest in lines}


def test_the_models_own_number_comes_back_through_its_effects(bench, capsys):
    # catches effects dropped, moved along, or begun anew with every record
    assert main(["calibrate", "model.toml", *GIVEN, "--vary", "k1", "eta1", "--out", "fit"]) == 0
    assert "pressure-lag and friction held as in the model file" in capsys.readouterr().out
    table = json.loads(Path("fit/calibration.json").read_text())
    assert table["status"] == "done" and table["effects held"] == ["pressure-lag", "friction"]
    k1 = table["parameters"]["k1"]
    assert k1["value"] == pytest.approx(80.0, rel=5e-3) and k1["low"] < 80.0 < k1["high"]
    assert k1["high"] - k1["low"] < 2.0
    # of the commanded pressure, not the measured half of it
    assert table["range"]["high"] == pytest.approx([42.5], abs=0.5) and not table["notes"]
    heldout = table["error"]["heldout"]
    assert heldout["after"] == pytest.approx(NOISE, rel=0.1) and heldout["before"] > 3.0 * NOISE
    # the file has the effects to the last digit, and simulate finds the same errors before and after
    given, left = (tomllib.loads(Path(name).read_text()) for name in ("model.toml", "fit/calibrated.toml"))
    assert left["effects"] == given["effects"] and left["scales"] == given["scales"]
    for model, when in (("model.toml", "before"), ("fit/calibrated.toml", "after")):
        found = simulated(model, capsys)
        for row in table["error"]["records"]:
            assert row[when] == pytest.approx(found[row["file"]], rel=1e-3), (model, row["file"])
    # without its effects the same model cannot do it: the data do hang on them
    Path("bare.toml").write_text(Path("model.toml").read_text().partition("[scales]")[0])
    assert main(["calibrate", "bare.toml", *GIVEN, "--vary", "k1", "eta1", "--out", "bare"]) == 0
    bare = json.loads(Path("bare/calibration.json").read_text())
    assert bare["error"]["heldout"]["after"] > 5.0 * NOISE and bare["effects held"] == []
    assert "effects" not in tomllib.loads(Path("bare/calibrated.toml").read_text())


def test_one_record_is_split_and_whole(bench):
    # the last third begins with what the first two did
    assert main(["calibrate", "true.toml", "r0.csv", "--vary", "k2", "--out", "one"]) == 0
    table = json.loads(Path("one/calibration.json").read_text())
    assert table["error"]["heldout"]["before"] == pytest.approx(NOISE, rel=0.2)


@pytest.mark.parametrize(
    ("table", "names", "vary", "effects"),
    [
        ({"kind": "pneunet"}, ["angle"], "stiffness", ["friction", "creep"]),
        ({"kind": "chain", "segments": 5}, ["angle"], "k_theta", ["payload", "friction"]),
        (
            {"kind": "rod", "preset": "am-i-support", "gravity": False, "elements": 6},
            ["x", "y", "z"],
            "modulus",
            ["gravity", "pressure-lag", "friction"],
        ),
    ],
)
def test_kinds_that_carry_effects(tmp_path, monkeypatch, table, names, vary, effects):
    # effects on pressures, on the output, and those that the body itself carries (gravity, payload)
    monkeypatch.chdir(tmp_path)
    model = read_model({"model": table})
    found = sorted((EFFECTS[name] for name in effects), key=lambda effect: effect.order)
    thetas = tuple(np.array([p.start for p in effect.parameters]) for effect in found)
    d, size = len(names), 0.5 if names == ["angle"] else 0.02
    scales = {"scale": np.full(d, size), "rest": np.zeros(d), "p_max": 4e4, "cycles": 12.0, "seconds": 400.0}
    true = Source(model, tuple(found), thetas, scales)
    unit, si = ("deg", np.pi / 180.0) if names == ["angle"] else ("mm", 1e-3)
    pressures = drives(2, model.chambers, 40.0)
    write(GIVEN[:2], pressures, {f"{name} [{unit}]": [0.0 * p[:, 0] for p in pressures] for name in names})
    told = predicted(true, read_records(GIVEN[:2]), names)
    columns = {f"{n} [{unit}]": [y[:, j] / si for y in told] for j, n in enumerate(names)}
    write(GIVEN[:2], pressures, columns)
    off = replace(true, model=model.with_values(**{vary: 1.2 * model.parameters[vary].value}))
    through, runs = carried(off, Path("model.toml"), read_runs(GIVEN[:2]))
    fitted, outcome = calibrate(off.model, runs[:1], runs[1:], [vary], through=through)
    assert fitted.parameters[vary].value == pytest.approx(model.parameters[vary].value, rel=1e-4)
    assert outcome.after[1] < 1e-3 * outcome.before[1]


@pytest.mark.parametrize(
    ("text", "record", "words"),
    [
        (TRUE + TABLES, "static.csv", "static curve"),
        (TRUE + TABLES.replace("stick", "stuck"), "r0.csv", "unknown key 'stuck'"),
        (TRUE + TABLES.replace("[scales]", "[scale]"), "r0.csv", "unknown table [scale]"),
        (TRUE + TABLES[TABLES.index("[effects") :], "r0.csv", "[scales]"),
        ('[model]\nkind = "fem"\ndeck = "finger.toml"\n' + TABLES, "r0.csv", "kind 'curve' with these"),
        ('[geometry]\nshape = "pneunet"\n' + TABLES, "r0.csv", "beside [model]"),
    ],
)
def test_what_cannot_carry_them_is_refused(bench, capsys, text, record, words):
    Path("static.csv").write_text("pressure [kPa],displacement [mm]\n0,0\n10,1\n20,2\n30,3\n")
    Path("given.toml").write_text(text)
    assert main(["calibrate", "given.toml", record, "--vary", "k1", "--out", "no"]) == 2
    said = capsys.readouterr().err.strip()
    assert words in said and len(said.splitlines()) == 1, said
    assert not Path("no/calibrated.toml").exists()


def test_effects_of_other_outputs_are_refused(tmp_path, monkeypatch):
    # a rod's effects are of three coordinates, the records have one of them
    monkeypatch.chdir(tmp_path)
    pressures = drives(1, 3)
    write(["r.csv"], pressures, {"x [mm]": [p[:, 0] for p in pressures]})
    rod = read_model({"model": {"kind": "rod", "preset": "am-i-support"}})
    scales = {"scale": np.ones(3), "rest": np.zeros(3), "p_max": 5e4, "cycles": 9.0, "seconds": 90.0}
    source = Source(rod, (EFFECTS["delay"],), (np.array([0.1]),), scales)
    with pytest.raises(InputError, match="3 output"):
        carried(source, Path("model.toml"), read_runs(["r.csv"]))
