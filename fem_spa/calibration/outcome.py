"""What a calibration comes to, whatever was calibrated: numbers, errors, range, what was refused."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from fem_spa.calibration.observation import UNITS, Run
from fem_spa.reduced.model import Range
from fem_spa.reduced.tables import factor


@dataclass(frozen=True)
class Fitted:
    """One number, SI.

    start, value : before and after;  low, high : its 95 % interval, infinite where the data do not tell
    bounds : what physics allows;  wanted : where the fit would go beyond them, else None
    advice : effects that may be missing, where it was refused
    """

    name: str
    unit: str
    start: float
    value: float
    low: float
    high: float
    bounds: tuple[float, float]
    wanted: float | None = None
    why: str = ""
    advice: str = ""

    @property
    def refused(self) -> bool:
        """Whether the fit leaves the bounds, so that the starting value was kept."""
        return self.wanted is not None


@dataclass
class Outcome:
    """The result of a calibration.

    kind : "finite elements" or the model's kind
    status : "done"; "missing effect": a number would leave its bounds; "interrupted"
    before, after : (training, held-out) RMSE in the first output's SI unit
    runs : (run, role, before, after), role "train" or "heldout"
    evaluations : FE runs, or simulations
    predicted : of every run, the outputs before and after at the rows that count, each (n, outputs) SI
    effects : of the model file, held as they are; all errors are with them
    """

    kind: str
    status: str
    parameters: list[Fitted]
    outputs: tuple[str, ...]
    before: tuple[float, float]
    after: tuple[float, float]
    span: float
    valid: Range
    runs: list[tuple[Run, str, float, float]]
    evaluations: int
    iterations: int
    predicted: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)
    correlation: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    effects: tuple[str, ...] = ()

    @property
    def unit(self) -> str:
        """Unit in which errors are shown."""
        return UNITS[self.outputs[0]]

    def shown(self, value: float) -> float:
        """An error in `unit`."""
        return value / factor(self.unit)


def rmse(errors: Sequence[np.ndarray]) -> float:
    """Root of the mean squared norm of error vectors, each (n, outputs); nan where there are none."""
    squares = [np.sum(e**2, axis=1) for e in errors]
    every = np.concatenate(squares) if squares else np.zeros(0)
    every = every[np.isfinite(every)]
    return math.sqrt(float(np.mean(every))) if every.size else math.nan


def span_of(runs: Sequence[Run], outputs: Sequence[str]) -> float:
    """The largest range of one output over the rows that count, SI."""
    spans = []
    for name in outputs:
        values = np.concatenate([run.outputs[name][run.use] for run in runs])
        values = values[np.isfinite(values)]
        spans.append(float(np.ptp(values)) if values.size else 0.0)
    return max(spans)


def range_of(runs: Sequence[Run], error: float, source: str) -> Range:
    """Pressures of the rows that were fitted."""
    pressure = np.concatenate([run.drive.pressure[run.use] for run in runs])
    low, high = pressure.min(axis=0), pressure.max(axis=0)
    return Range(tuple(map(float, low)), tuple(map(float, high)), error, source)


def source_of(runs: Sequence[Run]) -> str:
    """The files that were fitted; of a curve.csv its folder, too."""
    names = [run.path.name for run in runs]
    return ", ".join(
        f"{run.path.parent.name}/{name}" if name == "curve.csv" and run.path.parent.name else name
        for run, name in zip(runs, names, strict=True)
    )


def beyond(runs: Sequence[Run], valid: Range) -> list[str]:
    """A sentence for every held-out run that leaves the range."""
    found = []
    for run in runs:
        pressure = run.drive.pressure[run.use]
        for j, (low, high) in enumerate(zip(valid.low, valid.high, strict=True)):
            slack = 1e-3 * (high - low)
            least, most = float(pressure[:, j].min()), float(pressure[:, j].max())
            if least < low - slack or most > high + slack:
                found.append(
                    f"{run.name} runs from {least / 1e3:.4g} to {most / 1e3:.4g} kPa, beyond the range of "
                    f"the fit ({low / 1e3:.4g} to {high / 1e3:.4g} kPa): its error is that of extrapolation"
                )
    return found
