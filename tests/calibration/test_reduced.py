"""Reduced models from data whose parameters are known: they come back, or are refused with the reason."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fem_spa.calibration.holdout import split
from fem_spa.calibration.least_squares import effective_samples, spread
from fem_spa.calibration.observation import read_runs
from fem_spa.calibration.reduced import _scale, calibrate, model_table
from fem_spa.errors import InputError
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import read_model

TIME = np.arange(0.0, 120.0, 0.25)


def steps(seed: int, top: float) -> np.ndarray:
    """Pressure held at random levels, Pa, 20 s each."""
    rng = np.random.default_rng(seed)
    return np.repeat(rng.uniform(0.2, 1.0, 6) * top, 80)


def text(time, pressure, values):
    rows = zip(time, pressure, values, strict=True)
    return "time [s],pressure [kPa],displacement [mm]\n" + "".join(
        f"{t},{p / 1e3:.6f},{1e3 * y:.8f}\n" for t, p, y in rows
    )


def records(write, model, tops=(40e3, 50e3, 60e3), noise=0.0):
    paths = []
    for k, top in enumerate(tops):
        pressure = steps(k, top)
        values = model.simulate(Drive(TIME, pressure[:, None]))[:, 0]
        values = values + noise * np.random.default_rng(10 + k).standard_normal(len(values))
        paths.append(write(f"r{k}.csv", text(TIME, pressure, values)))
    return paths


VARY = ["k1", "eta1", "k2", "eta2"]


def test_parameters_come_back_within_their_intervals(write, creeping):
    # catches logarithms, units and weights that are wrong, and intervals that are too narrow
    runs = read_runs(records(write, creeping, noise=2e-5))
    train, held = split(runs)
    start = creeping.with_values(k1=120e6, eta1=50e7, k2=8e6, eta2=5e6)
    fitted, outcome = calibrate(start, train, held, VARY)
    assert outcome.status == "done"
    for number in outcome.parameters:
        true = creeping.parameters[number.name].value
        assert number.low <= number.value <= number.high
        assert abs(number.value - true) < 1.5 * (number.high - number.low) / 2
        assert number.high / number.low < 1.2
    # held out is the record of the highest pressure, and its error is the noise
    assert [run.name for run in held] == ["r2"]
    assert outcome.after[1] == pytest.approx(2e-5, rel=0.1)
    assert outcome.before[1] > 10 * outcome.after[1]
    assert any("beyond the range" in words for words in outcome.warnings)
    # the model file keeps range, error and intervals
    again = read_model({"model": model_table(fitted, outcome)})
    assert again.valid is not None and again.valid.high == outcome.valid.high
    assert again.parameters["k1"].interval == pytest.approx(
        (outcome.parameters[0].low, outcome.parameters[0].high)
    )
    drive = runs[0].drive
    assert again.simulate(drive) == pytest.approx(fitted.simulate(drive), rel=1e-9)


def test_a_number_that_wants_to_leave_its_bounds_is_refused(write):
    # data of a curve whose gain would have to be negative: the bound of a gain is positive
    rows = "".join(f"{p},{2.0 * p}\n" for p in range(0, 31, 2))
    path = write("curve.csv", "pressure [kPa],angle [deg]\n" + rows)
    model = read_model({"model": {"kind": "curve", "file": str(path)}})
    data = write("data.csv", "pressure [kPa],angle [deg]\n" + "".join(f"{p},{-p}\n" for p in range(0, 31, 2)))
    train, held = split(read_runs([data]))
    fitted, outcome = calibrate(model, train, held, ["gain", "offset"])
    assert outcome.status == "missing effect"
    gain = outcome.parameters[0]
    assert gain.refused and gain.value == 1.0 and fitted.parameters["gain"].value == 1.0
    assert gain.advice
    assert not outcome.parameters[1].refused


def test_numbers_that_start_from_zero_come_back(write):
    # catches differences relative to a start at nothing, and nan where the data do not see a number
    plain = read_model({"kind": "pneunet", "slow_chambers": 0})
    working = _scale(plain, "fast_bending")
    step = working.back(working.to(0.0) * (1.0 + 1e-5))
    assert step == pytest.approx(1e-5 * math.radians(1.0) / 1e3, rel=1e-6)
    true = plain.with_values(fast_bending=5e-5, fast_touch=3e3)
    p = np.linspace(0.0, 20e3, 15)
    angle = np.degrees(true.simulate(Drive(np.arange(15.0), p[:, None]))[:, 0])
    rows = [f"{a / 1e3},{b:.9f}" for a, b in zip(p, angle, strict=True)]
    path = write("whole.csv", "\n".join(["pressure [kPa],angle [deg]", *rows]) + "\n")
    fitted, outcome = calibrate(plain, *split(read_runs([path])), ["fast_bending", "fast_touch"])
    assert outcome.status == "done"
    assert fitted.parameters["fast_bending"].value == pytest.approx(5e-5, rel=1e-4)
    assert fitted.parameters["fast_touch"].value == pytest.approx(3e3, rel=1e-4)
    # below the touch of the walls nothing tells how they squeeze
    path = write("low.csv", "\n".join(["pressure [kPa],angle [deg]", *rows[:3], "2,5.8", "2.5,7.2"]) + "\n")
    late = plain.with_values(fast_touch=3e3)
    _, outcome = calibrate(late, *split(read_runs([path])), ["fast_bending", "fast_squeezing"])
    seen, blind = outcome.parameters
    assert np.isfinite(seen.high) and not np.isfinite(blind.high)
    assert np.all(np.isfinite(outcome.correlation))


def test_hold_out(write, creeping):
    paths = records(write, creeping, tops=(50e3, 60e3, 40e3, 30e3, 20e3, 10e3))
    runs = read_runs(paths)
    train, held = split(runs)
    assert len(held) == 2 and "r1" in {run.name for run in held}
    assert not {run.name for run in train} & {run.name for run in held}
    assert split(runs, seed=0)[1] == held
    # one record: its last third; one curve: inner pressures, never the ends
    train, held = split(runs[:1])
    assert held[0].use.sum() == len(TIME) // 3 and not (held[0].use & train[0].use).any()
    path = write("curve.csv", "pressure [kPa],angle [deg]\n" + "".join(f"{p},{p**2}\n" for p in range(12)))
    train, held = split(read_runs([path]))
    assert train[0].use[[0, -1]].all() and held[0].use.sum() == 3


def test_spread_is_that_of_many_draws():
    # a line with correlated noise: the interval covers the truth as often as it says
    rng = np.random.default_rng(0)
    x = np.linspace(0, 1, 300)
    hits = 0
    for _ in range(200):
        e = np.zeros(len(x))
        shocks = 0.01 * rng.standard_normal(len(x))
        for i in range(1, len(x)):
            e[i] = 0.8 * e[i - 1] + shocks[i]
        J = np.column_stack([x, np.ones_like(x)])
        got = np.linalg.lstsq(J, 2 * x + 1 + e, rcond=None)[0]
        told = spread(J, J @ got - (2 * x + 1 + e), [len(x)])
        hits += abs(got[0] - 2) < told.half[0]
    assert 0.88 <= hits / 200 <= 0.99
    assert effective_samples(rng.standard_normal(1000), [1000]) > 850


def test_a_shape_that_the_model_cannot_have_is_told(write):
    # a bent curve, and a straight model: the fit is not noise, and the words say so
    p = np.linspace(0, 30, 40)
    line = write("line.csv", "pressure [kPa],angle [deg]\n0,0\n30,30\n")
    bent = write("bent.csv", "pressure [kPa],angle [deg]\n" + "".join(f"{x},{x**2 / 30}\n" for x in p))
    noisy = p + np.random.default_rng(0).standard_normal(len(p))
    rows = "".join(f"{x},{y}\n" for x, y in zip(p, noisy, strict=True))
    even = write("even.csv", "pressure [kPa],angle [deg]\n" + rows)
    model = read_model({"model": {"kind": "curve", "file": str(line)}})
    for path, told in ((bent, True), (even, False)):
        train, held = split(read_runs([path]))
        _, outcome = calibrate(model, train, held, ["gain"])
        assert any("no noise" in words for words in outcome.warnings) == told


def test_what_cannot_be_fitted_says_so(write, creeping):
    path = write("c.csv", "pressure [kPa],angle [deg]\n0,0\n1,2\n2,3\n3,4\n")
    runs = read_runs([path])
    with pytest.raises(InputError, match="nothing to fit"):
        calibrate(creeping, runs, runs, ["k1"])
    path = write("d.csv", "pressure [kPa],displacement [mm]\n0,0\n1,2\n2,3\n3,4\n")
    runs = read_runs([path])
    with pytest.raises(InputError, match="static curve"):
        calibrate(creeping, runs, runs, ["k1"])
    with pytest.raises(InputError, match="no such parameter"):
        calibrate(creeping, runs, runs, ["k9"])
    bad = write("e.csv", "pressure,displacement [mm]\n0,0\n1,2\n2,3\n3,4\n")
    with pytest.raises(InputError, match="kPa"):
        read_runs([bad])
    with pytest.raises(InputError, match="twice"):
        read_runs([path, path])
