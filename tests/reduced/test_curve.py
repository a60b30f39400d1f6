"""Static curves: from any table, monotone between the points, straight beyond; bad input in one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fem_spa.errors import InputError
from fem_spa.reduced.checks import check_drive, outside, refuse_gap
from fem_spa.reduced.curve import Curve, from_points, loading
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import model_text, read_model

SOLVED = """step,pressure [kPa],angle [deg],tip x [mm],tip y [mm],tip z [mm],volume [mm^3],force [N]
0,0,0,100,0,0,500,nan
1,10,5,99,0,10,600,nan
2,20,20,90,0,30,700,nan
3,15,18,91,0,25,690,nan
4,20,20,90,0,30,700,nan
5,30,28,85,0,40,800,nan
"""


def drive(*pressure: float) -> Drive:
    return Drive(np.arange(len(pressure), dtype=float), np.array(pressure)[:, None])


@pytest.fixture
def solved(tmp_path: Path) -> Path:
    (tmp_path / "curve.csv").write_text(SOLVED, encoding="utf-8")
    return tmp_path


def test_the_curve_of_solve_is_read_without_its_way_back(solved: Path) -> None:
    """Rows that come back to 15 kPa and repeat 20 kPa would make the map two-valued."""
    model = read_model({"kind": "curve", "file": "curve.csv"}, solved)
    angle = np.rad2deg(model.simulate(drive(0.0, 10e3, 20e3, 30e3)))[:, 0]
    assert angle == pytest.approx([0, 5, 20, 28])
    assert [output.name for output in model.outputs] == ["angle"]
    assert model.valid is not None and (model.valid.low, model.valid.high) == ((0.0,), (30e3,))


@pytest.mark.parametrize("output, at_20", [("x", 90.0), ("z", 30.0), ("displacement", 10 * np.hypot(1, 3))])
def test_other_columns_are_chosen_by_name(solved: Path, output: str, at_20: float) -> None:
    model = read_model({"kind": "curve", "file": "curve.csv", "output": output}, solved)
    got = 1e3 * model.simulate(drive(20e3))[0, 0]
    assert got == pytest.approx(at_20, rel=2e-3 if output == "displacement" else 1e-12)


def test_units_are_converted(tmp_path: Path) -> None:
    (tmp_path / "bench.csv").write_text(
        "# by hand\nforce [lbf],pressure [psi]\n0,0\n1,2\n2,5\n", encoding="utf-8"
    )
    model = read_model({"kind": "curve", "file": "bench.csv"}, tmp_path)
    assert model.simulate(drive(2 * 6894.757293168))[0, 0] == pytest.approx(4.4482216152605)


def test_between_the_points_it_neither_overshoots_nor_jumps() -> None:
    """A natural cubic would swing below zero before the steep part; PCHIP must not."""
    p = 1e3 * np.arange(7.0)
    curve = from_points(p, np.array([0, 0, 0, 1.0, 1.0, 1.0, 2.0]), "angle")
    fine = np.linspace(0, 6e3, 1001)
    assert np.all(np.diff(curve.at(fine)) >= -1e-15)
    assert curve.at(fine).min() >= 0
    middle = fine[1:-1]
    numeric = (curve.at(middle + 0.01) - curve.at(middle - 0.01)) / 0.02
    assert curve.slope(middle) == pytest.approx(numeric, abs=1e-7)


def test_beyond_the_points_it_goes_on_straight_and_says_so() -> None:
    curve = from_points(np.array([-10e3, 0, 20e3]), np.array([-0.1, 0.0, 0.4]), "angle", "bench.csv")
    p = np.array([20e3, 30e3, 40e3])
    assert np.diff(curve.at(p), 2) == pytest.approx(0, abs=1e-12)
    assert curve.at(p[1:]) == pytest.approx(curve.at(p[:1]) + curve.slope(p[:1]) * (p[1:] - 20e3))
    assert outside(curve, drive(0, 20e3)) is None
    assert "from 0 to 40 kPa" in str(outside(curve, drive(0, 40e3)))


def test_a_model_file_holds_the_points_themselves(solved: Path, tmp_path: Path) -> None:
    model = read_model({"kind": "curve", "file": "curve.csv", "gain": 1.5, "offset": "2 deg"}, solved)
    (tmp_path / "elsewhere.toml").write_text(model_text(model), encoding="utf-8")
    (solved / "curve.csv").unlink()
    again = read_model(tmp_path / "elsewhere.toml")
    d = drive(-5e3, 3e3, 12e3, 33e3)
    assert again.simulate(d) == pytest.approx(model.simulate(d), abs=1e-12)
    assert np.rad2deg(again.simulate(drive(20e3))[0, 0]) == pytest.approx(1.5 * 20 + 2)
    assert again.valid == model.valid


def test_loading_branch() -> None:
    """Down to vacuum and up again; noise on the way; a limit point."""
    p = np.array([0, -10, -5, 0, 10, 9, 20, 20, 15, 30.0])
    assert p[loading(p)] == pytest.approx([0, -10, 10, 20, 30])


@pytest.mark.parametrize(
    "table, words",
    [
        ({"kind": "curv"}, "did you mean 'curve'"),
        ({"kind": "curve"}, "model.file"),
        ({"kind": "curve", "file": "none.csv"}, "cannot be read"),
        ({"kind": "curve", "file": "curve.csv", "output": "angel"}, "did you mean 'angle'"),
        ({"kind": "curve", "file": "curve.csv", "gain": "2 mm"}, "plain number"),
        ({"kind": "curve", "file": "curve.csv", "fiel": 1}, "no such key"),
        ({"kind": "curve", "columns": ["pressure [kPa]", "angle [deg]"], "rows": [[0, 1], [2]]}, "rows of 2"),
        ({"kind": "curve", "columns": ["angle [deg]"], "rows": [[0], [2]]}, "no pressure"),
        (
            {"kind": "curve", "columns": ["pressure [mm]", "angle [deg]"], "rows": [[0, 1], [2, 3]]},
            "like kPa",
        ),
        (
            {"kind": "curve", "columns": ["pressure [kPa]", "angle [deg]"], "rows": [[1, 1], [1, 3]]},
            "two rows",
        ),
        (
            {
                "kind": "curve",
                "columns": ["pressure a [kPa]", "pressure b [kPa]", "x [mm]"],
                "rows": [[0, 1, 2]],
            },
            "2 pressure columns",
        ),
    ],
)
def test_a_wrong_table_is_refused_in_one_line(solved: Path, table: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read_model(table, solved)
    assert "\n" not in str(caught.value)


def test_broken_files_are_refused(tmp_path: Path) -> None:
    for text, words in (
        ("", "header"),
        ("pressure [kPa],angle [deg]\n1,2\n3\n", "row 2"),
        ("a,b\n1,x\n", "'x'"),
    ):
        (tmp_path / "curve.csv").write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=words):
            read_model({"kind": "curve", "file": "curve.csv"}, tmp_path)
    (tmp_path / "model.toml").write_text("kind = ", encoding="utf-8")
    with pytest.raises(InputError, match="not TOML"):
        read_model(tmp_path / "model.toml")
    with pytest.raises(InputError, match="cannot be read"):
        read_model(tmp_path / "none.toml")


@pytest.mark.parametrize(
    "time, pressure, words",
    [
        ([], np.empty((0, 1)), "no times"),
        ([0, 1], [[0.0]], "one row a time"),
        ([0, 1], [[0, 0], [0, 0]], "takes one pressure"),
        ([0, 2, 1], [[0], [0], [0]], "1 s at row 3 after 2 s"),
        ([0, np.nan], [[0], [0]], "gap in the time at row 2"),
        ([0, 1], [[0], [np.nan]], r"gap in the pressure at row 2 \(1 s\)"),
        ([0, 1], [[0], [-2e5]], "below vacuum"),
        ([0, 1], [[0], [2e9]], "unit of the column"),
    ],
)
def test_a_wrong_drive_is_refused_in_one_line(time: list[float], pressure: object, words: str) -> None:
    curve: Curve = from_points(np.array([0, 1e3]), np.array([0, 1.0]), "angle")
    with pytest.raises(InputError, match=words) as caught:
        curve.simulate(Drive(np.array(time, float), np.array(pressure, float)))
    assert "\n" not in str(caught.value)


def test_missing_rows_are_found_and_uneven_sampling_is_not_refused() -> None:
    time = np.arange(0, 10, 0.05)
    with pytest.raises(InputError, match="gap of 2"):
        refuse_gap(np.delete(time, np.arange(100, 141)))
    refuse_gap(time)
    refuse_gap(np.geomspace(0.01, 1000, 50))
    check_drive(Drive(np.array([0, 1, 60.0]), np.zeros((3, 1))), 1, "curve")
