"""Decks solved again: which way weight acts, what is kept, a wall's onset, gravity found in the deck."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fem_spa.cli import main
from fem_spa.deck import read_deck
from fem_spa.errors import InputError
from fem_spa.loop.base_fem import DeckModel, read_deck_model
from fem_spa.loop.decide import Decision
from fem_spa.loop.deck_forms import STRUCTURAL, Work, _lagrange, _too_long, _walled, deck_word, form_of
from fem_spa.loop.deck_solve import DeckSolve, Frame, digest
from fem_spa.loop.deck_word import _renamed
from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.fit import fit, polished
from fem_spa.loop.model_file import read_source
from fem_spa.loop.noise import Noise, Whitener
from fem_spa.loop.prepare import prepare as prepare_case
from fem_spa.loop.prepare import train_runs
from fem_spa.loop.records import read_records
from fem_spa.loop.split import split
from fem_spa.prepare import prepare
from fem_spa.reduced.curve import from_points, read_columns
from fem_spa.reduced.model import Drive

DECK = """[geometry]
shape = "pneunet"
size = "9 mm"
fast_chambers = 0
slow_chambers = 3
[materials.body]
card = "dragon-skin-30"
density = "20000 kg/m^3"
[layers.paper]
modulus = "2 GPa"
thickness = "0.1 mm"
[loads]
pressure = "50 kPa"
points = 8
"""


def deck_in(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "deck.toml").write_text(DECK)
    (folder / "model.toml").write_text('[model]\nkind = "fem"\ndeck = "deck.toml"\n')
    return folder / "deck.toml"


def kept(deck: Path, folder: Path, slope: float = 1.0, seconds: float = 0.0) -> None:
    """A solve of the deck as it is, put there by hand: 1 deg a kPa times `slope`."""
    mark = digest(read_deck(deck))
    place = folder / "solves" / f"as-it-is-{mark[:8]}"
    place.mkdir(parents=True)
    (place / "solved.json").write_text(json.dumps({"digest": mark, "seconds": seconds}))
    rows = "\n".join(f"{p},{slope * p},{30 + 0.1 * p},0,{-0.2 * p}" for p in range(0, 60, 10))
    (place / "curve.csv").write_text(f"pressure [kPa],angle [deg],tip x [mm],tip y [mm],tip z [mm]\n{rows}\n")


def test_weight_pulls_a_level_actuator_back_down() -> None:
    # contract: hanging, weight is along the axis; at 90 deg an actuator that bends rises
    frame = Frame(np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0]), np.zeros(3), 0.0)
    assert frame.down(0.0) == pytest.approx([1.0, 0.0, 0.0])
    assert frame.down(np.pi / 2) == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    assert frame.down(np.pi) == pytest.approx([-1.0, 0.0, 0.0], abs=1e-12)


def test_what_was_solved_is_not_solved_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    deck = deck_in(tmp_path)
    kept(deck, tmp_path / "out", 2.0)
    monkeypatch.setattr("fem_spa.run.run_deck", lambda *a, **k: pytest.fail("solved again"))
    model = read_deck_model({"kind": "fem", "deck": "deck.toml", "gain": 0.5}, tmp_path, tmp_path / "out")
    told = model.simulate(Drive(np.arange(2.0), np.array([[0.0], [20e3]])))
    assert np.degrees(told[:, 0]) == pytest.approx([0.0, 20.0])


def test_solves_that_take_too_long_are_left_to_the_user(tmp_path: Path) -> None:
    # at 100 s a solve and three orientations, gravity would take 15 minutes, a wall in the way 5
    deck = deck_in(tmp_path)
    kept(deck, tmp_path / "out", seconds=100.0)
    data = SimpleNamespace(orientation=np.repeat([0.0, 1.0, 2.0], 5))
    for until, late in (
        (None, []),
        (600.0, ["gravity", "payload", "base-compliance"]),
        (10.0, list(STRUCTURAL)),
    ):
        source = read_source(tmp_path / "model.toml", tmp_path / "out")
        end = None if until is None else time.perf_counter() + until
        work = Work(source, data, data, data, until=end)  # type: ignore[arg-type]
        assert [n for n in STRUCTURAL if _too_long(work, n)] == late
    assert "15 min" in str(_too_long(work, "gravity"))
    assert _too_long(work, "creep") is None


def test_a_base_turns_under_weight_only(tmp_path: Path) -> None:
    """Without weight the report says why; with it the first turn tried is the block's."""
    deck = deck_in(tmp_path)
    kept(deck, tmp_path / "out")
    free = read_deck_model({"kind": "fem", "deck": "deck.toml"}, tmp_path, tmp_path / "out")
    data = SimpleNamespace(payload=np.zeros(3))
    chain = SimpleNamespace(scale=np.array([2.0]), gain=1.0, base=SimpleNamespace(names=("angle",)))
    given: Any = (np.array([0.1]), free, data, chain)
    assert "no moment" in str(form_of("base-compliance", *given))
    form = form_of("base-compliance", given[0], free.changed(gravity=1.0), *given[2:])
    assert not isinstance(form, str) and form.first == pytest.approx(0.2)
    mesh = prepare(free.solve.deck).problem.mesh
    X = mesh.points[mesh.tets[:, :4]]
    volume = np.abs(np.linalg.det(X[:, 1:] - X[:, :1])) / 6
    base = mesh.points[np.unique(mesh.surfaces["base"])].mean(axis=0)
    far = volume @ (X.mean(axis=1) - base)
    moment = 2 * 20000 * 9.81 * float(np.hypot(far[0], far[2]))
    assert form.show(0.2) == pytest.approx(np.degrees(0.2 / moment), rel=0.1)
    solve = form.model(0.2).solve
    assert solve.deck.supports.base_compliance.si == pytest.approx(np.radians(form.show(0.2)), rel=1e-4)
    turning: Any = (given[0], free.changed(gravity=1.0, solve=solve), *given[2:])
    assert "already" in str(form_of("base-compliance", *turning))


def test_another_deck_is_another_solve(tmp_path: Path) -> None:
    # a kept curve of the deck before its material was changed would be taken for its own
    deck = deck_in(tmp_path)
    before = digest(read_deck(deck))
    (tmp_path / "mine.toml").write_text(Path("materials/cards/dragon-skin-30.toml").read_text())
    deck.write_text(DECK.replace('"dragon-skin-30"', '"mine.toml"'))
    own = digest(read_deck(deck))
    (tmp_path / "mine.toml").write_text(Path("materials/cards/dragon-skin-10.toml").read_text())
    assert len({before, own, digest(read_deck(deck))}) == 3


def test_wrong_keys_are_one_line(tmp_path: Path) -> None:
    deck = deck_in(tmp_path)
    kept(deck, tmp_path)
    for table, word in (
        ({"gravitation": 1.0}, "gravity"),
        ({"forms": "all"}, "set"),
        ({"payload": 3}, "payload"),
    ):
        with pytest.raises(InputError, match=word):
            read_deck_model({"kind": "fem", "deck": "deck.toml", **table}, tmp_path)


def test_a_wall_at_another_distance_is_met_later() -> None:
    # blended row by row, two curves with kinks give a curve with two kinks
    def walled(gap: float) -> Callable[[np.ndarray], np.ndarray]:
        return lambda p: np.where(p < gap, 2 * p, 2 * gap + 0.3 * (p - gap))

    p = np.linspace(0.0, 10.0, 201)
    free, solved = (from_points(p, f(p), "angle") for f in (walled(99.0), walled(4.0)))
    answer = _walled(free, solved, 4.0, 6.0, (p, p))
    assert answer(p[:, None]) == pytest.approx(walled(6.0)(p), abs=1e-6)


def test_a_parabola_goes_through_its_nodes() -> None:
    nodes = [0.0, 1.0, 0.4]
    for x in (0.2, 1.3):
        assert np.dot(_lagrange(nodes, x), [3 - v + 2 * v**2 for v in nodes]) == pytest.approx(
            3 - x + 2 * x**2
        )


def test_obstacle_and_walls_are_decks_of_their_own(tmp_path: Path) -> None:
    deck = deck_in(tmp_path)
    solve = DeckSolve(deck, read_deck(deck), (), tmp_path / "out" / "solves")
    wall = solve.with_plane(np.array([0.03, 0.0, -0.01]), np.array([0.0, 0.0, 1.0]), "wall 5 mm away")
    assert wall.path.is_file() and len(wall.deck.loads.obstacles or []) == 1
    thick = solve.with_walls(1.1)
    meshes = [prepare(d.deck).problem.mesh for d in (solve, thick)]
    inside = [float(np.ptp(m.points[m.surfaces["cavity slow"].ravel()], axis=0)[2]) for m in meshes]
    assert inside[1] < 0.995 * inside[0]  # air gives way, the outside stays
    assert np.ptp(meshes[0].points, axis=0) == pytest.approx(np.ptp(meshes[1].points, axis=0), rel=1e-6)


@pytest.fixture(scope="module")
def heavy(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Path], Path, dict[str, Any]]:
    """Records of the deck under its weight in two orientations; the model has none."""
    folder = tmp_path_factory.mktemp("heavy")
    deck = deck_in(folder)
    truth = read_deck_model({"kind": "fem", "deck": "deck.toml", "gravity": 1.0}, folder, folder / "truth")
    rng = np.random.default_rng(5)
    files = []
    for k in range(6):
        t = np.arange(0.0, 24.0, 0.1)
        period, top = (12.0, 45e3) if k < 2 else (4.0, 30e3) if k < 4 else (8.0, 45e3)
        p = top * (1 - np.abs(1 - 2 * (t / period % 1)))
        turned = np.pi / 2 * (k % 2)
        y = np.degrees(truth.simulate(Drive(t, p[:, None], turned))[:, 0])
        y = 0.95 * y + 0.4 + rng.normal(0, 0.05, len(t)) + rng.normal(0, 0.04)
        head = f"# orientation: {np.degrees(turned):g} deg\n# history: cycled\n# session: 1\n"
        rows = "\n".join(f"{a:.6g},{b / 1e3:.6g},{c:.6g}" for a, b, c in zip(t, p, y, strict=True))
        files.append(folder / f"r{k}.csv")
        files[-1].write_text(f"{head}time [s],pressure [kPa],angle [deg]\n{rows}\n")
    out = folder / "out"
    assert (
        main(["diagnose", str(folder / "model.toml"), *map(str, files), "--out", str(out), "--no-page"]) == 0
    )
    return deck, files, out, json.loads((out / "report.json").read_text())


@pytest.mark.slow
def test_gravity_is_found_in_the_deck(heavy: tuple[Path, list[Path], Path, dict[str, Any]]) -> None:
    """The weight itself, not a share of a stand-in; clearly less error than the block leaves."""
    report = heavy[3]
    assert report["effects"][0]["name"] == "gravity"
    (row,) = [s for s in report["solved_again"] if s["name"] == "gravity"]
    assert row["used"] and row["deck"]["heldout"] < 0.7 * row["block"]["heldout"]
    weight = report["effects"][0]["parameters"]["weight"]
    assert 0.9 < weight["low"] < weight["value"] < weight["high"] < 1.1
    assert report["error"]["heldout"]["after"] == pytest.approx(row["deck"]["heldout"], rel=1e-3)


@pytest.mark.slow
def test_the_heavy_deck_is_read_back(
    heavy: tuple[Path, list[Path], Path, dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, files, out, _ = heavy
    monkeypatch.setattr("fem_spa.run.run_deck", lambda *a, **k: pytest.fail("solved again"))
    source = read_source(out / "model_next.toml")
    assert isinstance(source.model, DeckModel) and source.model.gravity > 0.9
    assert main(["simulate", str(out / "model_next.toml"), *map(str, files), "--out", str(tmp_path)]) == 0
    for file in files:
        mine, after = (
            np.genfromtxt(folder / "predictions" / file.name, delimiter=",", skip_header=1)
            for folder in (tmp_path, out)
        )
        assert mine[:, 1] == pytest.approx(after[:, 2], abs=1e-4)
    words = ["diagnose", str(out / "model_next.toml"), *map(str, files), "--out", str(tmp_path / "again")]
    assert main([*words, "--no-page"]) == 0
    assert json.loads((tmp_path / "again" / "report.json").read_text())["verdict"] == "none"


@pytest.mark.slow
def test_the_kept_curve_is_that_of_solve(heavy: tuple[Path, list[Path], Path, dict[str, Any]]) -> None:
    """A deck with gravity from a folder of solves gives the same curve by `solve`: it is a whole deck."""
    (folder,) = [p for p in (heavy[2] / "solves").iterdir() if p.name.startswith("gravity-1-at-90")]
    assert main(["solve", str(folder / "deck.toml"), "--out", str(folder / "again")]) == 0
    own, again = (read_columns(place / "curve.csv")[1] for place in (folder, folder / "again"))
    assert own[-1, 2] == pytest.approx(again[-1, 2], rel=1e-6)


@pytest.mark.slow
def test_a_compliant_base_is_fitted_in_the_deck(tmp_path: Path) -> None:
    """Records of a heavy deck on a base of 250 deg/(N*m), hanging and level; the model's base is fast."""
    deck_in(tmp_path)
    (tmp_path / "soft.toml").write_text(DECK + '[supports]\nbase_compliance = "250 deg/(N*m)"\n')
    (tmp_path / "model.toml").write_text('[model]\nkind = "fem"\ndeck = "deck.toml"\ngravity = 1.0\n')
    truth = read_deck_model({"kind": "fem", "deck": "soft.toml", "gravity": 1.0}, tmp_path, tmp_path / "t")
    rng, files = np.random.default_rng(5), []
    for k, top in enumerate((45e3, 45e3, 30e3, 30e3)):
        turned = np.pi / 2 * (k % 2)  # in one orientation gain and offset do as well
        t = np.arange(0.0, 16.0, 0.1)
        p = top * (1 - np.abs(1 - 2 * (t / 8 % 1)))
        y = np.degrees(truth.simulate(Drive(t, p[:, None], turned))[:, 0]) + rng.normal(0, 0.05, len(t))
        rows = "\n".join(f"{a:.6g},{b / 1e3:.6g},{c:.6g}" for a, b, c in zip(t, p, y, strict=True))
        files.append(tmp_path / f"r{k}.csv")
        head = f"# orientation: {np.degrees(turned):g} deg\ntime [s],pressure [kPa],angle [deg]\n"
        files[-1].write_text(f"{head}{rows}\n")
    source = read_source(tmp_path / "model.toml", tmp_path / "out")
    case = prepare_case(source, split(read_records(files), [], 1))
    data, effect = case.data, EFFECTS["base-compliance"]
    plain = case.chain.response(data, (), case.chain.base.values)
    noise = Noise(np.radians(0.05), 0.0, 1.0, np.radians(0.02), 0.0)
    whiten = Whitener(data, noise, case.chain.gain * (plain - case.chain.rest), train_runs(data))
    chain = case.chain.with_effects((effect,), (np.array([0.05]),))
    block = fit(chain, data, whiten, chain.effects, chain.thetas).chain
    _, found, told = deck_word(Work(source, data, case.full, whiten), polished(block, data), effect.name)
    assert told.used and told.parameter is not None and told.deck is not None and told.block is not None
    assert told.parameter["value"] == pytest.approx(250, rel=0.08)
    assert told.deck[1] < 0.5 * told.block[1]
    assert found.deck is not None and found.deck.solve.deck.supports.base_compliance is not None


def test_a_rival_that_takes_the_place_of_a_name_leaves_it_as_its_rival() -> None:
    # the other names and their rivals stay; what is no classmate makes the verdict ambiguous
    nothing: Any = None
    given = Decision(
        "attributed",
        ("creep", "payload"),
        {"payload": ["gravity"], "creep": []},
        [],
        0.7,
        0.3,
        True,
        *[nothing] * 3,
        (),
    )
    found = _renamed(given, "payload", "gravity", ["payload"], False)
    assert found.chosen == ("creep", "gravity") and found.rivals == {"creep": [], "gravity": ["payload"]}
    assert found.verdict == "attributed"
    assert _renamed(given, "payload", "gravity", ["payload"], True).verdict == "ambiguous"
    assert _renamed(given, "payload", "payload", ["contact"], False).verdict == "ambiguous"
