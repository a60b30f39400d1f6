"""Every study runs, and one physical number of each is right; on smaller bodies than the study's own."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import studies
from fem_spa.cli import main
from fem_spa.reduced.finger import finger
from studies.limit_point import sphere_pressure

Study = Callable[..., Any]


def test_every_study_is_listed_and_tested(capsys: pytest.CaptureFixture[str]) -> None:
    """A new study comes with a line of `--list` and a test here."""
    names = {path.stem for path in Path(studies.__path__[0]).glob("*.py")} - {"__init__"}
    assert main(["study", "--list"]) == 0
    assert {line.split()[0] for line in capsys.readouterr().out.splitlines()} == names
    tests = "".join(path.read_text(encoding="utf-8") for path in Path(__file__).parent.glob("test_*.py"))
    for name in names:
        named = f'"{name}"' in tests or f"from studies.{name} import" in tests
        assert named, f"studies/{name}.py is not run by a test in tests/studies"


def test_limit_point(study: Study) -> None:
    """The pressure of the ball has its peak where the closed form has it, and falls behind it."""
    run = study("limit_point", "geometry.size='5 mm'")
    assert run.status == 0
    pressure = 1e3 * np.array(run.curve["pressure [kPa]"])
    rest = 4 / 3 * math.pi * 0.010**3
    volumes = rest * np.linspace(1.0, 10.0, 2000)
    exact = max(sphere_pressure(volume, 0.010, 0.020, 0.11e6) for volume in volumes)
    assert pressure.max() == pytest.approx(exact, rel=5e-3)
    assert 0 < np.argmax(pressure) < len(pressure) - 1
    assert run.curve["volume [mm^3]"][-1] == pytest.approx(10e9 * rest, rel=5e-3)
    assert "largest error" in run.said and "See " in run.said


def test_slow_module(study: Study) -> None:
    """Angle grows with pressure; a chamber within its neighbours bends by 3.3 deg at 20 kPa."""
    angle = {}
    for chambers in (2, 3):
        run = study(
            "slow_module",
            f"geometry.slow_chambers={chambers}",
            "loads.pressure='20 kPa'",
            "loads.points=4",
            "solver.imposed_steps=1",
        )
        assert run.status == 0
        assert run.curve["pressure [kPa]"] == [0, 5, 10, 15, 20]
        assert all(np.diff(run.curve["angle [deg]"]) > 0)
        assert "slow_module: " in run.said and "Newton iterations" in run.said
        angle[chambers] = run.curve["angle [deg]"][-1]
    assert angle[3] - angle[2] == pytest.approx(3.3, abs=0.4)


@pytest.mark.slow
def test_composite_finger(study: Study) -> None:
    """Two cavities; the pressures of the egg example are a row, though not on the way to the end."""
    run = study(
        "composite_finger",
        "geometry.slow_chambers=2",
        "geometry.fast_chambers=2",
        "geometry.size='5 mm'",
        "loads.pressure={ slow = '24 kPa', fast = '16 kPa' }",
    )
    assert run.status == 0
    pairs = list(zip(run.curve["pressure slow [kPa]"], run.curve["pressure fast [kPa]"], strict=True))
    assert (20.0, 13.9) in pairs and pairs[-1] == (24.0, 16.0)
    assert run.curve["angle [deg]"][-1] > run.curve["angle [deg]"][pairs.index((20.0, 13.9))] > 15
    assert "100.4 deg" in run.said
    one, two = np.degrees(
        finger(slow_chambers=2, fast_chambers=2).module_angles(np.array([[20e3, 13.9e3]]))[0]
    )
    assert f"{one + two:.1f} ({one:.1f} + {two:.1f})" in run.said
    assert "min gap [mm]" in run.curve and "pass through" not in run.said
