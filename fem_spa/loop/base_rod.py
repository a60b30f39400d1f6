"""The rod as the loop sees it: solved once as it is; what changes beside that is read from tables.

response(P, E) = rod's own answer to the commanded pressures + lag of (S(P, E) - S(commanded, E0)), S the
tip of
equilibria. At the model's own values this is the rod itself; a change of pressure or stiffness goes through
the lag that turns S into the rod's own motion. Gravity and payload, where the model has none, are the rod
with the switch on, solved once, in proportion.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fem_spa.loop.base import Base
from fem_spa.loop.data import Data
from fem_spa.loop.operators import lowpass
from fem_spa.loop.tables import Table, reach, tabulate
from fem_spa.reduced.model import Drive
from fem_spa.reduced.valve import valve_pressure

PAYLOAD = 0.02
"""kg: the payload of size one where none is stated."""


def rod_base(model: Any, columns: tuple[int, ...], p_low: np.ndarray, p_high: np.ndarray) -> Base:
    """The base of a rod; `modulus` and an offset a component are refitted."""
    names = tuple(model.outputs[j].name for j in columns)
    units = tuple(model.outputs[j].unit for j in columns)
    low, high = reach(p_low, p_high)
    tables: dict[tuple[Any, ...], Table] = {}
    own: dict[int, tuple[Data, np.ndarray, np.ndarray, float]] = {}
    modulus = model.parameters["modulus"].value

    def table(rod: Any, key: str, orientation: float, payload: float) -> Table:
        place = (key, round(orientation, 6), round(payload, 9))
        if place not in tables:

            def settled(pressure: np.ndarray, stiffer: float) -> np.ndarray:
                changed = rod.with_values(modulus=modulus * float(np.exp(stiffer)))
                return np.asarray(changed.settled(pressure, orientation, payload)[:, columns])

            tables[place] = tabulate(settled, low, high, True)
        return tables[place]

    def through_valve(data: Data, pressure: np.ndarray) -> np.ndarray:
        if not model.valve:
            return pressure
        out = np.empty_like(pressure)
        for run in data.runs:
            time = data.clock[run.part] - data.clock[run.part.start]
            out[run.part] = valve_pressure(time, pressure[run.part], model.supply())
        return out

    def equilibrium(rod: Any, key: str, data: Data, inside: np.ndarray, stiffer: float) -> np.ndarray:
        out = np.empty((len(inside), len(columns)))
        for run in data.runs:
            first = run.part.start
            found = table(rod, key, float(data.orientation[first]), float(data.payload[first]))
            out[run.part] = found(inside[run.part], stiffer)
        return out

    def moved(rod: Any, data: Data) -> np.ndarray:
        """The rod's own answer to the commanded pressures."""
        answer = np.empty((len(data.clock), len(columns)))
        for run in data.runs:
            part = run.part
            drive = Drive(
                data.clock[part] - data.clock[part.start],
                data.pressure[part],
                float(data.orientation[part.start]),
                float(data.payload[part.start]),
            )
            answer[part] = rod.simulate(drive)[:, columns]
        return answer

    def nominal(data: Data) -> tuple[np.ndarray, np.ndarray, float]:
        """The rod's answer, the equilibria of the commanded pressures, and by which lag they differ."""
        if id(data) not in own or own[id(data)][0] is not data:
            answer = moved(model, data)
            still = equilibrium(model, "own", data, through_valve(data, data.pressure), 0.0)
            own[id(data)] = (data, answer, still, _lag_between(data, still, answer) if model.damping else 0.0)
        return own[id(data)][1:]

    def respond(data: Data, pressure: np.ndarray, values: np.ndarray) -> np.ndarray:
        stiffer = float(values[0])
        answer, still, lag = nominal(data)
        if pressure is data.pressure and stiffer == 0.0:
            return answer
        change = equilibrium(model, "own", data, through_valve(data, pressure), stiffer) - still
        return answer + (lowpass(data, change, lag) if lag else change)

    def weight(data: Data) -> np.ndarray:
        return moved(model.switched(gravity=True), data) - nominal(data)[0]

    def load(data: Data) -> np.ndarray:
        heavy = model.switched(gravity=True)
        more = heavy.with_values(payload=model.parameters["payload"].value + PAYLOAD)
        return moved(more, data) - (nominal(data)[0] if model.gravity else moved(heavy, data))

    physical: dict[str, Callable[[Data], np.ndarray]] = {"payload": _once(load)}
    if not model.gravity:
        physical["gravity"] = _once(weight)
    return Base(
        model,
        names,
        units,
        False,
        ("modulus",),
        np.zeros(1),
        np.full(1, -1.2),
        np.full(1, 1.2),
        respond,
        still=not model.damping,
        slow=model.damping,
        factor=True,
        together=("modulus",),
        physical=physical,
    )


def _lag_between(data: Data, still: np.ndarray, answer: np.ndarray) -> float:
    """s: time constant with which equilibria come closest to the rod's own motion, zero where none helps."""
    spread = np.std(answer, axis=0) + 1e-12
    times = [0.0, *np.geomspace(0.02, 5.0, 25)]
    left = []
    for tau in times:
        late = lowpass(data, still - still[0], tau) + still[0] if tau else still
        left.append(float(np.mean(((late - answer) / spread) ** 2)))
    return float(times[int(np.argmin(left))])


def _once(function: Callable[[Data], np.ndarray]) -> Callable[[Data], np.ndarray]:
    """The function, remembered for the data that it was last asked for."""
    kept: list[Any] = []

    def remembered(data: Data) -> np.ndarray:
        if not kept or kept[0] is not data:
            kept[:] = [data, function(data)]
        return np.asarray(kept[1])

    return remembered
