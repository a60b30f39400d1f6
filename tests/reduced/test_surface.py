"""The static map of several pressures: exact for cubics, straight beyond its edge, its file read back."""

import numpy as np
import pytest

from fem_spa.errors import InputError
from fem_spa.loop.base_fem import serpentine
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import model_text, read_model
from fem_spa.reduced.surface import surface

GRID = [np.linspace(0.0, 40e3, 5), np.linspace(0.0, 20e3, 5)]


def cubic(p: np.ndarray) -> np.ndarray:
    x, y = p.T / 40e3
    return 1.2 * x**3 - 0.4 * x * y**2 + 0.7 * y + 0.1 * x * y


def made() -> object:
    points = np.stack(np.meshgrid(*GRID, indexing="ij"), axis=-1)
    return surface(GRID, cubic(points.reshape(-1, 2)), "angle", "test")


def test_a_cubic_is_met_everywhere_and_goes_on_straight_beyond() -> None:
    # a wrong order of axes, or spline coefficients of one axis only
    model = made()
    p = np.random.default_rng(0).uniform(0.0, 1.0, (50, 2)) * [40e3, 20e3]
    drive = Drive(np.arange(50.0), p)
    assert np.abs(model.simulate(drive)[:, 0] - cubic(p)).max() < 1e-12
    edge, step = np.array([[40e3, 20e3]]), 1.0
    slope = (cubic(edge) - cubic(edge - [[step, 0.0]])) / step
    beyond = model.at(edge + np.array([[5e3, 0.0]]))
    assert beyond == pytest.approx(cubic(edge) + 5e3 * slope, rel=1e-4)


def test_its_file_reads_back(tmp_path: object) -> None:
    model = made().with_values(gain=0.9, offset=0.02)
    path = tmp_path / "surface.toml"
    path.write_text(model_text(model), encoding="utf-8")
    p = np.array([[10e3, 5e3], [33e3, 19e3]])
    assert np.abs(read_model(path).at(p) - model.at(p)).max() < 1e-9


def test_a_grid_with_a_value_missing_is_refused() -> None:
    with pytest.raises(InputError, match="one a point"):
        surface(GRID, np.zeros(24), "angle", "test")


def test_the_path_over_a_grid_begins_at_rest_and_changes_one_pressure_at_a_time() -> None:
    # jumps across the grid would cost steps, and pass a limit point that the grid does not need
    stops = serpentine([np.arange(3.0), np.arange(4.0), np.arange(2.0)])
    assert (stops[0] == 0).all() and len(np.unique(stops, axis=0)) == 24
    assert (np.abs(np.diff(stops, axis=0)).sum(axis=1) == 1.0).all()
