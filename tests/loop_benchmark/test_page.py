"""The page of the blind run: a signature's words by rules, cells that count what they say, old results."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.loop.aims import aims
from benchmarks.loop.answers import miss, wrong_two
from benchmarks.loop.base import Base
from benchmarks.loop.cases import KNOWN
from benchmarks.loop.classes import SAME_FORM
from benchmarks.loop.counts import shown
from benchmarks.loop.left_out import by_chance, families, left_out
from benchmarks.loop.page import write_page
from benchmarks.loop.physics import World
from benchmarks.loop.run_kinds import COLUMNS as KIND_COLUMNS
from benchmarks.loop.score import COLUMNS
from benchmarks.loop.sensing import _coarse, _wander
from benchmarks.loop.session import Plan, time_line
from benchmarks.loop.signature import WORDS, fits, leads
from benchmarks.loop.splits import none, outside, two
from benchmarks.loop.supply import _threshold
from benchmarks.loop.tables import add_row, rows_of
from fem_spa.loop.effects.registry import EFFECTS

TURNS = "the remainder (2.9 % of span) depends on the direction of motion (a loop between rise and fall) (58 % of its variance); it is small while the command is held"  # noqa: E501
HELD = "the remainder (3 % of span) it is largest while the command is held; no number of the chain, let wander, foretells it on stretches of time left out"  # noqa: E501
STATIC = "the remainder (6 % of span) depends on the cycle or the time that has passed (40 % of its variance); is bound to the pressure itself, the same up and down (37 % of its variance)"  # noqa: E501
SLOW = "the remainder (2.9 % of span) a flexible learner predicts it best from cycles, the last 10 s; of the slots of the chain state fits best: a state of about 10 s, changed by a constant amount, foretells 97 % of it on stretches of time left out (sensor hardly less)"  # noqa: E501


def row(name: str, **given: str) -> dict[str, str]:
    """A row of results.csv that ended."""
    plain = dict.fromkeys(COLUMNS, "") | {"name": name, "status": "0", "target": "0.03", "protocol": "D"}
    return plain | {"tier": name.split("-")[0]} | given


@pytest.mark.parametrize(
    ("name", "signature", "found", "first"),
    [
        ("hysteresis", TURNS, True, True),
        ("creep", TURNS, False, False),
        ("pressure-lag", TURNS, True, False),
        ("creep", HELD, True, True),
        ("viscous-lag", HELD, False, False),
        ("friction", HELD, False, False),
        ("contact", STATIC, True, False),
        ("mullins", STATIC, True, True),
        ("hysteresis", STATIC, False, False),
        ("creep", SLOW, True, True),
        ("fatigue", SLOW, True, True),
        ("contact", SLOW, False, False),
        ("delay", SLOW, False, False),
        ("creep", "", False, False),
    ],
)
def test_a_signature_fits_by_the_physics_of_the_effect(
    name: str, signature: str, found: bool, first: bool
) -> None:
    assert fits(name, signature) is found
    assert leads(name, signature) is first


def test_the_rules_are_of_words_that_diagnose_writes() -> None:
    # another wording in diagnose would make every signature fit nothing
    room = Path(__file__).parents[2] / "fem_spa" / "loop"
    written = "".join((room / f"{n}.py").read_text() for n in ("words", "learner", "localise"))
    for phrase in (
        *("direction of motion", "where it last turned", "a state that turns", "its direction"),
        *(
            "it is largest while the command is held",
            "it is small while the command is held",
            "the last {tau",
        ),
        *("time within a record", "a state of about {tau", "a lag of the pressure of about {tau", '"rate"'),
        *("it oscillates with a period", "the cycle or the time that has passed", '"cycles"', '"time"'),
        *("largest pressure so far", '"the number of cycles"', '"the temperature"', '"the time"'),
        *("is bound to the pressure itself", "grows with the motion", '"the pressure"', "changing with "),
        *("the pressure from which it moves", "a weight", "inclination", "within a record", "best from "),
    ):
        assert phrase in written, phrase
    assert {physics.name for physics in KNOWN} <= set(WORDS)


def test_forms_that_are_alike_are_those_that_are_said_to_be() -> None:
    """The row of the aims for the same form holds what the library can write exactly."""
    line = time_line([Plan("one", np.array([(0, 0), (4.7, 0.93), (10, 0.2)]), 0.0)], 5e4, np.zeros(1))
    base = Base("power", "silicone", 1.5, 5e4, (0.5, 0.3), 1.0, 0.0)
    p = line.command[:, None]
    y = 1.5 * p / 5e4
    world = World(line, base, line.command)
    data = SimpleNamespace(clock=line.time)
    context = SimpleNamespace(p_max=5e4, scale=1.5, seconds=line.time[-1] - line.time[0], data=data)

    def library(name: str, signal: np.ndarray, *theta: float) -> np.ndarray:
        return EFFECTS[name].apply(context, signal, np.array(theta))[:, 0]  # type: ignore[arg-type]

    mine = _threshold(p[:, 0], world, 0.1, {"softness": 0.2})
    assert mine == pytest.approx(library("dead-band", p, 0.1, 0.0, 0.02, 0.0), abs=1e-6)
    mine = _wander(y[:, 0], world, 0.05, {"power": 0.7, "sign": 1.0})
    assert mine == pytest.approx(library("sensor-drift", y, 0.05, 0.0, 0.7), abs=1e-12)
    apart = _coarse(y[:, 0], world, 0.04, {"phase": 0.3}) - library("quantisation", y, 0.04, 0.04 * 0.2)
    assert np.ptp(apart) < 1e-9
    assert set(SAME_FORM) == {f.__name__.strip("_") for f in (_threshold, _wander, _coarse)}


def test_errors_are_split_by_whether_the_form_is_the_librarys() -> None:
    given = {"truth": "sensor-drift", "right": "1", "verdict": "attributed", "before": "2", "after": "1"}
    rows = [
        row("single-1", **given, forms="wander", reduction="0.95"),
        row("single-2", **given, forms="orifice", reduction="0.50"),
    ]
    kinds = [
        dict.fromkeys(KIND_COLUMNS, "") | {"kind": k, "seconds": "99", "status": "0"} for k in ("rod", "fem")
    ]
    timed = [row("single-3", seconds="18.5", peak_mb="827")]
    text = aims(rows, timed, [*kinds, kinds[0] | {"seconds": "150"}, kinds[0] | {"status": "-9"}])
    lines = {line.split(" | ")[0]: line for line in text.splitlines()}
    assert "mean 0.95 (1)" in next(v for k, v in lines.items() if "same form" in k)
    assert "mean 0.50 (1)" in next(v for k, v in lines.items() if "other form" in k)
    assert "| 99 to 150 (2, 1 not ended) |" in next(v for k, v in lines.items() if "rod" in k)
    assert "| 18 (1) |" in next(v for k, v in lines.items() if "5 000 samples" in k)


def test_splits_put_a_case_where_it_belongs() -> None:
    pair = {"tier": "pair", "truth": "creep+delay", "verdict": "attributed"}
    rows = [
        row("pair-1", **pair, protocol="A", right="1", effects="creep+delay"),
        row("pair-2", **pair, protocol="A", right="0", effects="creep"),
        row("pair-3", **pair, protocol="D+", target="0.06", right="0", effects="creep"),
    ]
    lines = two(rows).splitlines()
    assert next(v for v in lines if v.startswith("| A ")).startswith(
        "| A | 50 % (1 of 2; 1 to 99) | no case | 50 %"
    )
    assert "| no case | 0 % (0 of 1;" in next(v for v in lines if v.startswith("| D+ "))
    strange = [row("strange-1", protocol="B", verdict="unexplained")]
    assert "| B | 100 % (1 of 1;" in outside(strange)
    null = [row("null-1", protocol="C", verdict="ambiguous", effects="creep")]
    assert "| protocol C | 100 % (1 of 1; 2 to 100) | 0 % (0 of 1; 0 to 98) |" in none(null)
    assert not shown(row("single-1", trained="0.014")) and shown(row("single-1", trained="0.016"))


@pytest.mark.parametrize(
    ("truth", "effects", "protocol", "words"),
    [
        ("hysteresis+delay", "delay", "D", "one of the two"),
        ("hysteresis+delay", "friction+contact", "D", "one, and one that is not there"),
        ("hysteresis+delay", "hysteresis+contact+delay", "D", "both and a third"),
        ("hysteresis+delay", "pressure-lag+mullins", "D", "neither"),
        ("hysteresis+delay", "", "D", "none"),
        ("dead-band+creep", "friction+creep", "D+", "one, and one that is not there"),
        ("temperature+delay", "fatigue+delay", "D", "both, one by a neighbour's name"),
    ],
)
def test_two_effects_are_missed_in_one_way(truth: str, effects: str, protocol: str, words: str) -> None:
    found = row("pair-1", truth=truth, right="0", effects=effects, protocol=protocol)
    found["verdict"] = "attributed" if effects else "none"
    assert miss(found) == words
    assert f"1: {words} 1" in wrong_two([found])


def test_signatures_are_read_from_reports_of_an_older_scorer(tmp_path: Path) -> None:
    """And a results file of an older scorer keeps its columns where it is added to."""
    old = tmp_path / "run" / "without-rate-independent"
    case = old / "results" / "single-1"
    case.mkdir(parents=True)
    (case / "report.json").write_text(json.dumps({"signature": TURNS}))
    columns = [c for c in COLUMNS if c != "signature"]
    told = {"truth": "friction", "verdict": "unexplained"}
    add_row(old / "results.csv", columns, {k: v for k, v in row("single-1", **told).items() if k in columns})
    add_row(old / "results.csv", COLUMNS, row("single-2", **told, signature=HELD))
    assert [list(r) for r in rows_of(old / "results.csv")] == [columns] * 2
    new = tmp_path / "without-viscoelastic"
    new.mkdir()
    add_row(
        new / "results.csv", COLUMNS, row("single-3", truth="creep", verdict="unexplained", signature=HELD)
    )
    add_row(
        new / "results.csv", COLUMNS, row("single-4", truth="delay", verdict="unexplained", signature=HELD)
    )
    found = left_out([old, new, tmp_path])
    assert {k: [r["name"] for r in v] for k, v in found.items()} == {
        "rate-independent": ["single-1", "single-2"],
        "viscoelastic": ["single-3"],
    }
    every = [r for rows in found.values() for r in rows]
    assert by_chance(found["viscoelastic"], every) == "0 %"
    text = families(found)
    assert "| rate-independent | 100 % (2 of 2; 16 to 100) |  |  | 50 % (1 of 2; 1 to 99) | 50 %" in text
    lag = row("single-5", truth="pressure-lag", verdict="attributed", effects="viscous-lag", signature="")
    others = [lag, lag | {"effects": "viscous-lag+inertia"}, lag | {"protocol": "D+"}]
    short = families({"pneumatic": others})
    assert (
        "| pneumatic | 0 % (0 of 3; 0 to 71) | viscous-lag 1 | viscous-lag+inertia 1, viscous-lag 1 |"
        in short
    )
    assert "| creep | 3 % | unexplained, fits | it is largest while the command is held; no number" in text
    page = tmp_path / "loop.md"
    write_page([tmp_path, old, new], page)
    assert text in page.read_text()
