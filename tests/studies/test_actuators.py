"""The studies of every actuator, each on a small body: one physical number of each is right."""

from __future__ import annotations

import csv
import importlib
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fem_spa.cli import main
from fem_spa.deck import set_value
from fem_spa.output.toml import to_toml

SMALL_FAST = (
    *("geometry.fast_chambers=2", "geometry.size='6 mm'", "loads.pressure='3 kPa'"),
    "loads.path=['1 kPa', '2 kPa']",
)
SMALL_TRIPOD = ("geometry.chambers=1", "geometry.size='10 mm'", "loads.points=2")


@pytest.fixture
def small(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., str]:
    """(study, overrides of its deck, other names of the module) -> what it said; its files are in `out`."""

    def deck(path: Path, overrides: tuple[str, ...]) -> Path:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        for override in overrides:
            set_value(tables, override)
        copy = tmp_path / path.name
        copy.write_text(to_toml(tables), encoding="utf-8")
        return copy

    def run(name: str, overrides: tuple[str, ...], **others: Any) -> str:
        module = importlib.import_module(f"studies.{name}")
        monkeypatch.setattr(module, "DECK", deck(module.DECK, overrides))
        for key, value in others.items():
            old = getattr(module, key)
            monkeypatch.setattr(module, key, deck(old, value) if isinstance(old, Path) else value)
        monkeypatch.chdir(tmp_path)
        status = main(["study", name, "--out", "out"])
        said = capsys.readouterr()
        assert status == 0, said.err
        assert "Newton iterations" in said.out and " MB" in said.out
        return said.out

    return run


def columns(path: str) -> dict[str, np.ndarray]:
    """A CSV file's columns; empty cells are nan."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {key: np.array([float(row[key] or "nan") for row in rows]) for key in rows[0]}


def test_zigzag_linear_extends(small: Callable[..., str]) -> None:
    """A pair of chambers of the 22 gives an eleventh of 40 mm at 350 kPa, less what its ends hold back."""
    said = small("zigzag_linear", ("geometry.chambers=2", "geometry.size='5 mm'", "loads.points=2"))
    stroke = columns("out/curve.csv")["extension [mm]"]
    assert stroke[0] == 0.0 and all(np.diff(stroke) > 0) and 0.4 * 40 / 11 < stroke[-1] < 1.3 * 40 / 11
    assert "40 mm" in said and Path("out/extension.png").is_file()
    assert "Largest principal stretch: above 1.2 from" in said
    assert "the tip has moved by" in Path("out/report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_zigzag_bending_less_with_a_thicker_layer(small: Callable[..., str]) -> None:
    cases = {"T1, 1 mm": ("1 mm", "1"), "T1, 1.5 mm": ("1.5 mm", "1"), "T1, 2 mm": ("2 mm", "1")}
    overrides = ("geometry.chambers=2", "geometry.size='6 mm'", "loads.pressure='100 kPa'", "loads.points=2")
    said = small("zigzag_bending", overrides, CASES=cases, RANGE=(100.0, 30.0))
    angles = [values[-1] for name, values in columns("out/curve.csv").items() if "deg" in name]
    assert angles[0] > angles[1] > angles[2] > 0.5
    assert "Table II" not in said and "stiffness" in said
    assert float(said.split("T1, 1 mm")[1].split()[0]) == pytest.approx(
        columns("out/T1_1mm/curve.csv")["max stretch"][-1], abs=0.01
    )


@pytest.mark.slow
def test_bellow_moves_with_the_sign_of_the_pressure(small: Callable[..., str]) -> None:
    """The slope of the blocked force is an area between those of inner and outer diameter."""
    overrides = (
        *("geometry.convolutions=2", "geometry.convoluted_height='4 mm'", "geometry.neck_height='3 mm'"),
        "geometry.top='2 mm'",
        *("geometry.layer_width='20 mm'", "geometry.size='3 mm'", "loads.pressure='10 kPa'"),
    )
    runs = {
        "pressure": ["loads.points=2"],
        "vacuum": ["loads.pressure='-10 kPa'", "loads.points=2"],
        "blocked": [
            "loads.tip_displacement=[0, 0, '-0.2 mm']",
            "loads.path=['-10 kPa', '0 kPa']",
        ],
    }
    said = small("bellow", overrides, RUNS=runs)
    move = columns("out/curve.csv")
    assert all(np.diff(move["pressure [kPa]"]) > 0) and all(np.diff(move["displacement [mm]"]) > 0)
    force = columns("out/blocked.csv")
    area = 1e3 * np.polyfit(force["pressure [kPa]"], force["force [N]"], 1)[0]  # mm^2
    assert np.pi * 2.5**2 < area < np.pi * 5**2
    assert "Shore 50 A" in said
    assert "nan" not in said and "without pressure" in said  # nothing of pressures that are not reached


def test_tripod_laws_differ_by_their_moduli(small: Callable[..., str]) -> None:
    """At small angles, before chambers touch, the two laws' angles are as 0.72 to 3.1 MPa."""
    thin = {"outer walls of 1.2 mm": ["geometry.outer_wall='1.2 mm'"]}
    said = small("tripod", (*SMALL_TRIPOD, "loads.pressure={ 1 = '1 kPa', 2 = '0 kPa' }"), SIZES=thin)
    curve = columns("out/curve.csv")
    one = {name: values[1] for name, values in curve.items()}
    assert one["contact off gravity [deg]"] / one["linear law [deg]"] == pytest.approx(3.1 / 0.72, rel=0.1)
    assert "36.2 deg measured" in said
    more = float(said.split("outer walls of 1.2 mm")[1].split()[1])
    assert more > 0 and "both, contact" in said  # a thinner wall bends more, in per cent
    # in the half's plane, away from the inflated channel, as far as the angle says
    words = said.split("the tip leans by ")[1].split()
    assert float(words[0]) == pytest.approx(one["contact gravity [deg]"], abs=0.06) and words[3] == "-90"
    assert columns("out/contact_gravity/curve.csv")["direction [deg]"][-1] == pytest.approx(-90.0)


def test_arm_segment_bends_less_than_the_rod(small: Callable[..., str]) -> None:
    overrides = (
        *("geometry.chamber_length='40 mm'", "geometry.rings=1", "geometry.size='10 mm'"),
        *("loads.pressure={ 1 = '20 kPa', 2 = '0 kPa' }", "loads.points=2"),
    )
    said = small("arm_segment", overrides)
    ratio = float(said.split("FE / rod")[1].split()[3])
    assert ratio < 1.0 and f"FE has {ratio:.2f} of the rod's angle at 10 kPa" in said


def test_grasp_sphere_presses_after_the_touch(small: Callable[..., str]) -> None:
    """No force before the finger reaches the sphere, then more with pressure, away from the finger."""
    overrides = (
        *("geometry.slow_chambers=3", "geometry.fast_chambers=1", "geometry.size='6 mm'"),
        "loads.pressure={ slow = '40 kPa', fast = '2 kPa' }",
        "loads.path=[{ slow = '10 kPa', fast = '0 kPa' }, { slow = '40 kPa', fast = '0 kPa' }]",
        "loads.obstacles=[{ sphere = { centre = ['35 mm', 0, '-32 mm'], radius = '30 mm' } }]",
    )
    said = small("grasp_sphere", overrides)
    curve = columns("out/curve.csv")
    force = curve["force obstacle 1 [N]"]
    slow = curve["pressure slow [kPa]"]
    assert force[0] == 0.0 and force[-1] > 0.05
    rising = (slow > 0) & (curve["pressure fast [kPa]"] == 0)
    assert all(np.diff(force[rising]) >= -1e-9)
    assert (
        "reaches the sphere" in said
        and "mm further away" in said.replace("\n", " ")
        and Path("out/grip.png").is_file()
    )
    assert curve["min gap [mm]"].min() > -0.05


def test_finger_on_plate_presses_more_on_a_nearer_plate(small: Callable[..., str]) -> None:
    """Nothing before the touch, more with pressure after it; a held tip takes a thrust, hardly a cross force.

    Catches a force of the wrong sign, and a plate that the study does not move.
    """
    overrides = ("geometry.slow_chambers=3", "geometry.size='8 mm'", "loads.points=2")
    said = small("finger_on_plate", overrides, PLATES=(0.5, 2.0))
    force = columns("out/curve.csv")
    near, far = force["plate 0.5 mm away [N]"], force["plate 2 mm away [N]"]
    assert ",-0," not in Path("out/curve.csv").read_text(encoding="utf-8")
    assert near[0] == far[0] == 0.0 and all(np.diff(near) > 0) and all(near[1:] > far[1:])
    assert abs(force["held tip down [N]"][-1]) < 0.05 * near[-1] < force["held tip along the finger [N]"][-1]
    touched = [float(part.split()[0]) for part in said.split("touched at ")[1:]]
    assert 0.0 < touched[0] < touched[1]


def test_fast_module_bends_more_with_contact(small: Callable[..., str]) -> None:
    said = small("fast_module", SMALL_FAST, WITHOUT=["loads.contact=false"])
    on, off = (columns(f"out/{name}curve.csv") for name in ("", "contact_off/"))
    assert on["pressure [kPa]"][-1] == off["pressure [kPa]"][-1] == 3.0
    assert on["angle [deg]"][-1] > 1.05 * off["angle [deg]"][-1]
    assert 1.0 < float(said.split("first touch at ")[1].split()[0]) < 2.0
    assert "min gap [mm]" in on and "min gap [mm]" not in off


@pytest.mark.slow
def test_contact_onset(small: Callable[..., str]) -> None:
    said = small("contact_onset", SMALL_FAST, FAST=[], TRIPOD=SMALL_TRIPOD)
    assert "fast module: first touch at" in said and Path("out/onset.png").is_file()
