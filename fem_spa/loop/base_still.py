"""Models that answer at once (chain, several pressures) as tables; one stiffness and offsets refitted.

A chain with hysteresis or dynamics of its own moves through its own states: as it is and with two other
stiffnesses over the commanded pressures, quadratic between; what other pressures change is from the tables of
its equilibria. Each record begins at rest. Gravity and payload that the model has not: equilibria so loaded.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_spa.loop.base import Base, Switches
from fem_spa.loop.data import Data
from fem_spa.loop.loads import PAYLOAD, SWITCHED, loads, quadratic
from fem_spa.loop.tables import Table, reach, tabulate
from fem_spa.reduced.model import Drive, ReducedModel

STIFFNESS = {"chain": ("k_theta", "k_layer"), "segments": ("gain",)}
"""Kind -> parameters that are refitted together, as one factor; of actuators in series those of each."""


STIFFER = 0.25
"""Logarithm of the factor between the stiffnesses whose motions are solved."""


def still_base(model: ReducedModel, columns: tuple[int, ...], p_low: np.ndarray, p_high: np.ndarray) -> Base:
    """The base of a model without memory; one table for each orientation and payload that occurs."""
    names = tuple(model.outputs[j].name for j in columns)
    units = tuple(model.outputs[j].unit for j in columns)
    low, high = reach(p_low, p_high)
    kinds = STIFFNESS.get(model.kind, ())
    stiff = tuple(n for n in model.parameters if n in kinds or n.rpartition("_")[0] in kinds)
    kept: dict[tuple[float, float, bool], Table] = {}
    weightless = getattr(model, "gravity", None) is False
    physical = {}
    if hasattr(model, "gravity"):
        physical["payload"] = SWITCHED.format(model.kind, "payload")
    if weightless:
        physical["gravity"] = SWITCHED.format(model.kind, "gravity")
    moving = bool(getattr(model, "hysteresis", None) or getattr(model, "dynamics", False))
    quiet = replace(model, hysteresis=None, dynamics=False) if moving else model  # type: ignore[type-var]

    def stiffened(of: ReducedModel, stiffer: float) -> ReducedModel:
        factor = float(np.exp(stiffer))
        return of.with_values(**{n: _inside(of, n, of.parameters[n].value * factor) for n in stiff})

    def table(orientation: float, payload: float, heavy: bool) -> Table:
        key = (round(orientation, 6), round(payload, 9), heavy)
        if key not in kept:
            body = replace(quiet, gravity=True) if heavy else quiet  # type: ignore[type-var]

            def settled(pressure: np.ndarray, stiffer: float) -> np.ndarray:
                time = np.arange(len(pressure), dtype=float)
                drive = Drive(time, pressure, orientation, payload)
                return stiffened(body, stiffer).simulate(drive)[:, columns]

            kept[key] = tabulate(settled, low, high, bool(stiff))
        return kept[key]

    def exact(data: Data, pressure: np.ndarray, values: np.ndarray, switches: Switches) -> np.ndarray:
        out = motion_of(data, pressure, values)
        if switches:
            out += switched(data, pressure, values, switches) - respond(data, pressure, values)
        return out

    def motion_of(data: Data, pressure: np.ndarray, values: np.ndarray) -> np.ndarray:
        own = stiffened(model, float(values[0]) if len(values) else 0.0)
        out = np.empty((len(pressure), len(columns)))
        for run in data.runs:
            first, clock = run.part.start, data.clock[run.part]
            pose = float(data.orientation[first]), float(data.payload[first])
            out[run.part] = own.simulate(Drive(clock - clock[0], pressure[run.part], *pose))[:, columns]
        return out

    solved: dict[float, tuple[Data, np.ndarray]] = {}

    def motion(data: Data, node: float) -> np.ndarray:
        if node not in solved or solved[node][0] is not data:
            solved[node] = (data, motion_of(data, data.pressure, np.array([node * STIFFER])))
        return solved[node][1]

    def respond(data: Data, pressure: np.ndarray, values: np.ndarray) -> np.ndarray:
        if not moving:
            return equilibria(data, pressure, values)
        x = float(values[0]) / STIFFER
        out = (1.0 - x * x) * motion(data, 0.0)
        if x:
            out = out + 0.5 * x * ((x - 1.0) * motion(data, -1.0) + (x + 1.0) * motion(data, 1.0))
        if pressure is not data.pressure:
            out = out + equilibria(data, pressure, values) - equilibria(data, data.pressure, values)
        return np.asarray(out)

    def switched(data: Data, pressure: np.ndarray, values: np.ndarray, switches: Switches) -> np.ndarray:
        out = respond(data, pressure, values)
        more = loads(data, switches)
        if "gravity" in more:
            change = equilibria(data, pressure, values, True) - equilibria(data, pressure, values)
            out = out + more["gravity"][:, None] * change
        if "payload" in more:
            hung = [
                equilibria(data, pressure, values, weightless, size * PAYLOAD) for size in (0.0, 0.5, 1.0)
            ]
            out = out + quadratic(more["payload"][:, None], *hung)
        return out

    def equilibria(
        data: Data, pressure: np.ndarray, values: np.ndarray, heavy: bool = False, more: float = 0.0
    ) -> np.ndarray:
        out = np.empty((len(pressure), len(columns)))
        stiffer = float(values[0]) if len(values) else 0.0
        for run in data.runs:
            first = run.part.start
            found = table(float(data.orientation[first]), float(data.payload[first]) + more, heavy)
            out[run.part] = found(pressure[run.part], stiffer)
        return out

    k = 1 if stiff else 0
    return Base(
        model,
        names,
        units,
        False,
        stiff[:1],
        np.zeros(k),
        np.full(k, -1.5),
        np.full(k, 1.5),
        respond,
        still=not moving,
        factor=True,
        together=stiff,
        physical=physical,
        switched=switched,
        exact=exact if moving else None,
    )


def _inside(model: ReducedModel, name: str, value: float) -> float:
    p = model.parameters[name]
    return float(np.clip(value, p.low, p.high))
