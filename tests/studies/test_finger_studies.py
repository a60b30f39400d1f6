"""Studies of the composite finger: the two grasps, and the map on a finger of four chambers."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from fem_spa.cli import main
from fem_spa.reduced.finger import finger
from studies import egg_and_sphere, finger_map


def test_egg_and_sphere(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Printed numbers beside ours; the chamber of the sphere is the seventh by (8) to 1 %."""
    assert main(["study", "egg_and_sphere", "--out", str(tmp_path / "o")]) == 0
    said = capsys.readouterr().out
    assert "100.4" in said and "28.7 kPa" in said and "out of reach" in said
    with open(tmp_path / "o" / "egg_and_sphere.csv", newline="", encoding="utf-8") as file:
        rows = {row["quantity"]: row for row in csv.DictReader(file)}
    total = rows["egg: angle at 20 and 13.9 kPa (7), crowns"]
    assert float(total["ours"]) == pytest.approx(float(total["printed"]), rel=0.02)
    sphere = rows["sphere: slow pressure (8), as (10) has it, end of chamber 7"]
    assert float(sphere["ours"]) == pytest.approx(28.7, rel=0.01)
    assert (tmp_path / "o" / "egg_and_sphere.png").stat().st_size > 10_000


def test_the_egg_names_lengths_that_lead_to_it() -> None:
    """The chain with those lengths and angles ends at the printed point, at the printed angle."""
    slow, fast, angles = egg_and_sphere.printed_lengths()
    end = egg_and_sphere.tip(angles, np.array([slow, fast]))
    assert end == pytest.approx(egg_and_sphere.EGG_BASE, abs=1e-9)
    assert np.degrees(angles.sum()) == pytest.approx(100.4)


def test_touch_of_the_sphere_is_the_first() -> None:
    """A little less pressure leaves a gap; a finger that is straight is clear of it."""
    model = finger()
    point = egg_and_sphere.gripper(model).to_base(np.array(egg_and_sphere.SPHERE_GLOBAL), 2)
    pressure, place = egg_and_sphere.first_touch(model, point)
    assert 5e3 < pressure < 28.7e3 and 0 < place < 15
    stiffer = model.with_values(stiffness=2.0)
    with pytest.raises(ValueError, match="different signs"):  # not up to the printed pressure
        egg_and_sphere.first_touch(stiffer, point)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two slow and two fast chambers, four pairs, below the pressure at which walls touch."""
    monkeypatch.setattr(finger_map, "SLOW", (0, 10))
    monkeypatch.setattr(finger_map, "FAST", (0, 1))
    changes = ["geometry.size='8 mm'", "geometry.slow_chambers=2", "geometry.fast_chambers=2"]
    monkeypatch.setattr(finger_map, "CHANGES", changes)


def test_paths_pass_through_all_pairs_and_turn_one_pressure_at_a_time() -> None:
    """No pair is left out; from point to point one pressure moves by one step of the grid."""
    paths = finger_map.load_paths()
    pairs = {(s, f) for s in finger_map.SLOW for f in finger_map.FAST} - {(0, 0)}
    assert {point for path in paths for point in path} == pairs
    for path in paths:
        steps = np.abs(np.diff([(0.0, 0.0), *path], axis=0)) / (10, 5)
        assert np.all(steps.sum(axis=1) == 1.0)


@pytest.mark.slow
def test_finger_map(
    small: None, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """FE reaches all pairs, is additive, and is not run again in the same folder."""
    out = tmp_path / "o"
    assert main(["study", "finger_map", "--out", str(out)]) == 0
    assert "FE reached 4 of 4" in capsys.readouterr().out
    table = np.genfromtxt(out / "map.csv", delimiter=",", skip_header=1)
    fe = table[:, 3].reshape(2, 2)
    assert fe[0, 0] == pytest.approx(0.0, abs=1e-9)
    assert fe[1, 1] == pytest.approx(fe[1, 0] + fe[0, 1], rel=0.05)
    assert (out / "map.png").stat().st_size > 10_000

    def never(*_: object, **__: object) -> None:
        raise AssertionError("a finished path was walked again")

    monkeypatch.setattr(finger_map, "open_engine", never)
    assert main(["study", "finger_map", "--out", str(out)]) == 0
    again = np.genfromtxt(out / "map.csv", delimiter=",", skip_header=1)
    assert again == pytest.approx(table)
    monkeypatch.setattr(finger_map, "CHANGES", [*finger_map.CHANGES, "geometry.lateral_wall='1.2 mm'"])
    with pytest.raises(AssertionError, match="walked again"):  # another finger: its old paths do not count
        finger_map.run(out)


def test_the_fit_finds_a_finger_of_other_stiffness() -> None:
    """Angles made by the model itself: the stiffnesses come back, and pairs not used fit."""
    pairs = np.array([(s, f) for s in finger_map.SLOW for f in finger_map.FAST], float)
    true = finger().with_values(slow_stiffness=1.2, fast_stiffness=0.7, offset=0.02, fast_bending=3e-5)
    angle = np.degrees(finger_map._angles(true, pairs))
    angle[5] = np.nan
    fitted, held = finger_map.calibrated(finger(), pairs, angle)
    assert 35 < held.sum() < 45 and not held[5]
    for name in ("slow_stiffness", "fast_stiffness", "fast_bending", "offset"):
        assert fitted.parameters[name].value == pytest.approx(true.parameters[name].value, rel=1e-4)
