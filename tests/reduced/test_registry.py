"""What every kind of model promises: its file comes back, bad drives and names are one line, copies are
copies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fem_spa.errors import InputError
from fem_spa.reduced.checks import outside
from fem_spa.reduced.model import Drive, ReducedModel
from fem_spa.reduced.registry import KINDS, model_text, read_model

SMALLEST: dict[str, dict[str, Any]] = {
    "curve": {"columns": ["pressure [kPa]", "angle [deg]"], "rows": [[0, 0], [20, 10], [40, 25]]},
    "kelvin-voigt": {"preset": "bellow"},
    "chain": {},
    "rod": {"preset": "am-i-support"},
    "pneunet": {},
    "surface": {
        "pressures": [[0, 10, 20], [0, 5, 10, 20]],
        "output": "angle",
        "values": [float((i + 1) * (j + 2) ** 2) for i in range(3) for j in range(4)],
    },
    "segments": {
        "count": 3,
        "pitch": "7 mm",
        "stiffness": "0.012 N*m/rad",
        "mass": "3 g",
        "law": {"pressure": ["0 kPa", "20 kPa"], "turn": ["0 deg", "3 deg"], "stretch": [0.0, 0.01]},
    },
}


@pytest.fixture(params=sorted(KINDS))
def model(request: pytest.FixtureRequest) -> ReducedModel:
    return read_model({"kind": request.param} | SMALLEST[request.param])


def slow_ramp(chambers: int, top: float = 15e3) -> Drive:
    time = np.linspace(0, 0.2, 5)
    return Drive(time, np.outer(time / 0.2, np.full(chambers, top)))


def test_every_kind_is_tested_here() -> None:
    assert set(SMALLEST) == set(KINDS)


def test_what_goes_in_and_comes_out(model: ReducedModel) -> None:
    """Rows of a drive and columns of the outputs, finite, and the same a second time."""
    drive = slow_ramp(model.chambers)
    got = model.simulate(drive)
    assert got.shape == (5, len(model.outputs)) and np.all(np.isfinite(got))
    assert np.array_equal(model.simulate(drive), got)
    for name, p in model.parameters.items():
        assert p.low <= p.value <= p.high, name


def test_a_model_comes_back_from_its_file(model: ReducedModel, tmp_path: Any) -> None:
    (tmp_path / "model.toml").write_text(model_text(model), encoding="utf-8")
    again = read_model(tmp_path / "model.toml")
    drive = slow_ramp(model.chambers)
    assert again.simulate(drive) == pytest.approx(model.simulate(drive), rel=1e-9, abs=1e-12)
    assert (again.outputs, again.chambers, again.valid) == (model.outputs, model.chambers, model.valid)
    values = {n: p.value for n, p in model.parameters.items()}
    assert {n: p.value for n, p in again.parameters.items()} == pytest.approx(values, rel=1e-9)


def test_copies_with_other_values(model: ReducedModel) -> None:
    name, p = next(iter(model.parameters.items()))
    other = min(1.1 * p.value, p.high)
    changed = model.with_values(**{name: other})
    assert changed.parameters[name].value == other and model.parameters[name].value == p.value
    drive = slow_ramp(model.chambers)
    assert not np.array_equal(changed.simulate(drive), model.simulate(drive))
    for values in ({"no such name": 1.0}, {name: p.high + abs(p.high) + 1.0}, {name: float("nan")}):
        with pytest.raises(InputError) as caught:
            model.with_values(**values)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("fault", ["chambers", "backwards", "gap", "vacuum"])
def test_bad_drives_are_refused_in_one_line(model: ReducedModel, fault: str) -> None:
    drive = slow_ramp(model.chambers)
    time, pressure = drive.time.copy(), drive.pressure.copy()
    if fault == "chambers":
        pressure = np.hstack([pressure, pressure[:, :1]])
    elif fault == "backwards":
        time[2] = time[1]
    elif fault == "gap":
        pressure[3] = np.nan
    else:
        pressure[3] = -2e5
    with pytest.raises(InputError) as caught:
        model.simulate(Drive(time, pressure))
    assert "\n" not in str(caught.value)


def test_leaving_the_calibration_is_said(model: ReducedModel) -> None:
    if model.valid is None:
        assert outside(model, slow_ramp(model.chambers)) is None
        return
    top = max(model.valid.high)
    assert "calibrated from" in str(outside(model, slow_ramp(model.chambers, 1.5 * top)))


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_unknown_keys_are_refused(kind: str) -> None:
    with pytest.raises(InputError, match="nonsense"):
        read_model({"kind": kind, "nonsense": 1} | SMALLEST[kind])
