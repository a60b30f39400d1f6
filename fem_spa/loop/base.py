"""The base model as the loop sees it: pressures of all records in, response out; few parameters are refitted.

Refitted (contract): gain and offset of a `curve` or `fem`, the stiffnesses and viscosities of
`kelvin-voigt` and
an offset, Young's modulus of the `rod` and an offset a component, one stiffness and an offset of the others.
Offsets, and the gain where there is one, are linear and found inside every fit; `values` are the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fem_spa.errors import InputError
from fem_spa.loop.data import Data
from fem_spa.loop.operators import lowpass
from fem_spa.reduced.model import Drive, ReducedModel
from fem_spa.units import ATMOSPHERE

Respond = Callable[[Data, np.ndarray, np.ndarray], np.ndarray]
Switches = Mapping[str, np.ndarray]
"""Effect -> theta, of those that the model itself carries."""


@dataclass(frozen=True)
class Base:
    """A base model.

    Attributes
    ----------
    model : as read
    names, units : outputs and the units shown
    gain : whether a gain of the output is refitted
    free : names of the other refitted parameters
    values, low, high : (k,) their natural logarithms, or that of a factor on them (`factor`)
    respond : (data, pressures (n, m), values) -> (n, d) response in SI
    still : whether the response has no memory of its own
    slow : whether a call costs seconds
    factor, together : whether `values` is a factor on the parameters named in `together`
    physical : effects that the model itself carries -> in which form, in words
    switched : as `respond`, with the thetas of such effects besides
    exact : the same by the model's whole motion, where `switched` takes a short cut
    """

    model: ReducedModel
    names: tuple[str, ...]
    units: tuple[str, ...]
    gain: bool
    free: tuple[str, ...]
    values: np.ndarray
    low: np.ndarray
    high: np.ndarray
    respond: Respond
    still: bool = True
    slow: bool = False
    factor: bool = False
    together: tuple[str, ...] = ()
    physical: Mapping[str, str] = field(default_factory=dict)
    switched: Callable[[Data, np.ndarray, np.ndarray, Switches], np.ndarray] | None = None
    exact: Callable[[Data, np.ndarray, np.ndarray, Switches], np.ndarray] | None = None

    def refitted(self) -> dict[str, float]:
        """Name -> value in SI of the refitted parameters, inside their bounds."""
        found = dict(zip(self.free, np.exp(self.values), strict=True))
        if self.factor:
            size = float(np.exp(self.values[0])) if len(self.values) else 1.0
            found = {n: self.model.parameters[n].value * size for n in self.together}
        bounds = self.model.parameters
        return {n: float(np.clip(v, bounds[n].low, bounds[n].high)) for n, v in found.items()}

    def with_values(self, values: np.ndarray) -> Base:
        """A copy that starts from other values."""
        return replace(self, values=np.asarray(values, float))


def base_of(model: ReducedModel, outputs: Sequence[str], p_low: np.ndarray, p_high: np.ndarray) -> Base:
    """The base for `outputs` of a model whose chambers are driven between `p_low` and `p_high` (m,) Pa."""
    every = [o.name for o in model.outputs]
    columns = tuple(every.index(name) for name in outputs)
    names = tuple(outputs)
    units = tuple(model.outputs[j].unit for j in columns)
    if model.kind == "kelvin-voigt":
        return _kelvin_voigt(model, names, units)
    if model.kind == "curve":
        table = _table(model, p_low, p_high)
        none = np.zeros(0)
        return Base(model, names, units, True, (), none, none, none, table)
    if model.kind == "surface":
        return _surface(model, names, units)
    if model.kind == "fem":
        return _loaded_deck(model, names, units)
    if model.kind == "rod":
        from fem_spa.loop.base_rod import rod_base

        return rod_base(model, columns, p_low, p_high)
    if model.kind == "pneunet":
        from fem_spa.loop.base_finger import finger_base

        return finger_base(model, columns, p_low, p_high)
    from fem_spa.loop.base_still import still_base

    return still_base(model, columns, p_low, p_high)


def _table(model: ReducedModel, p_low: np.ndarray, p_high: np.ndarray) -> Respond:
    """A static map of one pressure as a dense table, 30 % beyond what the records reach; lines between."""
    if len(p_low) != 1:
        raise InputError(
            f"the records have {len(p_low)} pressures, a '{model.kind}' takes one; use another kind of model"
        )
    low, high = min(float(p_low[0]), 0.0), max(float(p_high[0]), 0.0)
    margin = 0.3 * (high - low) + 1.0
    grid = np.linspace(max(low - margin, min(low, -0.95 * ATMOSPHERE)), high + margin, 2001)
    values = model.simulate(Drive(np.arange(len(grid), dtype=float), grid[:, None]))

    def respond(data: Data, pressure: np.ndarray, _: np.ndarray) -> np.ndarray:
        columns = [np.interp(pressure[:, 0], grid, column) for column in values.T]
        return np.stack(columns, axis=1)

    return respond


def _surface(model: ReducedModel, names: tuple[str, ...], units: tuple[str, ...]) -> Base:
    """A static map of several pressures, asked as it is."""
    none = np.zeros(0)

    def respond(data: Data, pressure: np.ndarray, _: np.ndarray) -> np.ndarray:
        return np.asarray(model.at(pressure)[:, None])  # type: ignore[attr-defined]

    return Base(model, names, units, True, (), none, none, none, respond)


def _loaded_deck(model: ReducedModel, names: tuple[str, ...], units: tuple[str, ...]) -> Base:
    """A deck under loads that hang on a record's orientation and payload: a static map a record."""
    none = np.zeros(0)

    def respond(data: Data, pressure: np.ndarray, _: np.ndarray) -> np.ndarray:
        out = np.empty((len(pressure), len(names)))
        for run in data.runs:
            first, clock = run.part.start, data.clock[run.part]
            pose = float(data.orientation[first]), float(data.payload[first])
            out[run.part] = model.simulate(Drive(clock, pressure[run.part], *pose))
        return out

    return Base(model, names, units, True, (), none, none, none, respond)


def _kelvin_voigt(model: ReducedModel, names: tuple[str, ...], units: tuple[str, ...]) -> Base:
    """Elements in series, each a first-order lag of the pressure; a parameter without one a spring."""
    free = tuple(name for name in model.parameters if name != "offset")
    springs = [name for name in free if name.startswith("k")]
    log = np.log([model.parameters[name].value for name in free])
    low = np.log([model.parameters[name].low for name in free])
    high = np.log([model.parameters[name].high for name in free])

    def respond(data: Data, pressure: np.ndarray, values: np.ndarray) -> np.ndarray:
        number = dict(zip(free, np.exp(values), strict=True))
        total = np.zeros(len(pressure))
        for name in springs:
            eta = number.get("eta" + name[1:])
            p = pressure[:, 0]
            total += (p if eta is None else lowpass(data, p, eta / number[name])) / number[name]
        return total[:, None]

    width = np.log(300.0)
    return Base(
        model,
        names,
        units,
        False,
        free,
        log,
        np.maximum(low, log - width),
        np.minimum(high, log + width),
        respond,
        still=False,
    )
