"""Signature statistics: an effect drives its own mark, noise drives none, and the marks tell what loop.md's
table of signatures says they tell."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from loop_bench import nothing, rich, triangle, write_case
from scipy.signal import lfilter

from fem_spa.loop.base import Base
from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.model_file import read_source
from fem_spa.loop.noise import Noise
from fem_spa.loop.prepare import before, prepare
from fem_spa.loop.records import read_records
from fem_spa.loop.signatures import curves, history, loops, rests
from fem_spa.loop.signatures.measure import Gauge, Measured, covariance, gauge, seen
from fem_spa.loop.signatures.statistic import Statistic
from fem_spa.loop.signatures.told import cells, without
from fem_spa.loop.split import split

MARKED = [name for name, effect in EFFECTS.items() if effect.signature is not None]
TYPICAL = {
    "saturation": [0.15, 0.02],
    "dead-band": [0.08, 0.0, 0.01, 0.0],
    "delay": [0.1],
    "pressure-lag": [0.15, 1.5, 0.0],
    "leak": [0.005],
    "chamber-gain": [0.1, 0.0, 0.0, 0.0, 0.0, 0.0],
    "cross-coupling": [0.05, 0.0],
    "wall-thickness": [0.1, 0.0],
    "stiffening": [0.1, 2.0],
    "mullins": [0.08, 0.0, 0.3, 0.3, 0.0, 0.0],
    "fatigue": [0.05, 0.0, 1.0],
    "temperature": [0.1, 0.0, 300.0],
    "delamination": [0.1, 0.0, 0.55],
    "creep": [0.02, 0.03, 0.03, 0.02],
    "hysteresis": [0.0, 0.2, 0.1, 0.0, 0.5, 0.5],
    "viscous-lag": [0.15, 0.0],
    "inertia": [0.6, 0.3],
    "snap-through": [0.1, 0.5, 0.08, 0.02, 0.1],
    "gravity": [0.08],
    "payload": [0.15],
    "contact": [0.3, 0.0, 0.5, 0.02],
    "friction": [0.02, 0.02, 0.7, 0.5],
    "base-compliance": [0.05],
    "sensor-nonlinearity": [0.05, 0.0, 0.0, 0.0],
    "sensor-lag": [0.15, 0.0],
    "sensor-drift": [0.03, 0.0, 1.0],
    "quantisation": [0.02, 0.0],
}
WAY = {"contact": -1, "delamination": -1, "fatigue": 1, "temperature": 1, "sensor-drift": 1}
"""Signs where the effect itself may go either way, for the thetas above."""


class Bench:
    """A refitted base over records, noise of known size, marks of whatever is put into the outputs."""

    def __init__(self, chain: Chain, data: Data) -> None:
        self.chain, self.data = chain, data
        plain = chain.response(data, (), chain.base.values)
        self.level = chain.gain * (plain - chain.rest)
        top = float(np.abs(self.level).max())
        self.noise = Noise(0.0015 * top, 0.002 * top, 1.5, 0.003 * top, 0.003)

    def grain(self, seed: int) -> np.ndarray:
        """(n, d) noise, drawn from its definition."""
        rng, noise, out = np.random.default_rng(seed), self.noise, np.zeros_like(self.level)
        for run in self.data.runs:
            n, d = out[run.part].shape
            a = np.exp(-run.step / noise.tau)
            steps = rng.standard_normal((n, d)) * np.sqrt(1.0 - a * a)
            steps[0] /= np.sqrt(1.0 - a * a)
            out[run.part] = noise.coloured * lfilter([1.0], [1.0, -a], steps, axis=0)
            out[run.part] += noise.white * rng.standard_normal((n, d))
            out[run.part] += noise.offset * rng.standard_normal(d)
            out[run.part] += noise.gain * rng.standard_normal() * self.level[run.part]
        return out

    def put(self, name: str, theta: list[float], seed: int = 1) -> tuple[Chain, Data, np.ndarray]:
        """The base refitted to outputs with an effect in them; those outputs; what the right model leaves."""
        with_it = self.chain.with_effects([EFFECTS[name]], [np.array(theta)])
        grain = self.grain(seed)
        data = replace(self.data, output=with_it.predict(self.data) + grain)
        return before(self.chain.base, data), data, grain

    def marks(self, name: str, theta: list[float], *statistics: Statistic) -> list[Measured]:
        """Of each statistic: before and after."""
        chain, data, grain = self.put(name, theta)
        sensed = chain.response(data, (), chain.base.values)
        found = []
        for statistic in statistics:
            made = gauge(statistic, seen(chain, data, np.array([0.02, 0.0]), sensed), self.noise)
            assert isinstance(made, Gauge), made
            found.append(made.read(data.output - chain.predict(data), grain))
        return found


def of(*names: str) -> list[Statistic]:
    return [cast(Statistic, EFFECTS[name].signature) for name in names]


def records(folder: Path, shares: list[np.ndarray]) -> Bench:
    """Drives over a curve, all of them fitted."""
    model, files = write_case(folder, nothing, shares=shares)
    case = prepare(read_source(model), split(read_records(files), [], 0))
    runs = tuple(replace(run, train=True, gap=60.0) for run in case.data.runs)
    data = replace(case.data, runs=runs, p_max=float(case.data.pressure.max()))
    return Bench(before(case.chain.base, data), data)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Rates over a decade, holds, two orientations, two payloads, temperatures that come and go."""
    made = records(tmp_path_factory.mktemp("signatures"), rich())
    n = len(made.data.clock)
    turned, heavy, warm = np.zeros(n), np.zeros(n), np.zeros(n)
    for i, run in enumerate(made.data.runs):
        turned[run.part] = np.pi if i % 3 == 1 else 0.0
        heavy[run.part] = 0.02 * (i % 2)
        warm[run.part] = 293.0 + 3.0 * np.sin(1.0 + 2.0 * i) + np.linspace(0.0, 2.0, len(warm[run.part]))
    data = replace(
        made.data, orientation=turned, oriented=True, payload=heavy, weighed=True, temperature=warm
    )
    return Bench(before(made.chain.base, data), data)


@pytest.fixture(scope="module")
def chambers(bench: Bench) -> Bench:
    """Two outputs of two chambers, that bend against one another; the second is driven late."""
    pressure = np.stack([bench.data.pressure[:, 0], np.roll(bench.data.pressure[:, 0], 40)], axis=1)

    def respond(_: Data, p: np.ndarray, __: np.ndarray) -> np.ndarray:
        q = p / 5e4
        bent = q + 0.4 * q * q
        return np.stack([bent[:, 0] - 0.6 * bent[:, 1], bent[:, 1] + 0.2 * q[:, 0]], axis=1)

    none = np.zeros(0)
    base = Base(cast(Any, None), ("x", "y"), ("m", "m"), True, (), none, none, none, respond)
    plain = respond(bench.data, pressure, none)
    data = replace(bench.data, pressure=pressure, output=plain)
    return Bench(before(base, data), data)


def home(name: str, request: pytest.FixtureRequest) -> Bench:
    many = name in ("chamber-gain", "cross-coupling")
    return cast(Bench, request.getfixturevalue("chambers" if many else "bench"))


@pytest.mark.parametrize("name", MARKED)
def test_an_effect_drives_its_own_mark(name: str, request: pytest.FixtureRequest) -> None:
    """A pattern with the wrong sign, or one that the base's refit takes, would be no mark."""
    (mark,) = home(name, request).marks(name, TYPICAL[name], *of(name))
    sign = of(name)[0].sign or WAY.get(name, 0) or np.sign(mark.values[0])
    assert sign * mark.deviations[0] > 4.5, mark
    assert abs(mark.deviations[1]) < 3.5, mark


@pytest.mark.parametrize("name", MARKED)
def test_noise_alone_drives_no_mark(name: str, request: pytest.FixtureRequest) -> None:
    """Unit variance, no tails: white, coloured, and what differs from record to record, each counted once."""
    here = home(name, request)
    what = seen(here.chain, here.data, np.array([0.02, 0.0]), here.level / here.chain.gain)
    made = gauge(of(name)[0], what, here.noise)
    assert isinstance(made, Gauge)
    z = np.array([made.read(here.grain(seed)).deviations[0] for seed in range(100, 260)])
    assert 0.8 < np.std(z) < 1.2 and abs(np.mean(z)) < 0.3
    assert np.mean(np.abs(z) > 3.0) < 0.02


def test_every_effect_that_may_be_named_has_a_mark() -> None:
    assert set(EFFECTS) - set(MARKED) == {"sensor-offset", "sensor-gain"}
    assert all(of(name)[0].sign in (-1, 0, 1) and of(name)[0].words for name in MARKED)


def test_the_variance_is_that_of_the_whole_covariance_matrix(chambers: Bench) -> None:
    """White, AR(1), an offset an output, a gain for all outputs, record by record, against a dense sum."""
    data, noise, level = chambers.data, chambers.noise, chambers.level
    weights = np.random.default_rng(2).standard_normal((len(level), 2, 3))
    expected = np.zeros((3, 3))
    for run in data.runs:
        w, n = weights[run.part], run.part.stop - run.part.start
        lags = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) * run.step
        inside = noise.white**2 * np.eye(n) + noise.coloured**2 * np.exp(-lags / noise.tau) + noise.offset**2
        both = np.kron(inside, np.eye(2)) + noise.gain**2 * np.outer(level[run.part], level[run.part])
        expected += w.reshape(-1, 3).T @ both @ w.reshape(-1, 3)
    assert covariance(weights, seen(chambers.chain, data), noise) == pytest.approx(expected, rel=1e-9)


def test_what_the_refit_takes_moves_no_mark(bench: Bench) -> None:
    """Else a better gain or offset alone would seem to take an effect away."""
    what = seen(bench.chain, bench.data, np.array([0.02, 0.0]), bench.level)
    taken = 0.07 * what.response + 0.05
    for name in MARKED:
        made = gauge(of(name)[0], what, bench.noise) if EFFECTS[name].slot != "actuation" else ""
        if isinstance(made, Gauge):
            assert np.allclose(made.read(bench.grain(1)).values, made.read(bench.grain(1) + taken).values)


def test_a_gap_stays_when_driven_slower_and_a_lag_goes(tmp_path: Path) -> None:
    """loop.md: area 0.90 to 0.94 kept 16 times slower with hysteresis, 0.07 with a lag."""
    fast = records(tmp_path / "fast", [triangle(4.0, 1.0, 6)] * 3)
    slow = records(tmp_path / "slow", [triangle(60.0, 1.0, 2)] * 3)
    kept = {}
    for name in ("hysteresis", "viscous-lag"):
        gaps = [one.marks(name, TYPICAL[name], loops.GAP)[0].values[0] for one in (fast, slow)]
        kept[name] = gaps[1] / gaps[0]
    assert kept["hysteresis"] == pytest.approx(1.0, abs=0.12)
    assert kept["viscous-lag"] == pytest.approx(4.0 / 60.0, abs=0.05)


def test_gap_and_lateness_are_told_apart_by_rates(bench: Bench) -> None:
    gap, late = bench.marks("viscous-lag", TYPICAL["viscous-lag"], loops.GAP, loops.BEHIND)
    assert abs(gap.deviations[0]) < 0.1 * late.deviations[0]
    assert late.values[0] == pytest.approx(0.15, rel=0.25)
    gap, late = bench.marks("hysteresis", TYPICAL["hysteresis"], loops.GAP, loops.BEHIND)
    assert abs(late.deviations[0]) < 0.25 * gap.deviations[0]


def test_a_delay_is_read_off_in_seconds(bench: Bench) -> None:
    (later,) = bench.marks("delay", [0.15], loops.LATER)
    assert later.values[0] == pytest.approx(0.15, rel=0.1)


def test_creep_goes_on_and_a_leak_goes_back(bench: Bench) -> None:
    """After a step up they differ in sign; after a step down to a pressure that is left, they agree."""
    onward, droop = bench.marks("creep", TYPICAL["creep"], rests.ONWARD, rests.DROOP)
    assert onward.deviations[0] > 10.0 and droop.deviations[0] < 0.0
    onward, droop = bench.marks("leak", TYPICAL["leak"], rests.ONWARD, rests.DROOP)
    assert onward.deviations[0] < 0.0 and droop.deviations[0] > 10.0


def test_a_hinge_is_found_where_it_is_and_is_no_smooth_bend(bench: Bench) -> None:
    (hinge,) = bench.marks("contact", [0.3, 0.0, 0.65, 0.02], curves.HINGE)
    assert hinge.at in ("at 55 % of the motion", "at 65 % of the motion")
    hinge, bend = bench.marks("sensor-nonlinearity", [0.0, 0.2, 0.0, 0.0], curves.HINGE, curves.BEND)
    assert abs(hinge.deviations[0]) < 3.0 and bend.deviations[0] > 30.0


def test_a_step_is_no_trend(bench: Bench) -> None:
    loss = [0.0, 0.06, 1.0]
    trend, step = bench.marks("fatigue", loss, history.CYCLES, history.STEP)
    assert trend.deviations[0] < -5.0 and abs(step.deviations[0]) < 2.5
    (step,) = bench.marks("delamination", [0.15, 0.0, 0.55], history.STEP)
    clock = bench.data.clock - bench.data.clock[0]
    told = float(step.at.split()[1])
    assert np.sum((clock > min(told, 0.55 * clock[-1])) & (clock < max(told, 0.55 * clock[-1]))) < 200


def test_softening_below_the_largest_load_is_no_loop_and_no_trend(bench: Bench) -> None:
    own = bench.marks("mullins", TYPICAL["mullins"], history.BELOW)[0].deviations[0]
    for name in ("hysteresis", "fatigue", "stiffening"):
        (other,) = bench.marks(name, TYPICAL[name], history.BELOW)
        assert abs(other.deviations[0]) < 0.4 * own, name


def test_weight_turns_with_the_mounting_and_a_bend_does_not(bench: Bench) -> None:
    own, mass = bench.marks("gravity", TYPICAL["gravity"], *of("gravity", "payload"))
    assert own.deviations[0] > 5.0 and abs(mass.deviations[0]) < 3.0
    (bent,) = bench.marks("stiffening", TYPICAL["stiffening"], *of("gravity"))
    assert abs(bent.deviations[0]) < 3.0


@pytest.mark.parametrize("pair", [("inertia", "pressure-lag"), ("creep", "fatigue"), ("mullins", "creep")])
def test_of_two_effects_each_has_its_own_mark(bench: Bench, pair: tuple[str, str]) -> None:
    """A valve's lag hides the swings of a mass, unless it is in the model when the mark is read."""
    thetas = [np.array(TYPICAL[n]) if n != "pressure-lag" else np.array([0.5, 2.0, 0.0]) for n in pair]
    both = bench.chain.with_effects([EFFECTS[n] for n in pair], thetas)
    data = replace(bench.data, output=both.predict(bench.data) + bench.grain(1))
    for name in pair:
        rest = without(both, name)
        made = gauge(of(name)[0], seen(rest, data), bench.noise)
        assert isinstance(made, Gauge)
        mark = made.read(data.output - rest.predict(data))
        (own,) = bench.marks(name, list(thetas[pair.index(name)]), *of(name))
        assert mark.partly or mark.values[0] == pytest.approx(own.values[0], rel=0.2), name
        assert np.sign(own.values[0]) * mark.deviations[0] > 5.0, name


def test_records_that_cannot_show_a_mark_say_why(tmp_path: Path) -> None:
    plain = records(tmp_path / "up", [np.linspace(0.0, 1.0, 60)] * 2)
    what = seen(plain.chain, plain.data)
    for name, why in (
        ("chamber-gain", "one pressure"),
        ("leak", "no command is held"),
        ("mullins", "no load is there both"),
        ("quantisation", "the readings stand on no lattice"),
    ):
        told = gauge(of(name)[0], replace(what, context=virgin(what.context)), plain.noise)
        assert isinstance(told, str) and told.startswith(why), (name, told)


def virgin(context: Any) -> Any:
    """The first record alone."""
    run = context.data.runs[0]
    later = tuple(replace(r, train=False) for r in context.data.runs[1:])
    return replace(context, data=replace(context.data, runs=(run, *later)))


def test_the_report_has_the_mark_of_what_it_names(
    loops: tuple[Path, list[Path], Path, dict[str, Any]],
) -> None:
    """There before and gone after, in the output's unit; the page says it in words."""
    report = loops[3]
    mark = report["effects"][0]["signature"]
    assert mark["unit"] == "deg" and mark["expected_sign"] == 1 and mark["why_not"] is None
    assert 0.5 < mark["before"] < 10.0 and mark["z_before"] > 10.0
    assert abs(mark["after"]) < 0.2 * mark["before"]
    page = (loops[2] / "report.html").read_text()
    assert mark["statistic"] in page and cells(mark)[2] in page


def test_words_of_a_mark() -> None:
    mark = {"unit": "deg", "expected_sign": 1, "before": 2.0, "after": 0.1, "z_before": 18.0, "z_after": 0.7}
    assert cells(mark) == (
        "2 deg (18 times its noise)",
        "0.1 deg (0.7 times its noise)",
        "was there, is gone",
    )
    assert cells({**mark, "z_after": 4.0})[2] == "was there, mostly gone"
    assert cells({**mark, "z_after": 14.0, "after": 1.5})[2] == "75 % of it is still there"
    assert cells({**mark, "before": -2.0, "z_before": -18.0})[2] == "was there with the other sign"
    assert cells({**mark, "z_before": 1.0})[2] == "was hardly there before"
    assert "no holds" in cells({**mark, "before": None, "why_not": "no holds"})[2]
