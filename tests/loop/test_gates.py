"""What a set must pass: gain carried over to records left out, told by folds made for the purpose."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from loop_bench import curve, triangle, write_case

from fem_spa.loop.decide import Decision
from fem_spa.loop.diagnose import _missed
from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.fit import Fit, fit
from fem_spa.loop.gates import _carried_over, _each_tells
from fem_spa.loop.model_file import read_source
from fem_spa.loop.noise import Noise, Whitener
from fem_spa.loop.prepare import prepare, train_runs
from fem_spa.loop.records import read_records
from fem_spa.loop.search import FoldErrors, Trial
from fem_spa.loop.split import split


def errors(fitted: list[float], left_out: list[float], leverage: list[float]) -> FoldErrors:
    return FoldErrors(np.array(fitted), np.array(left_out), 3, np.array(leverage), np.zeros(0))


BASE = errors([1000.0, 900.0, 30000.0], [1000.0, 900.0, 30000.0], [0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("fitted", "left_out", "leverage", "passes"),
    [
        pytest.param([400.0, 300.0, 500.0], [450.0, 350.0, 900.0], [0.3, 0.3, 0.4], True, id="carried"),
        pytest.param([400.0, 300.0, 500.0], [1500.0, 990.0, 31000.0], [0.3, 0.3, 0.4], False, id="not"),
        pytest.param([400.0, 300.0, 500.0], [450.0, 350.0, 90000.0], [0.1, 0.1, 0.8], True, id="by one"),
        pytest.param([1200.0, 1000.0, 500.0], [1300.0, 1050.0, 900.0], [0.1, 0.1, 0.8], True, id="foretold"),
        pytest.param([1200.0, 1000.0, 500.0], [1300.0, 1050.0, 29000.0], [0.1, 0.1, 0.8], False, id="worse"),
    ],
)
def test_a_gain_is_carried_over_or_not(
    fitted: list[float], left_out: list[float], leverage: list[float], passes: bool
) -> None:
    """A record that alone shows an effect is no judge where it is not foretold, and counts where it is."""
    assert _carried_over(errors(fitted, left_out, leverage), BASE) is passes


@pytest.mark.parametrize(("slope", "step", "tells"), [(0.0, 2.0, False), (2.0, 2.0, True)])
def test_offsets_of_two_records_are_no_trend(tmp_path: Path, slope: float, step: float, tells: bool) -> None:
    """A drift goes on within each record; two offsets (deg) lie like one by themselves."""

    def body(shares: list[np.ndarray]) -> list[np.ndarray]:
        return [curve(q) + step * k + slope * np.linspace(0, 1, len(q)) for k, q in enumerate(shares)]

    model, files = write_case(tmp_path, body, shares=[triangle(15.0, 1.0, 4)] * 3)
    case = prepare(read_source(model), split(read_records(files), files[2:], 0))
    chain, data = case.chain, case.data
    level = chain.gain * (chain.response(data, chain.thetas, chain.base.values) - chain.rest)
    size = float(np.ptp(level))
    noise = Noise(0.0015 * size, 0.002 * size, 1.5, 0.001 * size, 0.003)
    whiten = Whitener(data, noise, level, train_runs(data))
    base = Trial((), Fit(chain, 0.0, data.output - chain.predict(data), ()), noise, 0.0)
    found = fit(chain, data, whiten, [EFFECTS["sensor-drift"]], [np.array([0.05, 0.0, 1.0])], 20)
    assert _each_tells(Trial(("sensor-drift",), found, noise, 0.0), base, whiten) is tells


@pytest.mark.parametrize(("size", "verdict"), [(0.5, "none"), (6.0, "unexplained")])
def test_none_is_not_said_where_records_held_out_are_missed(
    tmp_path: Path, size: float, verdict: str
) -> None:
    model, files = write_case(tmp_path, lambda shares: [curve(q) for q in shares])
    data = prepare(read_source(model), split(read_records(files), files[:1], 0)).data
    residual = np.radians(np.where(data.train, 0.3, size))[:, None] * np.ones((1, 1))
    nothing: dict = {"learned": None, "noise": None, "best": None}
    given = Decision("none", (), {}, [], 0.0, 0.0, False, reasons=(), **nothing)
    told = _missed(given, residual, data)
    assert told.verdict == verdict and bool(told.reasons) == (verdict == "unexplained")
