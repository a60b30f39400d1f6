"""Effects as blocks: nothing at their null, memory over the gaps, one answer for any sampling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from loop_bench import duhem, write_case

from fem_spa.loop.effects.effect import SLOTS
from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.experiment import WHAT
from fem_spa.loop.model_file import read_source
from fem_spa.loop.noise import Noise, Whitener, fit_noise
from fem_spa.loop.operators import _lag, lag_up_down, lowpass, play, sliding
from fem_spa.loop.prepare import Case, prepare
from fem_spa.loop.records import read_records
from fem_spa.loop.split import split


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Case:
    model, files = write_case(tmp_path_factory.mktemp("blocks"), duhem)
    return prepare(read_source(model), split(read_records(files), [], 0))


@pytest.fixture(scope="module")
def elements(tmp_path_factory: pytest.TempPathFactory) -> Case:
    folder = tmp_path_factory.mktemp("elements")
    _, files = write_case(folder, duhem)
    model = folder / "kv.toml"
    numbers = {"k1": "2 kPa/deg", "k2": "5 kPa/deg", "eta1": "0.6 kPa*s/deg", "eta2": "40 kPa*s/deg"}
    model.write_text(
        '[model]\nkind = "kelvin-voigt"\n' + "".join(f'{k} = "{v}"\n' for k, v in numbers.items())
    )
    return prepare(read_source(model), split(read_records(files), [], 0))


@pytest.mark.parametrize("name", EFFECTS)
@pytest.mark.parametrize("base", ["case", "elements"])
def test_an_effect_at_its_null_is_none(name: str, base: str, request: pytest.FixtureRequest) -> None:
    """Else likelihoods of nested models could not be compared."""
    chain, data = request.getfixturevalue(base).chain, request.getfixturevalue(base).data
    effect = EFFECTS[name]
    with_it = chain.with_effects([effect], [effect.null])
    assert np.abs(with_it.predict(data) - chain.predict(data)).max() < 1e-12


@pytest.mark.parametrize("name", EFFECTS)
def test_starts_are_inside_the_bounds_and_change_something(name: str, case: Case) -> None:
    effect, context = EFFECTS[name], case.chain.context(case.data)
    assert effect.slot in SLOTS and all(mate in EFFECTS for mate in effect.classmates)
    for group in effect.starts(context) if effect.untestable(context) is None else []:
        for theta in group:
            assert np.all(theta >= effect.low) and np.all(theta <= effect.high)
    assert effect.experiment in WHAT and effect.words
    for mate in effect.classmates:
        assert name in EFFECTS[mate].classmates, "same class is symmetric"


def test_lag_is_the_closed_form_on_a_ramp(case: Case) -> None:
    """Ramp: y = t - tau (1 - exp(-t / tau)) for any step; all records at once, or one by one."""
    data, tau = case.data, 0.7
    t = np.concatenate([data.clock[r.part] - data.clock[r.part.start] for r in data.runs])
    fresh = replace(data, runs=tuple(replace(r, gap=1e7) for r in data.runs))
    assert lowpass(fresh, t, tau) == pytest.approx(t - tau * (1.0 - np.exp(-t / tau)), abs=1e-9)
    alone = np.concatenate([_lag(t[r.part], r.step, tau, np.zeros(())) for r in data.runs])
    assert lowpass(fresh, t, tau) == pytest.approx(alone, abs=1e-12)


def test_a_sliding_spring_is_a_stop_or_its_closed_form(case: Case) -> None:
    """Limit constant: what a play leaves. Limit growing with the load: plateaus as long as the limits say."""
    data = case.data
    q = data.pressure[:, 0] / data.pressure.max()
    same = sliding(data, q, 1.0, np.full(len(q), 0.07), 0.07)
    assert same == pytest.approx(q - play(data, q, 0.07), abs=1e-12)
    run = data.runs[0]
    n = run.part.stop
    rise = np.linspace(0.0, 1.0, n - n // 2)
    load = np.concatenate([rise, np.linspace(1.0, 0.0, n // 2)])
    alone = replace(data, runs=(run,))
    force = sliding(alone, load, 2.0, 0.01 + 0.1 * load, 0.01)
    # falls from +0.11 at 2 a unit until it meets -(0.01 + 0.1 x): 0.11 - 2 (1 - x) = -0.01 - 0.1 x
    meets = 1.88 / 2.1
    expected = np.where(load > meets, 0.11 - 2.0 * (1.0 - load), -0.01 - 0.1 * load)
    assert force[len(rise) :] == pytest.approx(expected[len(rise) :], abs=1e-12)
    assert force[: len(rise)] == pytest.approx(np.minimum(2.0 * rise, 0.01 + 0.1 * rise), abs=1e-12)


def test_what_happened_before_a_short_gap_is_remembered(case: Case) -> None:
    data = case.data
    near = replace(data, runs=tuple(replace(r, gap=1.0) for r in data.runs))
    far = replace(data, runs=tuple(replace(r, gap=1e7) for r in data.runs))
    q = data.pressure[:, 0] + 1e4
    second = data.runs[1].part.start
    assert lowpass(near, q, 20.0)[second] > 0.05 * q.max()
    assert lowpass(far, q, 20.0)[second] == pytest.approx(0.0, abs=1e-6 * q.max())


def test_unequal_lag_follows_its_own_equation(case: Case) -> None:
    """Against small explicit steps of y' = (p - y) / tau, tau by the sign of p - y."""
    data = case.data
    run = data.runs[0]
    only = replace(data, runs=(replace(run, part=slice(0, 300)),), clock=data.clock[:300])
    p = data.pressure[:300, 0]
    found = lag_up_down(only, p, 0.3, 0.9)
    y, fine = 0.0, []
    for k in range(300):
        for j in range(200 if k else 0):
            now = p[k - 1] + (p[k] - p[k - 1]) * (j + 0.5) / 200
            y += run.step / 200 * (now - y) / (0.3 if now > y else 0.9)
        fine.append(y)
    assert np.abs(found - fine).max() < 0.02 * p.max()


def test_play_is_backlash(case: Case) -> None:
    data, radius = case.data, 7e3
    x = data.pressure[:, 0]
    slow, state = np.empty_like(x), 0.0
    for run in data.runs:
        state = min(max(state, -radius), radius)
        for k in range(run.part.start, run.part.stop):
            state = min(max(state, x[k] - radius), x[k] + radius)
            slow[k] = state
    assert play(data, x, radius) == pytest.approx(slow)


def test_noise_is_found_and_turned_white(case: Case) -> None:
    data, rng = case.data, np.random.default_rng(5)
    level = case.chain.predict(data)
    top = float(np.abs(level).max())
    true = Noise(0.002 * top, 0.004 * top, 2.0, 0.005 * top, 0.0)
    e = np.zeros_like(level)
    for run in data.runs:
        n = run.part.stop - run.part.start
        a, x = np.exp(-run.step / true.tau), 0.0
        for k in range(run.part.start, run.part.stop):
            x = a * x + np.sqrt(1 - a * a) * true.coloured * rng.standard_normal()
            e[k, 0] = x
        e[run.part, 0] += true.white * rng.standard_normal(n) + true.offset * rng.standard_normal()
    runs = tuple(range(len(data.runs)))
    found, cost = fit_noise(data, e, level, runs)
    assert found.white == pytest.approx(true.white, rel=0.15)
    assert found.coloured == pytest.approx(true.coloured, rel=0.4)
    assert cost <= Whitener(data, true, level, runs).cost(e) + 2.0
    turned = Whitener(data, found, level, runs)(e)
    assert float(np.mean(turned**2)) == pytest.approx(1.0, abs=0.1)
    again = replace(
        data, runs=tuple(replace(r, step=r.step * (1 + 1e-6 * i)) for i, r in enumerate(data.runs))
    )
    assert Whitener(again, true, level, runs)(e) == pytest.approx(
        Whitener(data, true, level, runs)(e), abs=1e-2
    )
