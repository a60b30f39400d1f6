"""Records: units to SI, metadata, order, and a reason for whatever cannot be read."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from loop_bench import drives, duhem, write_case

from fem_spa.cli import main
from fem_spa.errors import InputError
from fem_spa.loop.audit import ahead
from fem_spa.loop.data import spikes
from fem_spa.loop.records import NoTime, read_record, read_records
from fem_spa.loop.split import split, unseen

HEAD = "time [s],pressure [kPa],angle [deg]\n"


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def test_units_and_metadata_are_read(tmp_path: Path) -> None:
    text = (
        "# orientation: 90 deg\n# payload: 20 g\n# start: 2026-01-01T00:01:00\n# history: virgin\n"
        "time [ms],pressure [bar],measured pressure [kPa],temperature [degC],angle [rad],colour\n"
        "0,0,0,20,0.1,1\n100,0.5,49,21,,2\n200,1,99,21,0.3,3\n"
    )
    record = read_record(write(tmp_path / "a.csv", text))
    assert record.time == pytest.approx([0, 0.1, 0.2])
    assert record.pressures[:, 0] == pytest.approx([0, 5e4, 1e5])
    assert record.measured is not None and record.measured[2, 0] == pytest.approx(99e3)
    assert record.temperature is not None and record.temperature[0] == pytest.approx(293.15)
    assert record.orientation == pytest.approx(math.pi / 2) and record.payload == pytest.approx(0.02)
    assert np.isnan(record.outputs["angle"][1]) and record.history == "virgin"
    assert any("colour" in note for note in record.notes)


def test_records_stand_in_the_order_of_their_start(tmp_path: Path) -> None:
    rows = "0,0,0\n1,1,1\n"
    late = write(tmp_path / "late.csv", "# start: 2026-01-02T00:00:00\n" + HEAD + rows)
    early = write(tmp_path / "early.csv", "# start: 2026-01-01T00:00:00\n" + HEAD + rows)
    unknown = write(tmp_path / "unknown.csv", HEAD + rows)
    assert [r.name for r in read_records([late, early])] == ["early", "late"]
    assert [r.name for r in read_records([late, early, unknown])] == ["late", "early", "unknown"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time [s],pressure [mm],angle [deg]\n0,0,0\n", "pressure"),
        ("time [s],pressure [kPa],angle\n0,0,0\n", "no unit"),
        ("time [s],pressure [kPa]\n0,0\n", "no output"),
        (HEAD + "0,0,zero\n", "no number"),
        (HEAD + "0,0\n", "2 cells"),
        ("# history: old\n" + HEAD + "0,0,0\n", "history"),
        ("# start: yesterday\n" + HEAD + "0,0,0\n", "ISO"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read_record(write(tmp_path / "a.csv", text))


def test_times_that_do_not_increase_are_no_time(tmp_path: Path) -> None:
    with pytest.raises(NoTime):
        read_record(write(tmp_path / "a.csv", HEAD + "1,0,0\n" * 5))
    with pytest.raises(NoTime):
        read_record(write(tmp_path / "b.csv", "pressure [kPa],angle [deg]\n0,0\n"))


def test_an_outlier_is_one_and_a_step_is_none() -> None:
    t = np.linspace(0.0, 10.0, 400)
    step = np.where(t > 5.0, 10.0, 0.0) + 0.01 * np.sin(40.0 * t)
    assert not spikes(step).any()
    step[100] += 4.0
    assert list(np.nonzero(spikes(step))[0]) == [100]


def test_an_output_without_a_number_is_one_line(tmp_path: Path, capsys: Any) -> None:
    """Two records, one of which has no angle at all."""
    write(tmp_path / "map.csv", "pressure [kPa],angle [deg]\n0,0\n10,5\n20,12\n")
    model = write(tmp_path / "model.toml", '[model]\nkind = "curve"\nfile = "map.csv"\n')
    rows = [(0.05 * k, 10 + 10 * math.sin(0.05 * k)) for k in range(200)]
    whole = write(tmp_path / "a.csv", HEAD + "".join(f"{t},{p},{0.6 * p}\n" for t, p in rows))
    empty = write(tmp_path / "b.csv", HEAD + "".join(f"{t},{p},nan\n" for t, p in rows))
    assert main(["diagnose", str(model), str(whole), str(empty), "--out", str(tmp_path / "out")]) == 2
    assert "b.csv: no sample of angle is a number" in capsys.readouterr().err.splitlines()[-1]


@pytest.mark.parametrize(("records", "fitted", "provisional"), [(2, 1, True), (3, 2, False)])
def test_what_is_fitted_to_one_record_is_provisional(
    tmp_path: Path, records: int, fitted: int, provisional: bool
) -> None:
    _, files = write_case(tmp_path, duhem, shares=drives()[:records])
    parted = split(read_records(files), [], 0)
    assert (sum(parted.train), parted.provisional) == (fitted, provisional)
    given = split(read_records(files), files[1:], 0)
    assert sum(given.train) == 1 and given.provisional


@pytest.mark.parametrize("turned", [[4], [3, 4], [0, 1, 2]])
def test_a_pose_is_never_held_out_whole(tmp_path: Path, turned: list[int]) -> None:
    """Gravity shows between poses: a record upside down that is alone in it must be there to fit."""
    _, files = write_case(tmp_path, duhem, shares=drives()[:5])
    for k in turned:
        files[k].write_text(files[k].read_text().replace("# orientation: 0 deg", "# orientation: 180 deg"))
    for seed in range(12):
        parted = split(read_records(files), [], seed)
        poses = [r.orientation for r, train in zip(parted.records, parted.train, strict=True) if train]
        assert sum(abs(pose - math.pi) < 1e-6 for pose in poses if pose is not None) >= 1
        assert any(abs(pose) < 1e-6 for pose in poses if pose is not None)
        assert sum(parted.train) == 3


def test_a_pose_that_is_only_held_out_is_told(tmp_path: Path) -> None:
    _, files = write_case(tmp_path, duhem, shares=drives()[:4])
    files[3].write_text(files[3].read_text().replace("# orientation: 0 deg", "# orientation: 180 deg"))
    told = unseen(split(read_records(files), files[3:], 0))
    assert list(told) == [files[3].name] and "its orientation:" in told[files[3].name]
    assert unseen(split(read_records(files), files[2:3], 0)) == {}
    files[3].write_text(files[3].read_text().replace("# orientation: 180 deg\n", ""))
    assert unseen(split(read_records(files), files[3:], 0)) == {}, "not stated is not known to be another"


@pytest.mark.parametrize(("shift", "said"), [(0.3, True), (0.0, False), (-0.5, False)])
def test_an_output_ahead_of_its_pressure_is_noted(shift: float, said: bool) -> None:
    """Two clocks: an actuator may be late, never early. Curved map and noise, falling with the pressure."""
    t = np.arange(0.0, 40.0, 0.05)
    p = 3e4 * (1.0 - np.cos(0.9 * t) * np.cos(0.21 * t))
    late = np.interp(t + shift, t, p)
    y = 1.0 - 0.5 * late / 6e4 - 0.3 * (late / 6e4) ** 2 + np.random.default_rng(2).normal(0.0, 0.004, len(t))
    y[100:110] = np.nan
    found = ahead(t, p[:, None], y)
    assert found == (pytest.approx(shift, abs=0.06) if said else 0.0)
