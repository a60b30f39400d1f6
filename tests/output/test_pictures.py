"""Pictures are drawn in every situation, without a display; the page holds all it shows."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest

from fem_spa.output import shape_picture
from fem_spa.output.curve_plot import _abscissa, write_curve
from fem_spa.output.places import clear
from fem_spa.output.record import record
from fem_spa.output.render import RenderingFailed
from fem_spa.output.report import write_report
from fem_spa.output.shape_picture import ShapePicture, _title
from fem_spa.output.style import SERIES, figure
from fem_spa.output.surface import on_paper, outside
from fem_spa.output.words import all_warnings, highest, number, outcome, pressures, verdict
from fem_spa.solid.problem import Motion, Row

Make = Callable[..., Any]


def picture(path: Path) -> np.ndarray:
    """The pixels, at least 500 wide and not all alike."""
    pixels = matplotlib.image.imread(path)
    assert pixels.shape[1] >= 500 and pixels[..., :3].std() > 0.01
    return pixels


@pytest.mark.parametrize(
    "cavities,control,force,angle,count,touch",
    [
        (("main",), "pressure", False, 40.0, 5, None),
        (("main",), "pressure", True, 40.0, 5, {"main": 2e3}),
        (("main",), "pressure", False, -40.0, 5, {"main": 8e3}),
        (("fast", "slow"), "pressure", False, 40.0, 5, {"fast": 1e3, "slow": 2e3}),
        (("main",), "volume", False, math.nan, 5, None),
        (("a", "b", "c"), "gas-mass", False, 40.0, 5, None),
        (("main",), "pressure", False, 40.0, 1, None),
        (("main",), "pressure", False, 40.0, 0, None),
    ],
)
def test_curve(
    tmp_path: Path,
    make_problem: Make,
    make_rows: Make,
    make_result: Make,
    cavities: tuple[str, ...],
    control: str,
    force: bool,
    angle: float,
    count: int,
    touch: dict[str, float] | None,
) -> None:
    rows = make_rows(count, cavities, force, angle)
    result = make_result(rows, touch_pressure=touch)
    write_curve(tmp_path / "curve.png", make_problem(cavities, control), result, rows)
    picture(tmp_path / "curve.png")


def test_abscissa_of_two_cavities(make_problem: Make, make_rows: Make, make_result: Make) -> None:
    """Pressures in one ratio are drawn over the largest; others over the length of their path."""
    names = ("fast", "slow")
    rows = make_rows(3, names)
    values, label, _ = _abscissa(make_problem(names), make_result(rows), rows)
    assert values.tolist() == [0.0, 10.0, 20.0] and "slow" in label and "fast: 0.5 times" in label
    rows[1].pressure["fast"] = 0.0  # type: ignore[index]
    values, label, _ = _abscissa(make_problem(names), make_result(rows), rows)
    assert values == pytest.approx([0.0, 10.0, 10.0 + math.hypot(10.0, 10.0)]) and "path" in label


@pytest.mark.parametrize("flat", [False, True], ids=["vtk", "fallback"])
def test_shape(
    tmp_path: Path,
    make_problem: Make,
    make_rows: Make,
    make_state: Make,
    space: Any,
    flat: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if flat:

        def fails(self: object) -> np.ndarray:
            raise RenderingFailed("no driver")

        monkeypatch.setattr(shape_picture.Rendering, "images", fails)
    row = make_rows(3)[-1]
    ShapePicture(make_problem(), space, make_state(row), row).write(tmp_path / "shape.png")
    pixels = picture(tmp_path / "shape.png")
    coloured = np.ptp(pixels[..., :3], axis=2) > 0.2
    assert coloured.mean() > 0.05  # the deformed body, not only its ghost


def test_shape_at_rest(tmp_path: Path, make_problem: Make, space: Any) -> None:
    ShapePicture(make_problem(), space, None, None).write(tmp_path / "shape.png")
    picture(tmp_path / "shape.png")


def test_the_outside_is_mirrored_and_has_no_cavity(space: Any, block: Any) -> None:
    whole = outside(space, {})
    assert len(whole.triangles) == 4 * 6 * 18  # six faces of 3 x 3 squares of two triangles, four each
    half = outside(space, {"base": "x"})
    assert half.rest[:, 0].min() == pytest.approx(-0.01) and half.rest[:, 0].max() == pytest.approx(0.01)
    moved = half.moved(np.tile([0.001, 0.0, 0.0], (len(space.points), 1)))
    assert moved[:, 0].min() == pytest.approx(-0.011)
    a, b = on_paper(np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 4.0]]))
    assert np.hypot(*(b - a)[:2]) == pytest.approx(5.0)


class Page(HTMLParser):
    """Tags, their sources, and whether they nest."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.sources: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.sources += [value or "" for name, value in attrs if name in ("src", "href")]
        if tag not in ("meta", "img", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_report_is_one_self_contained_page(
    tmp_path: Path, make_problem: Make, make_rows: Make, make_result: Make
) -> None:
    rows, problem = make_rows(40), make_problem()
    result = make_result(rows, "limit", "element 3 <turned> inside out", warnings=["look & see"])
    write_curve(tmp_path / "curve.png", problem, result, rows)
    deck = {"geometry": {"shape": "pneunet"}, "loads": {"pressure": "20 kPa"}}
    table = record(problem, result, deck, {"body": "Yu et al. <2022>"}, {"mesh": 0.5, "total": 3.0})
    write_report(tmp_path / "report.html", problem, result, table)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    page = Page()
    page.feed(text)
    assert page.open == []
    assert len(page.sources) == 1 and page.sources[0].startswith("data:image/png;base64,")
    assert not re.search(r"https?://|@import|url\(", text)
    heading = re.search(r"<h1>(.*?)</h1>", text)
    assert heading is not None and heading[1].startswith("Stopped") and "40°" in heading[1]
    for words in (
        "look &amp; see",
        "&lt;turned&gt;",
        "Yu et al. &lt;2022&gt;",
        "fem-spa solve again.toml",
        "neo-hooke",
    ):
        assert words in text
    assert "all 40 steps" in text


def test_verdicts(make_problem: Make, make_rows: Make, make_result: Make) -> None:
    rows, problem = make_rows(3), make_problem()
    assert verdict(problem, make_result(rows), rows) == "Done: at 10 kPa the tip has turned by 40°."
    assert "before the first load step" in verdict(problem, make_result([], "diverged"), [])
    halted = verdict(problem, make_result(rows[:2], "interrupted"), rows[:2])
    assert halted == "Interrupted: reached 5 kPa of 10 kPa; there the tip has turned by 20°."
    touching = verdict(problem, make_result(rows, touch_pressure={"main": 1230.0}), rows)
    assert "walls pass through one another from 1.23 kPa on" in touching
    ended = make_result(rows, touch_pressure={"main": 1230.0})
    ended.message = "walls touch at main 1.23 kPa, near (1, 2, 3) mm; as asked, the path ends there"
    assert "walls touch at 1.23 kPa, and the path ends before, as asked" in verdict(problem, ended, rows)
    assert [text for text in all_warnings(problem, ended) if "pass through" in text] == []


def moved(row: Row, extension: float, chord: float = 0.1) -> Row:
    """The row with a stroke in m."""
    return replace(row, motion=Motion(row.angle, chord, abs(row.angle), math.nan, extension, 0.04))


def test_a_linear_shape_tells_its_stroke(make_problem: Make, make_rows: Make, make_result: Make) -> None:
    """Though it leans; a bending one tells its angle, though it lengthens."""
    rows = [moved(row, 4e-2) for row in make_rows(3)]
    linear, bending = make_problem(linear=True), make_problem()
    assert verdict(linear, make_result(rows), rows) == "Done: at 10 kPa the tip has moved by 40 mm."
    assert _title(linear, rows[-1]) == "10 kPa, moved by 40 mm"
    assert _title(bending, rows[-1]) == "10 kPa, bent by 40°"


def test_a_held_tip_tells_its_force(
    make_problem: Make, make_rows: Make, make_result: Make, tmp_path: Path
) -> None:
    """No zero that the deck prescribes, no flat curve of it; a prescribed stroke is told."""
    problem = make_problem(blocked=True)
    rows = [moved(row, 0.0, 0.0) for row in make_rows(3, force=True, angle=0.0)]
    assert _title(problem, rows[-1]) == "10 kPa, held tip pushes with 2 N"
    assert verdict(problem, make_result(rows), rows) == "Done: at 10 kPa the held tip pushes with 2 N."
    write_curve(tmp_path / "curve.png", problem, make_result(rows), rows)
    assert picture(tmp_path / "curve.png").shape[1] < 1300  # one panel
    pushed = make_problem(loads=replace(problem.loads, tip_displacement=(-7e-3, 0.0, 0.0)))
    assert "moved by -7 mm and the held" in outcome(pushed, moved(rows[-1], -7e-3, 0.0))


SEEN = {
    "all": np.eye(3),
    "no red": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
    "no green": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
    "no blue": [[1.256, -0.077, -0.179], [-0.078, 0.931, 0.148], [0.005, 0.691, 0.304]],
}
"""What linear RGB becomes for those who do not see a colour (Machado and others 2009, severity 1)."""


@pytest.mark.parametrize("eyes", SEEN)
def test_colours_of_curves_stay_apart(eyes: str) -> None:
    """In CIELAB, where 2 is seen side by side: 16 and more; 4 had been two browns of one plot."""
    rgb = np.array([[int(name[i : i + 2], 16) / 255 for i in (1, 3, 5)] for name in SERIES])
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = np.clip(linear @ np.transpose(SEEN[eyes]), 0, 1) @ np.transpose(
        [[0.4339, 0.3762, 0.1899], [0.2126, 0.7152, 0.0722], [0.0177, 0.1095, 0.8728]]
    )
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    lab = np.column_stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])])
    apart = np.linalg.norm(lab[:, None] - lab[None], axis=2) + 1e3 * np.eye(len(lab))
    assert len(SERIES) == 7 and apart.min() > 15


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_words_go_where_no_curve_is(way: float) -> None:
    """A label at the end of a steep curve, rising or falling, covers none of it."""
    axes = figure(6.0, 4.0).add_subplot()
    x, y = np.array([0.0, 1.0]), np.array([0.0, way])
    axes.plot(x, y)
    axes.margins(0.2)
    words = axes.annotate("-12.5 deg", (1.0, way), (0.0, 0.0), textcoords="offset points")
    clear(
        axes,
        words,
        [((1.0, way), (-8.0, 6 * s), "right", v) for s, v in ((1, "bottom"), (-1, "top"))],
        [(x, y)],
    )
    assert (words.get_va() == "bottom") is (way > 0)


def test_limit_point_is_found(make_rows: Make) -> None:
    rows = make_rows(4)
    assert highest(rows) is None
    rows[-1].pressure["main"] = 100.0  # type: ignore[index]
    found = highest(rows)
    assert found is not None and found.step == 2


def test_numbers() -> None:
    assert [number(x) for x in (0.0, 20.0, 53.328, 1234567.0, 0.00123, -0.0)] == [
        "0",
        "20",
        "53.33",
        "1.235e+06",
        "0.00123",
        "0",
    ]
    assert pressures({"slow": 4e4, "fast": 2e4}) == "slow 40 kPa, fast 20 kPa"


def test_nodes_without_a_stretch_take_their_neighbours() -> None:
    """An element turned inside out at a node has no stretch there: no spot, and no empty picture."""
    triangles = np.array([[0, 1, 2], [1, 2, 3], [2, 3, 4]])
    filled = shape_picture._filled(np.array([1.0, 2.0, 3.0, np.nan, np.nan]), triangles)
    assert np.all(np.isfinite(filled)) and filled.min() == 1.0 and filled.max() == 3.0
    assert np.array_equal(shape_picture._filled(np.full(5, np.nan), triangles), np.ones(5))
