"""Joint stiffness of a chain from measured or FE bending, as the paper's second calibration step."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from fem_spa.errors import InputError
from fem_spa.reduced.chain import OUTPUTS, Chain
from fem_spa.reduced.model import Drive, Range


@dataclass(frozen=True, eq=False)
class StiffnessFit:
    """A chain with its stiffness found, and the errors in the output's SI unit.

    Attributes
    ----------
    mae, deviation : mean and standard deviation of |error|, as the paper reports them
    rmse : root of the mean squared error
    """

    model: Chain
    mae: float
    deviation: float
    rmse: float


def fit_stiffness(
    chain: Chain,
    pressure: np.ndarray,
    measured: np.ndarray,
    name: str | None = None,
    output: str = "angle",
    orientation: float = 0.0,
    source: str = "",
) -> StiffnessFit:
    """Least squares for one stiffness; the torques of the air stay as they are.

    Parameters
    ----------
    pressure : (n, chambers) or (n,) Pa;  measured : (n,) output in SI at equilibrium
    name : which parameter; None: the first one, which moves the actuator
    output : angle, displacement, x or y;  orientation : rad, of the rest axis against gravity

    Raises
    ------
    InputError : fewer than two values, an unknown name, or no response to it
    """
    name = next(iter(chain.parameters)) if name is None else name
    if name not in chain.parameters:
        raise InputError(f"given {name}: a chain has {', '.join(chain.parameters)}")
    column = [o.name for o in OUTPUTS].index(output)
    p = np.asarray(pressure, float)
    p = p[:, None] if p.ndim == 1 else p
    value = np.asarray(measured, float)
    if len(p) != value.size or value.size < 2 or not np.all(np.isfinite(value)):
        raise InputError(
            f"given {value.size} values for {len(p)} pressures; two finite ones at least are needed"
        )
    drive = Drive(np.arange(len(p), dtype=float), p, orientation)
    still = replace(chain, dynamics=False, hysteresis=None)
    start = chain.parameters[name]

    def left(log: np.ndarray) -> np.ndarray:
        k = float(np.clip(np.exp(log[0]), start.low, start.high))
        return np.asarray(still.with_values(**{name: k}).simulate(drive)[:, column] - value)

    trials = np.log(start.value) + np.linspace(-3, 3, 13)
    first = min(trials, key=lambda x: float(np.sum(left(np.array([x])) ** 2)))
    done = least_squares(left, [first], x_scale=1.0, diff_step=1e-4, xtol=1e-12)
    if not np.any(np.abs(done.jac) > 0):
        raise InputError(f"given {name}: the {output} at these pressures does not depend on it")
    error = np.abs(done.fun)
    spread = np.sqrt(np.sum(done.fun**2) / (value.size - 1) / float(np.sum(done.jac**2)))
    reach = float(student.ppf(0.975, value.size - 1)) * float(spread)
    found = float(np.exp(done.x[0]))
    interval = (found * float(np.exp(-reach)), found * float(np.exp(reach)))
    numbers = dict(chain.with_values(**{name: found}).parameters)
    numbers[name] = replace(numbers[name], interval=interval, source=source or numbers[name].source)
    rmse = float(np.sqrt(np.mean(error**2)))
    low, high = np.minimum(p.min(axis=0), 0.0), np.maximum(p.max(axis=0), 0.0)
    valid = Range(tuple(map(float, low)), tuple(map(float, high)), None, source)
    model = replace(chain, parameters=numbers, valid=valid)
    return StiffnessFit(model, float(error.mean()), float(error.std()), rmse)
