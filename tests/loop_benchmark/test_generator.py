"""The generator of blind records: its physics against closed forms, its promises on sizes and seeds."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.loop.base import Base
from benchmarks.loop.body import LINKS, _heavy
from benchmarks.loop.cases import KNOWN, STRANGE, TIERS, Effect, draw_case, refit_columns, response, visible
from benchmarks.loop.classes import FAMILY, same_class
from benchmarks.loop.files import write_case
from benchmarks.loop.kinds_page import TITLE, kinds_section, put
from benchmarks.loop.physics import Physics, World
from benchmarks.loop.rubber import _power_creep, _relays, _swing
from benchmarks.loop.run_kinds import COLUMNS
from benchmarks.loop.session import Line, Plan, time_line, triangle

TOP = 5e4
BASE = Base("power", "silicone", 1.5, TOP, (0.5, 0.3), 1.0, 0.0)


def line_of(*knots: tuple[float, float]) -> Line:
    return time_line([Plan("one", np.array(knots), 0.0)], TOP, np.zeros(1))


def test_it_shares_nothing_with_the_library() -> None:
    """An import of the library under test would make the score worthless.

    Cases run through the engine; other base kinds take their base, which the program is given too, from the
    reduced models and the solver.
    """
    allowed = ("fem_spa.engine", "fem_spa.reduced", "fem_spa.run")
    for path in (Path(__file__).parents[2] / "benchmarks" / "loop").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [str(node.module)] if isinstance(node, ast.ImportFrom) else []
            if path.name in ("run.py", "kinds.py", "run_kinds.py"):
                names = [name for name in names if not name.startswith(allowed)]
            assert not any(name.startswith("fem_spa") for name in names), path


@pytest.mark.parametrize("physics", [*KNOWN, *STRANGE], ids=lambda p: f"{p.name}-{p.act.__name__.strip('_')}")
def test_small_effects_vanish(physics: Physics) -> None:
    """What is left of an effect goes to nought with its size: else it would hide a second one."""
    case = draw_case("null", 3, 7)
    case = replace(case, base=replace(BASE, top=case.base.top))
    line = replace(case.line, payload=np.full(len(case.line.time), 0.02))
    shape = physics.draw(np.random.default_rng(1))
    columns = refit_columns(case.base, line)
    seen = [
        visible(response(case.base, line, [Effect(physics, size, shape)])[1], case.base, line, columns)
        for size in (2e-3, 2e-2)
    ]
    assert seen[0] < 4e-3
    assert seen[0] <= seen[1]


def test_creep_of_a_step_is_the_power_law() -> None:
    line = line_of((0, 0), (1, 0), (1.001, 1), (61, 1))
    y = line.command / TOP
    crept = _power_creep(y, World(line, BASE, line.command), 0.1, {"alpha": 0.3}) - y
    late = line.time - 1.0
    rows = late > 5
    assert crept[rows] == pytest.approx(0.1 * (late[rows] / 60) ** 0.3, rel=0.01)


def test_relays_forget_what_a_larger_sweep_wipes_out() -> None:
    """Preisach: a minor loop closes, and the path after it is that without the loop."""
    shape = {"centre": 1.0, "width": 0.15}
    plain = line_of((0, 0), (10, 1))
    looped = line_of((0, 0), (6, 0.6), (8, 0.3), (10, 0.6), (14, 1))
    ends = [
        _relays(line.command, World(line, BASE, line.command), 0.2, shape)[
            np.searchsorted(line.command[-300:], 0.9 * TOP) - 300
        ]
        for line in (plain, looped)
    ]
    assert ends[0] == pytest.approx(ends[1], rel=5e-3)


def test_swing_rings_at_its_period() -> None:
    line = line_of((0, 0), (1, 0), (1.001, 0.1), (6, 0.1))
    y = line.command / TOP
    rung = _swing(y, World(line, BASE, line.command), 0.5, {"zeta": 0.05, "square": 0.0})
    after = rung[line.time > 1.05] - 0.1
    crossings = np.nonzero(np.diff(np.sign(after)) > 0)[0]
    assert np.diff(crossings).mean() * 0.01 == pytest.approx(0.5, rel=0.03)


def test_heavy_chain_is_the_cantilever() -> None:
    """Held level and stiff: tip slope is w / 6 under the own weight, P / 2 under a tip load (EI / L = 1).

    The chain has its first joint at the clamp, so it is softer by terms of 1 / links.
    """
    line = replace(line_of((0, 0), (1, 0)), orientation=np.full(101, np.pi / 2))
    still = np.zeros(len(line.time))
    world = World(line, BASE, line.command)
    assert _heavy(still, world, 1e-3, still)[0] == pytest.approx(-1e-3 / 6, rel=2 / LINKS)
    assert _heavy(still, world, 0.0, still + 1e-3)[0] == pytest.approx(-1e-3 / 2, rel=2 / LINKS)


@pytest.mark.parametrize("tier", TIERS)
def test_seeds_repeat_and_sizes_are_kept(tier: str, tmp_path: Path) -> None:
    case, again = draw_case(tier, 4, 11), draw_case(tier, 4, 11)
    first, second = (write_case(c, tmp_path / name / "case") for c, name in ((case, "a"), (again, "b")))
    assert first == second
    for file in first["records"]:
        assert (tmp_path / "a/case" / file).read_bytes() == (tmp_path / "b/case" / file).read_bytes()
    for effect in first["effects"]:
        assert 0.7 * case.target <= effect["visible"] <= 1.6 * case.target
    assert not list((tmp_path / "a/case").glob("*truth*"))


def test_noise_of_the_truth_is_what_the_oracle_says(tmp_path: Path) -> None:
    """The best possible error holds noise only: between the sample noise and all parts together."""
    case = draw_case("null", 3, 5)
    truth = write_case(case, tmp_path / "case")
    n = sum(part["n"] for part in truth["oracle"].values())
    error = np.sqrt(sum(part["square"] for part in truth["oracle"].values()) / n) / truth["span"]
    parts = case.noise
    most = 3 * np.hypot(np.hypot(parts.offset, parts.gain), np.hypot(parts.white, parts.coloured))
    assert parts.white < error < most


def test_triangles_reach_their_ends() -> None:
    knots = triangle(8.0, 3)
    assert knots[:, 1].max() == 1.0
    assert np.all(np.diff(knots[:, 0]) > 0)


def test_classes_are_those_of_the_contract() -> None:
    assert same_class("viscous-lag") == {"viscous-lag", "pressure-lag", "sensor-lag"}
    assert same_class("dead-band") == {"dead-band", "hysteresis", "friction"}
    assert same_class("pressure-lag", measured_pressure=True) == {"pressure-lag"}
    assert same_class("viscous-lag", measured_pressure=True) == {"viscous-lag", "sensor-lag"}
    for name in FAMILY:
        assert all(name in same_class(other) for other in same_class(name))


def test_the_section_of_other_kinds_takes_its_own_place(tmp_path: Path) -> None:
    # appended anew each time, or written over what follows it
    page = tmp_path / "loop.md"
    page.write_text("# Title\n\n## Time\n\nseconds\n\n## Measured data: studies\n\nlast\n")
    row = dict.fromkeys(COLUMNS, "") | {
        "name": "fem-3-creep",
        "kind": "fem",
        "effect": "creep",
        "status": "0",
    }
    row |= {"visible": "0.03", "verdict": "attributed", "effects": "creep", "right": "1", "holds": "1"}
    for reduction in ("0.5", "0.75"):
        nothing = row | {"name": "fem-4-payload", "visible": "0.0000", "effects": ""}
        put(page, kinds_section([row | {"reduction": reduction}, nothing]))
    text = page.read_text()
    assert text.index("## Time") < text.index(TITLE) < text.index("## Measured data") < text.index("last")
    assert text.count(TITLE) == 1 and "0.75" in text and "0.5 " not in text
    assert "| fem | 2 | 2 | 1 of 1 | 1 of 1 | 1 of 1 | 0 |" in text
