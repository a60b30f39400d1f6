"""Why a load path ends before its end: the body can bear no more, or the numbers break down."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fem_spa.solid.newton import Equilibrium
from fem_spa.solid.problem import Row
from fem_spa.solid.system import System


class Stop(Exception):
    """The walk ends here with a result's `status` and message."""

    def __init__(self, status: str, message: str) -> None:
        super().__init__(message)
        self.status = status


def give_up(
    system: System, x: np.ndarray, pressure: np.ndarray, failed: Equilibrium, dead: bool, rows: Sequence[Row]
) -> Stop:
    """Why no smaller step helps.

    x, pressure : the last converged state;  failed : the last attempt;  dead : under dead loads
    rows : of the path so far
    """
    system.evaluate(x, pressure, 1.0)
    stretch, worst = system.max_stretch()
    e = failed.evaluation
    if np.isfinite(e.min_jacobian) and e.min_jacobian <= 0:
        worst = e.worst
    at = named(dict(zip(system.cavities, pressure, strict=True)))
    where = "under the dead loads alone" if dead else f"beyond {at or 'the last step'}"
    reason = (
        f"no equilibrium found {where} ({failed.why}); largest stretch {stretch:.2f}, "
        f"worst {system.place(worst)}"
    )
    if not dead and system.problem.loads.control == "pressure" and near_limit(rows):
        return Stop(
            "limit",
            f"{reason}. The shape changes without bound with pressure here: a limit point or a buckle; "
            'control = "volume" may go on through it',
        )
    return Stop("diverged", f"{reason}. A finer mesh there or a smaller load may help")


def named(pressure: Mapping[str, float]) -> str:
    """Cavities' pressures (Pa) in words."""
    return ", ".join(f"{name} {1e-3 * p:.4g} kPa" for name, p in pressure.items())


def near_limit(rows: Sequence[Row]) -> bool:
    """Has the volume's response to pressure grown tenfold along the path, or turned round?"""
    if len(rows) < 3:
        return False
    volumes = np.array([row.volume for row in rows])
    pressures = np.array([max(row.pressure.values(), key=abs, default=0.0) for row in rows])
    with np.errstate(divide="ignore", invalid="ignore"):
        response = np.diff(volumes) / np.diff(pressures)
    response = response[np.isfinite(response)]
    if len(response) < 2:
        return False
    return bool(response[-1] < 0 or response[-1] > 10 * np.abs(response).min())
