"""The fit (35): constraints kept, gains and damping found again, nothing claimed of what is not seen."""

from __future__ import annotations

import numpy as np
import pytest

from fem_spa.errors import InputError
from fem_spa.reduced.model import Drive
from fem_spa.reduced.rod import Rod, arm
from fem_spa.reduced.rod_fit import PAPER_BOUNDS, PAPER_START, fit_rod, nearest_allowed

GAIN = {f"strain_gain_{i}": (0.9, 1.2) for i in (1, 2, 3)}


def records(model: Rod, noise: float) -> list[tuple[Drive, np.ndarray]]:
    """One step of each chamber and of all, 2 s each at 20 Hz."""
    rng = np.random.default_rng(8)
    time = np.arange(0, 2, 0.05)
    found = []
    for row in (*np.eye(3), np.ones(3)):
        drive = Drive(time, np.tile(1.5e5 * row, (time.size, 1)))
        tip = model.simulate(drive)
        found.append((drive, tip + noise * rng.standard_normal(tip.shape)))
    return found


def test_truth_comes_back_within_its_intervals() -> None:
    fit = fit_rod(arm(), records(arm(), 3e-4), start=PAPER_START)
    for name in PAPER_BOUNDS:
        p, truth = fit.model.parameters[name], arm().parameters[name].value
        if name == "rotational_damping":
            assert p.interval is None  # it moves nothing that these records show
        else:
            assert p.interval is not None and p.interval[0] <= truth <= p.interval[1]
            assert p.interval[1] - p.interval[0] < 0.03 * truth
    assert fit.rmse == pytest.approx(3e-4 * np.sqrt(3), rel=0.1)
    assert fit.cost[1] < 0.1 * fit.cost[0]


def test_constraints_hold_where_the_truth_breaks_them() -> None:
    """Data of an arm whose first chamber is the strongest: the constraints keep it below the third."""
    quasi = arm().switched(damping=False)
    other = quasi.with_values(strain_gain_1=1.15, strain_gain_2=1.0, strain_gain_3=1.05)
    fit = fit_rod(quasi, records(other, 0.0), bounds=GAIN)
    a, b, c = (fit.model.parameters[f"strain_gain_{i}"].value for i in (1, 2, 3))
    assert a <= c + 1e-9 and b <= c + 1e-9 and 2 * a <= b + c + 1e-9
    free = fit_rod(quasi, records(other, 0.0), bounds=GAIN, constraints=())
    assert free.model.parameters["strain_gain_1"].value == pytest.approx(1.15, abs=1e-4)
    assert free.cost[1] < fit.cost[1]


def test_nearest_allowed_point() -> None:
    """Against a fine grid of allowed points, for a quadratic that is not round."""
    H = np.array([[3.0, 1.0], [1.0, 2.0]])
    rows = np.array([[1.0, -1.0]])
    low, high = np.zeros(2), np.ones(2)
    aim = np.array([1.4, 0.3])
    point = nearest_allowed(aim, H, rows, low, high)
    x, y = np.meshgrid(np.linspace(0, 1, 401), np.linspace(0, 1, 401))
    allowed = np.column_stack([x[x <= y], y[x <= y]]) - aim
    best = np.min(np.einsum("ij,jk,ik->i", allowed, H, allowed))
    assert (point - aim) @ H @ (point - aim) == pytest.approx(best, abs=2e-3)
    assert point[0] <= point[1] + 1e-12
    with pytest.raises(InputError, match="widen"):
        nearest_allowed(aim, H, np.array([[1.0, 1.0]]), low + 0.5, high)


def test_wrong_records_are_one_line() -> None:
    drive = Drive(np.arange(3.0), np.zeros((3, 3)))
    with pytest.raises(InputError, match="no records"):
        fit_rod(arm(), [])
    with pytest.raises(InputError, match="x, y, z at 3 times"):
        fit_rod(arm(), [(drive, np.zeros((3, 2)))])
    with pytest.raises(InputError, match="no such parameter"):
        fit_rod(arm(), [(drive, np.zeros((3, 3)))], bounds={"gain": (0, 1)}, constraints=())
