"""curve.csv, result.json and the VTK files: exact names, readable by others, whole at any moment."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import pyvista

from fem_spa.output import files
from fem_spa.output.files import write_whole
from fem_spa.output.folder import ResultFolder
from fem_spa.output.record import record, to_json
from fem_spa.output.report import _rows
from fem_spa.output.table import Columns, columns, curve_csv, header
from fem_spa.solid.problem import Problem, Result, Row

Make = Callable[..., Any]


def test_header_of_one_cavity(make_rows: Make) -> None:
    lines = curve_csv(make_rows(3), Columns(("main",))).splitlines()
    assert lines[0] == (
        "step,pressure [kPa],angle [deg],tip x [mm],tip y [mm],tip z [mm],volume [mm^3],max stretch"
    )
    assert lines[2] == "1,5,20,40,0,-5,7125,1.5"
    assert len(lines) == 4


def test_header_of_two_cavities_and_a_held_tip(make_rows: Make) -> None:
    lines = curve_csv(
        make_rows(2, ("fast", "slow"), force=True), Columns(("fast", "slow"), force=True)
    ).splitlines()
    assert lines[0] == (
        "step,pressure fast [kPa],pressure slow [kPa],angle [deg],tip x [mm],tip y [mm],tip z [mm],"
        "volume [mm^3],max stretch,force [N]"
    )
    assert lines[2].split(",")[1:4] == ["10", "20", "40"] and lines[2].endswith(",2")


@pytest.mark.parametrize("planes,leans", [("", True), ("y", True), ("yz", False)])
def test_what_can_lean_has_tilt_and_direction(make_problem: Make, planes: str, leans: bool) -> None:
    """A half bends in its plane; a quarter stays straight, and its columns would be noise."""
    names = header(columns(make_problem(symmetry={f"side {axis}": axis for axis in planes})))
    assert (names[-2:] == ["tilt [deg]", "direction [deg]"]) is leans
    assert leans or not any("tilt" in name for name in names)


def test_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A write that breaks leaves the old file, and nothing beside it."""
    path = tmp_path / "a.txt"
    write_whole(path, "old")

    def broken(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(files.os, "replace", broken)
    with pytest.raises(OSError, match="disk full"):
        write_whole(path, "new")
    assert path.read_text() == "old"
    assert [found.name for found in tmp_path.iterdir()] == ["a.txt"]


@pytest.fixture
def folder(
    tmp_path: Path, make_problem: Make, make_rows: Make, make_state: Make, make_result: Make, space: Any
) -> Path:
    """A result folder after three steps."""
    with ResultFolder(tmp_path / "out") as observer:
        observer.start(make_problem(), space)
        for row in make_rows(3):
            observer.converged(make_state(row), row, 0.5)
        observer.finished(make_result(observer.rows))
    return tmp_path / "out"


def test_fields_are_read_by_pyvista_and_meshio(folder: Path, space: Any) -> None:
    reader = pyvista.get_reader(str(folder / "fields.pvd"))
    assert list(reader.time_values) == [0.0, 1.0, 2.0]
    path = folder / "fields" / "step_0002.vtu"
    grid = pyvista.read(path)
    assert set(grid.celltypes) == {24}
    assert grid.n_points == len(space.points) and grid.n_cells == len(space.tets)
    names = {"displacement", "pressure field", "principal stretches", "Cauchy stress"}
    assert set(grid.point_data) == names and set(grid.cell_data) == {"region"}
    assert np.allclose(grid.points, space.points)
    assert np.allclose(grid["displacement"][:, 0], 0.2 * space.points[:, 0])
    assert np.allclose(grid["principal stretches"], [1.2, 1.0, 1.0], atol=1e-6)
    assert grid["Cauchy stress"].shape == (len(space.points), 6)
    assert grid.compute_cell_sizes()["Volume"].sum() == pytest.approx(1e-6 * 26 / 27, rel=1e-6)
    assert grid.field_data["pressure [kPa]"][0] == 10.0
    other = meshio.read(path)
    assert other.cells[0].type == "tetra10" and np.array_equal(other.cells[0].data, space.tets)
    assert set(other.point_data) == names


def test_files_of_an_earlier_run_are_gone(folder: Path, make_problem: Make, space: Any) -> None:
    (folder / "report.html").write_text("old")
    (folder / "mine.txt").write_text("kept")
    with ResultFolder(folder) as observer:
        observer.start(make_problem(), space)
    assert not list((folder / "fields").iterdir()) and not (folder / "report.html").exists()
    assert (folder / "mine.txt").read_text() == "kept"
    assert len((folder / "curve.csv").read_text().splitlines()) == 1


def test_the_record_is_strict_json(make_problem: Make, make_rows: Make, make_result: Make) -> None:
    rows: list[Row] = make_rows(3, angle=math.nan)
    problem: Problem = make_problem()
    result: Result = make_result(rows, "limit", "too much", touch_pressure={"main": 1230.0})
    table = record(problem, result, {"loads": {"pressure": "1 kPa"}}, {"body": "a paper"}, {"total": 1.0})

    def refuse(word: str) -> None:
        raise AssertionError(word)

    read = json.loads(to_json(table), parse_constant=refuse)
    assert read["status"] == "limit" and read["last"]["angle [deg]"] is None
    assert read["first touch [kPa]"] == {"main": 1.23}
    assert any("contact" in text for text in read["warnings"])
    assert read["mesh_hash"] == problem.mesh.hash()
    body = read["materials"]["body"]
    assert body["source"] == "a paper" and body["bulk"]["value"] == "inf"
    assert body["shear_modulus"] == {"value": 2e5, "unit": "Pa"}


def test_a_report_leaves_out_columns_without_a_number(make_problem: Make, make_rows: Make) -> None:
    """A body without a tip has no angle: no column of "none" in the page; curve.csv keeps its columns."""
    rows = make_rows(3)
    assert "angle [deg]" in _rows(make_problem(), rows)
    blind = [replace(row, angle=math.nan, tip=np.full(3, math.nan)) for row in rows]
    table = _rows(make_problem(), blind)
    assert "angle [deg]" not in table and "tip x" not in table and "none" not in table
    assert "volume [mm^3]" in table
