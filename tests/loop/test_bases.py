"""What the loop makes of each kind of model, against the model itself; a valve that takes seconds a bar."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fem_spa.loop.base import Base, base_of
from fem_spa.loop.data import Data, build
from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.model_file import Source
from fem_spa.loop.operators import rate_limited
from fem_spa.loop.records import Record
from fem_spa.loop.simulate import predicted
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import read_model

TIME = np.arange(0.0, 6.0, 0.05)


def data_of(outputs: dict[str, str], top: tuple[float, ...], orientation: float = 0.0) -> Data:
    """Two records on one grid."""
    return build(records_of(outputs, top, orientation), [True, True], list(outputs), 10**9)


def records_of(outputs: dict[str, str], top: tuple[float, ...], orientation: float) -> list[Record]:
    """Two records, levels at random with ramps between; nothing measured."""
    rng = np.random.default_rng(4)
    records = []
    for k in range(2):
        levels = np.vstack([np.zeros(len(top)), rng.uniform(0.0, 1.0, (5, len(top)))])
        pressure = np.stack([np.interp(TIME, np.arange(6) * 1.1, c) for c in levels.T], axis=1) * top
        nothing = {name: np.zeros(len(TIME)) for name in outputs}
        record = Record(Path(f"r{k}.csv"), f"r{k}", TIME, pressure, None, None, nothing, outputs)
        records.append(replace(record, orientation=orientation * k))
    return records


def base_for(model: Any, data: Data, names: list[str]) -> Base:
    return base_of(model, names, data.pressure.min(axis=0), data.pressure.max(axis=0))


def simulated(model: Any, data: Data, pressure: np.ndarray, names: list[str]) -> np.ndarray:
    columns = [[o.name for o in model.outputs].index(n) for n in names]
    parts = []
    for run in data.runs:
        clock = data.clock[run.part] - data.clock[run.part.start]
        drive = Drive(clock, pressure[run.part], float(data.orientation[run.part.start]))
        parts.append(model.simulate(drive)[:, columns])
    return np.concatenate(parts)


AXES = ["x", "y", "z"]


def rod(**switches: Any) -> Any:
    table = {"kind": "rod", "preset": "am-i-support", "elements": 8, "integration": "modal"}
    return read_model({"model": table | switches})


@pytest.fixture(scope="module")
def arm() -> Data:
    return data_of(dict.fromkeys(AXES, "mm"), (200e3, 150e3, 100e3), np.pi / 2)


@pytest.mark.parametrize("stiffer", [0.0, 0.13])
def test_gravity_switched_on_is_the_heavy_rod(arm: Data, stiffer: float) -> None:
    # a stand-in fitted to outputs, or a rod whose modulus is not moved together with its weight
    light, heavy = rod(gravity=False), rod()
    base = base_for(light, arm, AXES)
    assert base.switched is not None
    told = base.switched(arm, arm.pressure, np.array([stiffer]), {"gravity": np.ones(1)})
    own = heavy.with_values(modulus=heavy.parameters["modulus"].value * np.exp(stiffer))
    true = simulated(own, arm, arm.pressure, AXES)
    weight = np.abs(true - simulated(light, arm, arm.pressure, AXES)).max()
    assert np.abs(told - true).max() < 0.02 * weight


@pytest.mark.parametrize("stiffer", [0.0, 0.13])
def test_a_compliant_base_switched_on_is_the_rod_on_its_spring(arm: Data, stiffer: float) -> None:
    # a turn in proportion to the pressure, as the block has it, is another thing: weight turns the base
    base = base_for(rod(), arm, AXES)
    assert base.switched is not None and base.exact is not None
    theta = {"base-compliance": np.array([0.6])}
    own = rod(base_compliance="0.3 rad/(N*m)")
    own = own.with_values(modulus=own.parameters["modulus"].value * np.exp(stiffer))
    true = simulated(own, arm, arm.pressure, AXES)
    told, whole = (f(arm, arm.pressure, np.array([stiffer]), theta) for f in (base.switched, base.exact))
    turned = np.abs(true - base.respond(arm, arm.pressure, np.array([stiffer]))).max()
    assert turned > 3e-3
    assert np.abs(told - true).max() < 0.03 * turned
    assert np.abs(whole - true).max() < 1e-9
    assert "base-compliance" not in base_for(rod(gravity=False), arm, AXES).physical


def test_damping_switched_on_is_the_damped_rod(arm: Data) -> None:
    # one lag of the tip leaves a third of what damping does; its exact form is that of the rod
    base = base_for(rod(damping=False), arm, AXES)
    assert base.switched is not None and base.exact is not None
    true = simulated(rod(), arm, arm.pressure, AXES)
    off = []
    for tau in np.geomspace(0.3, 3.0, 15):
        told = base.switched(arm, arm.pressure, np.zeros(1), {"viscous-lag": np.array([tau, 0.0])})
        off.append(np.sqrt(np.mean((told - true) ** 2)))
    still = base.respond(arm, arm.pressure, np.zeros(1))
    assert min(off) < 0.06 * np.sqrt(np.mean((still - true) ** 2))


def test_other_pressures_move_the_rod_as_its_own_motion_does(arm: Data) -> None:
    # equilibria alone would be late by nothing, the commanded motion alone would not change
    base = base_for(rod(), arm, AXES)
    pressure = arm.pressure * [1.1, 0.9, 1.0]
    before = base.respond(arm, arm.pressure, np.zeros(1))
    told, true = base.respond(arm, pressure, np.zeros(1)), simulated(rod(), arm, pressure, AXES)
    assert np.abs(told - true).max() < 0.12 * np.abs(true - before).max()


def test_a_slow_valve_switched_on_is_the_rod_behind_it(arm: Data) -> None:
    # equilibria and lags alone leave 6 to 10 % of what such a valve does, and no fit finds it through them
    base = base_for(rod(valve=False), arm, AXES)
    assert base.switched is not None and base.exact is not None
    plain, off = base.respond(arm, arm.pressure, np.zeros(1)), []
    for slew in (1.5, 2.5, 2.52):
        valve = {"pressure-lag": np.array([0.0, 2.8, slew])}
        told, true = (f(arm, arm.pressure, np.zeros(1), valve) for f in (base.switched, base.exact))
        off.append(np.abs(told - true).max() / np.abs(true - plain).max())
    assert max(off) < 0.01


def test_a_model_file_is_simulated_by_the_whole_rod(arm: Data) -> None:
    # the search's short cut (equilibria and lags) under other pressures is millimetres off
    model = rod()
    gains = np.array([0.1, 0.0, 0.0, 0.1, 0.0, 0.0])
    scales = {"scale": np.ones(3), "rest": np.zeros(3), "p_max": 2e5, "cycles": 1.0, "seconds": 12.0}
    source = Source(model, (EFFECTS["chamber-gain"],), (gains,), scales)
    records = records_of(dict.fromkeys(AXES, "mm"), (200e3, 150e3, 100e3), np.pi / 2)
    told = np.concatenate(predicted(source, records, AXES))
    true = simulated(model, arm, arm.pressure * [1.1, 0.9, 1.0], AXES)
    assert np.abs(told - true).max() < 1e-6


def test_a_valve_is_the_same_whatever_else_is_predicted() -> None:
    # its slew is of the pressures that it was found with; a low record alone once had a quicker valve
    scales = {"scale": np.ones(3), "rest": np.zeros(3), "p_max": 2e5, "cycles": 1.0, "seconds": 12.0}
    source = Source(rod(valve=False), (EFFECTS["pressure-lag"],), (np.array([0.0, 2.8, 2.5]),), scales)
    low = records_of(dict.fromkeys(AXES, "mm"), (80e3, 60e3, 40e3), np.pi / 2)
    high = records_of(dict.fromkeys(AXES, "mm"), (200e3, 150e3, 100e3), np.pi / 2)
    alone, beside = predicted(source, low, AXES), predicted(source, [*low, *high], AXES)
    assert np.abs(alone[0] - beside[0]).max() < 1e-6


def test_the_finger_is_itself_with_another_stiffness() -> None:
    # lines over a coarse grid miss the kink of the fast module by a degree and more
    data = data_of({"angle": "deg"}, (70e3, 35e3))
    model = read_model({"model": {"kind": "pneunet", "fast_touch": "4 kPa"}})
    told = base_for(model, data, ["angle"]).respond(data, data.pressure, np.array([0.2]))
    true = simulated(model.with_values(stiffness=np.exp(0.2)), data, data.pressure, ["angle"])
    assert np.abs(told - true).max() < np.radians(0.02)


def test_actuators_in_series_are_stiffened_all_of_them() -> None:
    part = {"preset": "bending", "segments": 5}
    model = read_model({"model": {"kind": "chain", "series": [part, part]}})
    data = data_of({"angle": "deg"}, (200e3, 200e3))
    base = base_for(model, data, ["angle"])
    assert set(base.together) == {f"k_{kind}_{i}" for kind in ("theta", "layer") for i in (1, 2)}
    own = model.with_values(**{n: 1.1 * model.parameters[n].value for n in base.together})
    told = base.respond(data, data.pressure, np.array([np.log(1.1)]))
    true = simulated(own, data, data.pressure, ["angle"])
    assert np.abs(told - true).max() < 2e-3 * np.ptp(true)


def test_a_chain_with_hysteresis_of_its_own_keeps_it() -> None:
    # taken as a static map, its loop would be found again as an effect that it lacks
    table = {"kind": "chain", "segments": 5, "hysteresis": {"A": 0.3, "beta": 6.0, "alpha": 2.0}}
    model = read_model({"model": table | {"preset": "bending"}})
    data = data_of({"angle": "deg"}, (300e3,))
    told = base_for(model, data, ["angle"]).respond(data, data.pressure, np.zeros(1))
    true = simulated(model, data, data.pressure, ["angle"])
    still = simulated(replace(model, hysteresis=None), data, data.pressure, ["angle"])
    assert np.abs(told - true).max() < 1e-9 < 1e-3 < np.abs(true - still).max()


def test_a_rate_limit_is_a_straight_line_that_waits_for_nobody() -> None:
    data = data_of({"angle": "deg"}, (1.0,))
    step = np.where(np.arange(len(data.clock)) > 20, 1.0, 0.0)
    late = rate_limited(data, step, 0.5, 0.25)
    first = data.runs[0].part
    clock = data.clock[first] - data.clock[20]
    assert np.allclose(late[first], np.clip(0.5 * clock, 0.0, 1.0), atol=1e-9)
    assert (rate_limited(data, step, 1e6, 1e6) == step).all()
