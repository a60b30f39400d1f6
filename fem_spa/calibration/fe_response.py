"""One FE run as a function: outputs at any pressure of the records, and their derivatives.

One pressure: load points are spread over the measured range, and between all converged states the cubic
Hermite polynomial runs whose slopes are the solver's own derivatives to pressure. Several pressures: load
points are the centres of the cells of pressure space that the records visit, and a sample is the nearest
centre's state plus its derivative times the difference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_spa.calibration.observation import Run
from fem_spa.errors import InputError
from fem_spa.solid.knobs import Knob
from fem_spa.solid.observe import Observer
from fem_spa.solid.path import solve
from fem_spa.solid.problem import Problem, StepControl
from fem_spa.solid.sensitivity import Derivatives, Sensitivities

POINTS = 5
"""Load points over the range of one pressure."""
MOST_CELLS = 40
"""Load points of several pressures."""


class RunFailed(Exception):
    """The FE run did not reach the pressures of the records."""


@dataclass(frozen=True)
class Design:
    """Load points for records: `points` (m, n_cavities) Pa in the order of `cavities`, first that at rest."""

    cavities: tuple[str, ...]
    points: np.ndarray
    columns: np.ndarray

    def pressure(self, run: Run) -> np.ndarray:
        """(n, n_cavities) Pa at the rows that count."""
        return run.drive.pressure[run.use][:, self.columns]

    @property
    def single(self) -> bool:
        """Whether all cavities have one pressure."""
        return bool(np.all(self.columns == self.columns[0]))


def design(cavities: tuple[str, ...], runs: Sequence[Run]) -> Design:
    """Load points that cover the pressures of all runs.

    Raises
    ------
    InputError
        The records have another number of pressures than the mesh has cavities.
    """
    columns = _columns(cavities, runs[0])
    pressure = np.concatenate([run.drive.pressure[run.use][:, columns] for run in runs])
    size = float(np.abs(pressure).max())
    if size == 0.0:
        raise InputError("the records are all at zero pressure: there is nothing to fit; give a loaded one")
    if np.all(columns == columns[0]):
        p = pressure[:, 0]
        top, bottom = float(p.max()), float(p.min())
        points = [0.0]
        if top > 0.02 * size:
            points += list(top * np.arange(1, POINTS + 1) / POINTS)
        if bottom < -0.02 * size:
            points += list(bottom * np.arange(1, POINTS + 1) / POINTS)
        return Design(cavities, np.repeat(np.array(points)[:, None], len(cavities), axis=1), columns)
    for share in (0.02, 0.04, 0.08, 0.15, 0.25, 0.5):
        cell = np.round(pressure / (share * size))
        keys, which, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
        if len(keys) <= MOST_CELLS:
            break
    centres = np.zeros((len(keys), len(cavities)))
    np.add.at(centres, which.ravel(), pressure)
    centres /= count[:, None]
    centres = centres[np.linalg.norm(centres, axis=1) > 1e-9 * size]
    return Design(cavities, np.vstack([np.zeros(len(cavities)), centres]), columns)


def _columns(cavities: tuple[str, ...], run: Run) -> np.ndarray:
    """Which column of the records' pressures each cavity has."""
    given = run.drive.pressure.shape[1]
    if given == 1:
        return np.zeros(len(cavities), dtype=int)
    if set(run.chambers) >= set(cavities):
        return np.array([run.chambers.index(name) for name in cavities])
    if given != len(cavities):
        raise InputError(
            f"{run.path} has {given} pressures, the mesh has the cavities {', '.join(cavities)}: give one "
            "pressure, or one a cavity in this order"
        )
    return np.arange(given)


@dataclass(frozen=True)
class Response:
    """What an FE run gives.

    points : (m, n_cavities) Pa of the states;  value : (m, outputs) SI there
    by_knob : (knobs, m, outputs) a unit of the knob
    by_pressure : (n_cavities, m, outputs) a Pa
    """

    design: Design
    outputs: tuple[str, ...]
    points: np.ndarray
    value: np.ndarray
    by_knob: np.ndarray
    by_pressure: np.ndarray

    def at(self, run: Run) -> tuple[np.ndarray, np.ndarray]:
        """Outputs (n, outputs) at the rows that count, and their derivatives (knobs, n, outputs)."""
        p = self.design.pressure(run)
        return self._one(p[:, 0]) if self.design.single else self._several(p)

    def _one(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

        x, order = np.unique(self.points[:, 0], return_index=True)
        slope = self.by_pressure.sum(axis=0)[order]
        inside = np.clip(p, x[0], x[-1])
        curve = CubicHermiteSpline(x, self.value[order], slope)
        value = curve(inside) + curve(inside, 1) * (p - inside)[:, None]
        knobs = np.empty((len(self.by_knob), len(p), len(self.outputs)))
        for k, column in enumerate(self.by_knob):
            knobs[k] = PchipInterpolator(x, column[order])(inside)
        return value, knobs

    def _several(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        from scipy.spatial import cKDTree

        near = cKDTree(self.points).query(p)[1]
        value = self.value[near] + np.einsum("cno,nc->no", self.by_pressure[:, near], p - self.points[near])
        return value, self.by_knob[:, near]


def respond(
    problem: Problem,
    steps: StepControl,
    chosen: Design,
    outputs: tuple[str, ...],
    knobs: Sequence[Knob],
    observers: Sequence[Observer] = (),
) -> Response:
    """Solve at the load points of a design, with derivatives.

    Raises
    ------
    RunFailed
        A load point was not reached; the reason in one line.
    KeyboardInterrupt
        The run was interrupted.
    """
    points = [dict(zip(chosen.cavities, map(float, row), strict=True)) for row in chosen.points[1:]]
    problem = replace(problem, loads=replace(problem.loads, points=points, control="pressure"))
    steps = replace(steps, stop_at_touch=False)
    seen = Sensitivities(knobs, every=chosen.single, steps=steps)
    result = solve(problem, steps, [seen, *observers])
    if result.status == "interrupted":
        raise KeyboardInterrupt
    found = seen.found
    if result.status != "done" or sum(d.row.is_point for d in found) != len(chosen.points):
        raise RunFailed(result.message)
    n = len(knobs)
    way = _direction(found) if "displacement" in outputs else np.zeros(3)
    value = np.array([[_value(d, name, way, found[0]) for name in outputs] for d in found])
    slope = np.array(
        [[_slope(d, name, way) for name in outputs] for d in found]
    )  # (m, outputs, n + cavities)
    slope = np.moveaxis(slope, 2, 0)
    at = np.array([[d.row.pressure[name] for name in chosen.cavities] for d in found])
    return Response(chosen, outputs, at, value, slope[:n], slope[n:])


def _direction(found: Sequence[Derivatives]) -> np.ndarray:
    """(3,) from the tip's first place to its farthest."""
    moved = np.array([d.row.tip - found[0].row.tip for d in found])
    far = moved[int(np.argmax(np.linalg.norm(moved, axis=1)))]
    return far / max(float(np.linalg.norm(far)), 1e-300)


def _value(d: Derivatives, name: str, way: np.ndarray, first: Derivatives) -> float:
    if name == "displacement":
        return float((d.row.tip - first.row.tip) @ way)
    if name == "angle":
        return d.row.angle
    if name == "force":
        return float(d.row.force or 0.0)
    return float(d.row.tip["xyz".index(name)])


def _slope(d: Derivatives, name: str, way: np.ndarray) -> np.ndarray:
    return d.tip @ way if name == "displacement" else d.of(name)
