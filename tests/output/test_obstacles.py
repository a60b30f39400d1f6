"""Obstacles in files, pictures and words; contact on and off in what a result says."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
import pyvista

from fem_spa.output.curve_plot import write_curve
from fem_spa.output.folder import ResultFolder
from fem_spa.output.obstacle_surface import surface
from fem_spa.output.record import record
from fem_spa.output.report import write_report
from fem_spa.output.shape_picture import ShapePicture
from fem_spa.output.table import columns, header, values
from fem_spa.output.words import all_warnings, verdict
from fem_spa.solid.obstacles import Cylinder, Plane, Sphere

Make = Callable[..., Any]
BOX = np.array([[0.0, 0.0, 0.0], [0.04, 0.03, 0.02]])


def area(points: np.ndarray, triangles: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    a, b, c = (points[triangles[:, i]] for i in range(3))
    normal = 0.5 * np.cross(b - a, c - a)
    return float(np.linalg.norm(normal, axis=1).sum()), normal, (a + b + c) / 3


@pytest.mark.parametrize(
    ("obstacle", "size", "out"),
    [
        (Sphere((0.1, 0.2, 0.3), 0.05), 4 * math.pi * 0.05**2, lambda x: x - [0.1, 0.2, 0.3]),
        (Sphere((0.1, 0, 0), (0.02, 0.02, 0.02)), 4 * math.pi * 0.02**2, lambda x: x - [0.1, 0, 0]),
        (Plane((0, 0, -0.01), (0, 0, 3.0)), 0.056 * 0.046, lambda x: np.tile([0, 0, 1.0], (len(x), 1))),
        (
            Cylinder((0, 0, -0.05), (0, 2.0, 0), 0.01),
            2 * math.pi * 0.01 * 0.046,
            lambda x: (x - [0, 0, -0.05]) * [1, 0, 1],
        ),
    ],
)
def test_surfaces_look_outwards_and_have_their_size(obstacle: Any, size: float, out: Any) -> None:
    """A surface turned inside out would be painted as its far side."""
    found, normal, middle = area(*surface(obstacle, BOX))
    assert found == pytest.approx(size, rel=0.01)
    assert np.all(np.einsum("ij,ij->i", normal, out(middle)) >= -1e-15)


@pytest.fixture
def pressed(make_problem: Make, make_rows: Make) -> tuple[Any, list[Any]]:
    """A problem with two obstacles, and rows that press on them; walls touch at 4 kPa."""
    obstacles = (Plane((0, 0, -1e-3), (0, 0, 1)), Sphere((0.005, 0.005, -0.01), (0.006, 0.006, 0.009)))
    problem = make_problem(contact=True, obstacles=obstacles)
    rows = [
        replace(row, gap=1e-5, obstacle_force=row.step * np.array([[0.3, 0, 0.4], [0, 0, -0.2]]))
        for row in make_rows(5)
    ]
    return problem, rows


def test_columns_of_contact_come_after_the_contracts(pressed: Any) -> None:
    problem, rows = pressed
    names = header(columns(problem))
    assert names[8:11] == ["min gap [mm]", "force obstacle 1 [N]", "force obstacle 2 [N]"]
    assert values(rows[-1], columns(problem))[8:11] == pytest.approx([0.01, 2.0, 0.8])
    assert "min gap [mm]" not in header(columns(replace(problem, contact=False, obstacles=())))


def test_everything_is_written_with_obstacles(
    pressed: Any, tmp_path: Path, make_state: Make, make_result: Make, space: Any
) -> None:
    problem, rows = pressed
    with ResultFolder(tmp_path / "out") as folder:
        folder.start(problem, space)
        for row in rows:
            folder.converged(make_state(row), row, 0.1)
        result = make_result(folder.rows, touch_pressure={"main": 4e3})
        folder.finished(result)
    mesh = pyvista.read(tmp_path / "out" / "obstacles.vtp")
    assert set(mesh["obstacle"]) == {1, 2} and mesh.n_points > 100
    lines = (tmp_path / "out" / "centre_line.csv").read_text().splitlines()
    assert len(lines) == 1 + 5 * 41 and lines[0].startswith("step,pressure [kPa],s [mm]")
    write_curve(tmp_path / "out" / "curve.png", problem, result, folder.rows)
    ShapePicture(problem, space, make_state(rows[-1]), rows[-1]).write(tmp_path / "out" / "shape.png")
    pixels = matplotlib.image.imread(tmp_path / "out" / "shape.png")[..., :3]
    blue = (pixels[..., 2] > pixels[..., 0] + 0.04) & (pixels[..., 2] > 0.3)
    assert blue.mean() > 0.02  # the obstacles
    table = record(problem, result, {}, {}, {"total": 1.0})
    assert table["contact"] is True and table["last"]["force obstacle [N]"] == pytest.approx([2.0, 0.8])
    write_report(tmp_path / "out" / "report.html", problem, result, table)
    page = (tmp_path / "out" / "report.html").read_text()
    assert "frictionless" in page and "ellipsoid round" in page and "plane through (0, 0, -1) mm" in page
    assert "first touch at" in page and "switched off" not in page


def test_words_with_contact_and_without(pressed: Any, make_problem: Make, make_result: Make) -> None:
    problem, rows = pressed
    result = make_result(rows, touch_pressure={"main": 4e3})
    held = verdict(problem, result, rows)
    assert "First touch at 4 kPa" in held and "2 N" in held and "pass through" not in held
    assert all_warnings(problem, result) == []
    off = make_problem(contact=False)
    assert "Contact is off: walls pass through one another from 4 kPa on" in verdict(off, result, rows)
    (warning,) = all_warnings(off, result)
    assert "contact is switched off" in warning and "not to be trusted" in warning
