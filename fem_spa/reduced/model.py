"""What a reduced model is: parameters with unit, bounds and source; a drive goes in, outputs come out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np


@dataclass(frozen=True)
class Parameter:
    """One number of a model.

    Attributes
    ----------
    value, low, high : in SI (or in the unit's base units), `low` and `high` the bounds that physics sets
    unit : what pint reads and files show, "" for a plain number
    source : where the value is from (paper and table, file, "assumed: why")
    interval : 95 % interval once calibrated, else None
    """

    value: float
    unit: str
    low: float
    high: float
    source: str = ""
    interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class Output:
    """One output: its name in records (angle, displacement, force, x, y, z) and the unit shown."""

    name: str
    unit: str


@dataclass(frozen=True)
class Drive:
    """What acts on an actuator over time.

    Attributes
    ----------
    time : (n,) s, increasing
    pressure : (n, chambers) Pa gauge; between samples it runs linearly
    orientation : rad, between the rest axis and gravity: 0 hangs down, pi stands up
    payload : kg at the tip
    temperature : (n,) K, or None where it was not logged
    """

    time: np.ndarray
    pressure: np.ndarray
    orientation: float = 0.0
    payload: float = 0.0
    temperature: np.ndarray | None = None


@dataclass(frozen=True)
class Range:
    """Where a calibration holds: chamber pressures (Pa), and what it was calibrated from, with which error.

    error : RMSE on data held out, in the output's SI unit;  source : file names or a sentence
    """

    low: tuple[float, ...]
    high: tuple[float, ...]
    error: float | None = None
    source: str = ""


class ReducedModel(Protocol):
    """Interface of every reduced model; models are frozen dataclasses, data and formulas, no base class.

    Attributes
    ----------
    kind : the word of model files (`kind = "rod"`)
    parameters : name -> Parameter
    chambers : number of pressures a drive must have
    outputs : what `simulate` gives, column by column
    valid : where the calibration holds, or None
    """

    kind: str
    parameters: Mapping[str, Parameter]
    chambers: int
    outputs: tuple[Output, ...]
    valid: Range | None

    def with_values(self, **values: float) -> Self:
        """A copy with other parameter values (SI); InputError for an unknown name or one out of bounds."""
        ...

    def simulate(self, drive: Drive) -> np.ndarray:
        """(n, outputs) in SI at the drive's times; at rest and unpressurised before its first sample.

        InputError for a wrong number of chambers, times that do not increase, or numbers that are not finite.
        """
        ...

    def table(self) -> dict[str, Any]:
        """The `[model]` table of a model file, with units, that `registry.read_model` reads back."""
        ...
