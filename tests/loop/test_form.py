"""A law of another form is taken for the same effect, a second effect and a foreign history are not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from loop_bench import curve, duhem, nothing, rubbing, write_case

from fem_spa.loop.certificate import certificate, limits
from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.fit import fit
from fem_spa.loop.form import Freedom, contributions, formed, freedom
from fem_spa.loop.model_file import read_source
from fem_spa.loop.noise import Noise, Whitener, fit_noise
from fem_spa.loop.placebo import as_good_elsewhere
from fem_spa.loop.prepare import prepare, train_runs
from fem_spa.loop.records import read_records
from fem_spa.loop.screen import make_atoms
from fem_spa.loop.signatures.unmarked import unmarked
from fem_spa.loop.split import split

Body = Callable[[list[np.ndarray]], list[np.ndarray]]


def fitted(folder: Path, body: Body) -> tuple[Chain, Data, Whitener]:
    """Hysteresis of the library on records of `body`, under the noise of the bench."""
    model, files = write_case(folder, body)
    case = prepare(read_source(model), split(read_records(files), [], 0))
    chain, data = case.chain, case.data
    level = chain.gain * (chain.response(data, chain.thetas, chain.base.values) - chain.rest)
    runs = train_runs(data)
    noise, _ = fit_noise(data, np.random.default_rng(0).normal(0.0, 2e-3, level.shape), level, runs)
    whiten = Whitener(data, noise, level, runs)
    effect = EFFECTS["hysteresis"]
    found = fit(chain, data, whiten, [effect], [np.array([0.1, 0.1, 0.1, 0.1, 0.0, 0.5])], 20)
    return found.chain, data, whiten


def squares(chain: Chain, data: Data, whiten: Whitener) -> float:
    return float(np.sum(whiten(data.output - chain.predict(data)) ** 2))


def sinking(shares: list[np.ndarray]) -> list[np.ndarray]:
    """Loops, and beside them a sinking through every record that begins anew, which no loop is."""
    return [y - 1.5 * np.linspace(0.0, 1.0, len(y)) for y in duhem(shares)]


def foreign(shares: list[np.ndarray]) -> list[np.ndarray]:
    """Every record shows the loops of the next one."""
    own = [y - curve(q) for q, y in zip(shares, duhem(shares), strict=True)]
    return [curve(q) + np.resize(own[(k + 1) % len(own)], len(q)) for k, q in enumerate(shares)]


def test_form_takes_what_another_law_leaves_and_not_a_second_effect(tmp_path: Path) -> None:
    chain, data, whiten = fitted(tmp_path / "own", duhem)
    plain, free = squares(chain, data, whiten), formed(freedom(chain, data), whiten)
    other = fitted(tmp_path / "two", sinking)
    both, left = squares(*other), formed(freedom(*other[:2]), other[2])
    own = (plain - free.left) / plain
    assert own > 0.1
    assert left.left - free.left > 0.2 * free.left, "the sinking is still to be explained"
    assert (both - left.left) / both < 0.6
    assert contributions(chain, data).shape == (1,) and contributions(chain, data)[0] > 0.0


def test_what_has_left_no_mark_of_its_own_is_told(tmp_path: Path) -> None:
    """A drift beside loops, fitted or not, that the records have not; the loops are there."""
    chain, data, _ = fitted(tmp_path / "own", duhem)
    drift = EFFECTS["sensor-drift"]
    both = chain.with_effects((*chain.effects, drift), (*chain.thetas, np.array([0.02, 0.0, 1.0])))
    span = float(np.ptp(data.output))
    noise = Noise(0.0015 * span, 0.002 * span, 1.5, 0.004 * span, 0.003)
    assert unmarked(both, data, noise) == ("sensor-drift",)
    assert unmarked(chain, data, noise) == (), "one alone has the other gates"


def test_the_history_of_other_records_does_as_well_where_it_is_theirs(tmp_path: Path) -> None:
    assert as_good_elsewhere(*fitted(tmp_path / "own", duhem)) == ()
    assert as_good_elsewhere(*fitted(tmp_path / "foreign", foreign)) == ("hysteresis",)


@pytest.mark.parametrize(
    ("name", "theta"), [("fatigue", [0.15, 0.0, 2.0]), ("sensor-drift", [0.1, 0.0, 1.0])]
)
def test_a_history_belongs_to_its_own_records(tmp_path: Path, name: str, theta: list[float]) -> None:
    """The same trend with the records in another order: then the order is as good as the right one."""
    chain, data, whiten = fitted(tmp_path, nothing)
    base = chain.with_effects([], [])
    worn = chain.with_effects([EFFECTS[name]], [np.array(theta)])
    own = worn.predict(data) - base.predict(data)
    parts = [run.part for run in data.runs if run.train]
    foreign = np.zeros_like(own)
    for k, part in enumerate(parts):
        source = own[parts[(k + 2) % len(parts)]]
        foreign[part] = source[np.minimum(np.arange(part.stop - part.start), len(source) - 1)]
    grain = 0.002 * np.ptp(data.output) * np.random.default_rng(3).standard_normal(data.output.shape)
    for there, failed in ((own, ()), (foreign, (name,))):
        seen = replace(data, output=base.predict(data) + there + grain)
        assert as_good_elsewhere(worn, seen, replace(whiten, data=seen)) == failed


def test_directions_that_show_nothing_are_left_alone(tmp_path: Path) -> None:
    # a case of the benchmark had one with no rows at all, which made the sums singular
    chain, data, whiten = fitted(tmp_path, duhem)
    given = freedom(chain, data)
    nothing = np.zeros((*given.columns.shape[:2], 2))
    more = Freedom(
        np.concatenate([given.columns, nothing], axis=2), np.append(given.sizes, [0.0, 1.0]), given.residual
    )
    assert formed(more, whiten).left == pytest.approx(formed(given, whiten).left, rel=1e-6)


def test_rubbing_is_one_effect(tmp_path: Path, diagnosed: Any) -> None:
    """Bristles let go one after the other, held the more the larger the load: no lag, no bend beside them."""
    model, files = write_case(tmp_path, rubbing, 2)
    report = diagnosed(model, files, tmp_path / "out")
    assert [e["name"] for e in report["effects"]] == ["friction"], report["reasons"]
    held = report["error"]["heldout"]
    assert held["after"] < 0.1 * held["before"]
    assert [item["file"] for item in report["inputs"][:2]] == ["model.toml", "curve.csv"]
    again = diagnosed(tmp_path / "out" / "model_next.toml", files, tmp_path / "again")
    assert again["verdict"] == "none", "what another law leaves of the effect it has is no effect"


def test_what_is_named_hides_its_neighbours(tmp_path: Path) -> None:
    """A limit is what would have shown beside what is named, which can take over for effects like it."""
    chain, data, whiten = fitted(tmp_path, duhem)
    base = chain.with_effects([], [])
    names = ["friction", "creep", "saturation"]
    atoms = make_atoms(base, data, [EFFECTS[n] for n in names])
    card = certificate(atoms, data, train_runs(data), names)
    alone = limits(card, atoms, whiten, 15.0, [])
    beside = limits(card, atoms, whiten, 15.0, [freedom(chain, data)])
    growth = {n: beside[n] / alone[n] for n in names}
    assert growth["friction"] > 2.0 and growth["friction"] > growth["saturation"] >= 1.0, growth
