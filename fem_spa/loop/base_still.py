"""Models that answer at once (chain, finger, several pressures) as tables; one stiffness and offsets
refitted."""

from __future__ import annotations

import numpy as np

from fem_spa.loop.base import Base
from fem_spa.loop.data import Data
from fem_spa.loop.tables import Table, reach, tabulate
from fem_spa.reduced.model import Drive, ReducedModel

STIFFNESS = {"chain": ("k_theta", "k_layer"), "segments": ("gain",)}
"""Kind -> parameters that are refitted together, as one factor; of actuators in series those of each."""


def still_base(model: ReducedModel, columns: tuple[int, ...], p_low: np.ndarray, p_high: np.ndarray) -> Base:
    """The base of a model without memory; one table for each orientation and payload that occurs."""
    names = tuple(model.outputs[j].name for j in columns)
    units = tuple(model.outputs[j].unit for j in columns)
    low, high = reach(p_low, p_high)
    kinds = STIFFNESS.get(model.kind, ())
    stiff = tuple(n for n in model.parameters if n in kinds or n.rpartition("_")[0] in kinds)
    kept: dict[tuple[float, float], Table] = {}

    def table(orientation: float, payload: float) -> Table:
        key = (round(orientation, 6), round(payload, 9))
        if key not in kept:

            def settled(pressure: np.ndarray, stiffer: float) -> np.ndarray:
                factor = float(np.exp(stiffer))
                own = model.with_values(
                    **{n: _inside(model, n, model.parameters[n].value * factor) for n in stiff}
                )
                time = np.arange(len(pressure), dtype=float)
                return own.simulate(Drive(time, pressure, orientation, payload))[:, columns]

            kept[key] = tabulate(settled, low, high, bool(stiff))
        return kept[key]

    def respond(data: Data, pressure: np.ndarray, values: np.ndarray) -> np.ndarray:
        out = np.empty((len(pressure), len(columns)))
        stiffer = float(values[0]) if len(values) else 0.0
        for run in data.runs:
            first = run.part.start
            found = table(float(data.orientation[first]), float(data.payload[first]))
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
        factor=True,
        together=stiff,
    )


def _inside(model: ReducedModel, name: str, value: float) -> float:
    p = model.parameters[name]
    return float(np.clip(value, p.low, p.high))
