"""The rod as the loop sees it: its own motion in a few states, tables of equilibria for what changes beside.

response(P, E, load) = M(E, load) + S(F P; E, load) - S(F commanded; E, load). M is the rod's own motion
under the commanded pressures, quadratic between moduli and loads that were solved; S are equilibria, splines
over the pressures; F is two lags of what bends and one of what stretches, which turn equilibria into the
rod's motion as nearly as they can. A load is gravity or a payload that the model has not, switched on in the
rod itself, or a clamp that turns under the moment at it; so is damping, where the model is quasi-static.
`exact` is the rod's whole motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.signal import lfilter

from fem_spa.loop.base import Base, Switches
from fem_spa.loop.data import Data
from fem_spa.loop.loads import PAYLOAD, SOFT, SWITCHED, loads, quadratic
from fem_spa.loop.operators import lag_up_down
from fem_spa.loop.tables import Table, reach, tabulate
from fem_spa.reduced.model import Drive
from fem_spa.reduced.valve import Valve, valve_pressure

STIFFER = 0.25
"""Logarithm of the factor between the moduli that are solved."""
DAMPING = ("translational_damping", "rotational_damping")
DAMPINGS = (0.0, 0.15, 0.4, 1.0, 2.5, 6.0)
"""Factors on the usual damping that are solved, where the model has none."""
NEAR = 0.005
"""Share of the range by which the short cut may differ from a state that was solved as a whole."""
MOST = 300
"""States that are solved as a whole."""
FASTEST = 1e-3
"""s: the shortest lag of the rod's own motion."""
Levels = Mapping[str, float]
"""Loads beside the model's own: `gravity` as a share of the standard one, `payload` in `PAYLOAD`,
`base-compliance` in `SOFT`."""


def rod_base(model: Any, columns: tuple[int, ...], p_low: np.ndarray, p_high: np.ndarray) -> Base:
    """The base of a rod; `modulus` and an offset a component are refitted."""
    rod = _Rod(model, columns, *reach(p_low, p_high))
    names = tuple(model.outputs[j].name for j in columns)
    units = tuple(model.outputs[j].unit for j in columns)
    own = ("payload",) if model.gravity else ("gravity", "payload")
    physical = {name: SWITCHED.format("rod", name) for name in own}
    if model.gravity:  # a free arm without weight leaves no moment at its clamp
        physical["base-compliance"] = "the rod on a clamp that turns under the moment there"
    if not model.damping:
        physical["viscous-lag"] = SWITCHED.format("rod", "damping")
    if not model.valve:
        physical["pressure-lag"] = SWITCHED.format("rod", "the transient of its valve")
    return Base(
        model,
        names,
        units,
        False,
        ("modulus",),
        np.zeros(1),
        np.full(1, -1.2),
        np.full(1, 1.2),
        rod.respond,
        still=not model.damping,
        slow=model.damping,
        factor=True,
        together=("modulus",),
        physical=physical,
        switched=rod.switched,
        exact=rod.exact,
    )


class _Rod:
    """Tables and answers of one model, remembered."""

    def __init__(self, model: Any, columns: tuple[int, ...], low: np.ndarray, high: np.ndarray) -> None:
        self.model, self.columns, self.low, self.high = model, columns, low, high
        self.tables: dict[tuple[Any, ...], Table] = {}
        self.lags: np.ndarray | None = None
        self.last: tuple[Data, str, np.ndarray] | None = None
        self.solved: list[tuple[Data, Any, np.ndarray]] = []
        self.answers: list[tuple[Data, np.ndarray, bytes, np.ndarray]] = []
        self.anchors: list[tuple[Data, np.ndarray, np.ndarray]] = []

    def respond(self, data: Data, pressure: np.ndarray, values: np.ndarray) -> np.ndarray:
        """(n, d) without further loads."""
        return self.switched(data, pressure, values, {})

    def switched(
        self, data: Data, pressure: np.ndarray, values: np.ndarray, switches: Switches
    ) -> np.ndarray:
        """(n, d) with the loads of `switches` (effect -> theta) on the rod itself."""
        key = repr([values.tobytes(), *((n, t.tobytes()) for n, t in sorted(switches.items()))]).encode()
        for kept, driven, mark, answer in self.answers:
            if kept is data and driven is pressure and mark == key:
                return answer
        found = self._short(data, pressure, values, switches)
        if "pressure-lag" in switches and self.model.damping:
            found = self._anchored(data, pressure, values, switches, found)
        self.answers = [*self.answers[-3:], (data, pressure, key, found)]
        return found

    def _short(self, data: Data, pressure: np.ndarray, values: np.ndarray, switches: Switches) -> np.ndarray:
        """(n, d) by the rod's motion under the commanded pressures, equilibria and lags for the rest."""
        stiffer, more = float(values[0]), _levels(data, switches)
        slow = damped(switches)
        if "pressure-lag" in switches:
            pressure = supplied(data, pressure, switches["pressure-lag"])
        if not self.model.damping and slow == 0.0:
            return self._still(data, self._through_valve(data, pressure), stiffer, more)
        usual = self._lagged(data)
        size = 1.0 if self.model.damping else slow / _mean_lag(usual)
        found = self._motion(data, stiffer, more, size)
        if pressure is not data.pressure:
            lags = usual * np.array([size, size, 1.0, size])
            late = self._filtered(data, self._through_valve(data, pressure), lags)
            found = found + self._still(data, late, stiffer, more)
            found -= self._commanded(data, lags, stiffer, more)
        return found

    def _anchored(
        self,
        data: Data,
        pressure: np.ndarray,
        values: np.ndarray,
        switches: Switches,
        short: np.ndarray,
    ) -> np.ndarray:
        """(n, d) the rod's whole motion at the nearest state solved so, and what the short cut adds to it.

        A state as far as `NEAR` from all of them is solved itself, `MOST` of them in all.
        """
        if self.anchors and self.anchors[0][0] is not data:
            self.anchors = []
        apart = [float(np.sqrt(np.mean((short - told) ** 2))) for _, told, _ in self.anchors]
        nearest = int(np.argmin(apart)) if apart else -1
        reach = NEAR * float(np.ptp(short, axis=0).max())
        if (nearest < 0 or apart[nearest] > reach) and len(self.anchors) < MOST:
            nearest = len(self.anchors)
            self.anchors = [*self.anchors, (data, short, self.exact(data, pressure, values, switches))]
        _, told, true = self.anchors[nearest]
        return true + (short - told)

    def _commanded(
        self, data: Data, lags: np.ndarray, stiffer: float, more: Mapping[str, np.ndarray]
    ) -> np.ndarray:
        """(n, d) equilibria of the commanded pressures behind valve and lags; the last one is remembered."""
        key = repr([lags.tobytes(), stiffer, *((n, w.tobytes()) for n, w in more.items())])
        if self.last is None or self.last[0] is not data or self.last[1] != key:
            late = self._filtered(data, self._through_valve(data, data.pressure), lags)
            self.last = (data, key, self._still(data, late, stiffer, more))
        return self.last[2]

    def exact(self, data: Data, pressure: np.ndarray, values: np.ndarray, switches: Switches) -> np.ndarray:
        """(n, d) by the rod's own motion, all changes in it."""
        size, slow = 1.0, damped(switches)
        if not self.model.damping:
            size = slow / _mean_lag(self._lagged(data)) if slow else 0.0
        if "pressure-lag" in switches:
            pressure = supplied(data, pressure, switches["pressure-lag"])
        return self._moved(data, pressure, float(values[0]), _levels(data, switches), size)

    def _moved(
        self, data: Data, pressure: np.ndarray, stiffer: float, more: Mapping[str, np.ndarray], size: float
    ) -> np.ndarray:
        """(n, d) by the rod's motion; `size` is a factor on its damping, none where that is zero."""
        rod = self.model.with_values(modulus=self.model.parameters["modulus"].value * float(np.exp(stiffer)))
        rod = replace(rod, integration="modal", damping=size > 0.0)
        if size not in (0.0, 1.0):
            known = rod.parameters
            changed = {n: size * known[n].value for n in DAMPING}
            inside = {n: float(np.clip(v, known[n].low, known[n].high)) for n, v in changed.items()}
            rod = rod.with_values(**inside)
        answer = np.empty((len(data.clock), len(self.columns)))
        for run in data.runs:
            part, first = run.part, run.part.start
            loaded = _loaded(rod, {name: float(size[first]) for name, size in more.items()})
            drive = Drive(
                data.clock[part] - data.clock[first],
                pressure[part],
                float(data.orientation[first]),
                float(data.payload[first]),
            )
            answer[part] = loaded.simulate(drive)[:, self.columns]
        return answer

    def _motion(self, data: Data, stiffer: float, more: Mapping[str, np.ndarray], size: float) -> np.ndarray:
        """(n, d) M: quadratic in the logarithm of the modulus and in each load, a spline in the damping."""
        x = stiffer / STIFFER
        moduli = {-1.0: 0.5 * x * (x - 1.0), 0.0: 1.0 - x * x, 1.0: 0.5 * x * (x + 1.0)}
        if size == 1.0:
            dampings = {1.0: 1.0}
        else:
            at = np.log1p(4.0 * np.array(DAMPINGS))
            shares = CubicSpline(at, np.eye(len(at)))(np.log1p(4.0 * min(size, DAMPINGS[-1])))
            dampings = {f: float(share) for f, share in zip(DAMPINGS, shares, strict=True)}
        out = np.zeros((len(data.clock), len(self.columns)))
        for node, share in moduli.items():
            if share == 0.0:
                continue
            for f, part in dampings.items():
                out += share * part * self._node(data, node, {}, f)
            for name, w in more.items():
                heavy: Levels = {} if self.model.gravity or name == "gravity" else {"gravity": 1.0}
                sizes: list[Levels] = [heavy, {**heavy, name: 0.5}, {**heavy, name: 1.0}]
                states = [self._node(data, node, m, 1.0) for m in sizes]
                out += share * quadratic(w[:, None], *states)
        return out

    def _node(self, data: Data, node: float, more: Levels, size: float) -> np.ndarray:
        """(n, d) the rod's motion with a modulus, loads and damping of the grid; loads of every row alike."""
        if self.solved and self.solved[0][0] is not data:
            self.solved = []
        key = (node, tuple(sorted(more.items())), size)
        for _, kept, answer in self.solved:
            if kept == key:
                return answer
        sizes = {name: np.full(len(data.clock), w) for name, w in more.items()}
        answer = self._moved(data, data.pressure, node * STIFFER, sizes, size)
        self.solved = [*self.solved, (data, key, answer)]
        return answer

    def _lagged(self, data: Data) -> np.ndarray:
        """The lags of the rod with its usual damping."""
        if self.lags is None:
            inside = self._through_valve(data, data.pressure)
            self.lags = self._lags(data, inside, self._node(data, 0.0, {}, 1.0))
        return self.lags

    def _lags(self, data: Data, inside: np.ndarray, answer: np.ndarray) -> np.ndarray:
        """(4,) two lags of bending (s), the share of the second, one of stretching."""
        every = slice(None, None, max(len(answer) // 3000, 1))

        def miss(x: np.ndarray) -> np.ndarray:
            lags = np.array([np.exp(x[0]), np.exp(x[1]), x[2], np.exp(x[3])])
            told = self._still(data, self._filtered(data, inside, lags), 0.0, {})
            return np.asarray(((told - answer)[every] / np.ptp(answer)).ravel())

        low, high = np.log(FASTEST), np.log(60.0)
        start = np.array([np.log(1.0), np.log(0.1), 0.2, np.log(0.05)])
        bounds = ([low, low, 0.0, low], [high, high, 1.0, high])
        x = least_squares(miss, start, bounds=bounds, max_nfev=12).x
        return np.array([np.exp(x[0]), np.exp(x[1]), x[2], np.exp(x[3])])

    def _filtered(self, data: Data, inside: np.ndarray, lags: np.ndarray) -> np.ndarray:
        """(n, m) Pa: the chambers' mean by the stretching's lag, what differs from it by the bending's."""
        slow, fast, share, stretch = lags
        mean = inside.mean(axis=1, keepdims=True)
        differ = inside - mean
        out = np.empty_like(inside)
        for run in data.runs:
            p = run.part
            bent = (1.0 - share) * _lag(differ[p], run.step, slow) + share * _lag(differ[p], run.step, fast)
            out[p] = bent + _lag(mean[p], run.step, stretch)
        return out

    def _through_valve(self, data: Data, pressure: np.ndarray) -> np.ndarray:
        if not self.model.valve:
            return pressure
        out = np.empty_like(pressure)
        for run in data.runs:
            time = data.clock[run.part] - data.clock[run.part.start]
            out[run.part] = valve_pressure(time, pressure[run.part], self.model.supply())
        return out

    def _still(
        self, data: Data, inside: np.ndarray, stiffer: float, more: Mapping[str, np.ndarray]
    ) -> np.ndarray:
        """(n, d) equilibria; of a further load what two tables with it say, quadratic in its size."""
        out = np.empty((len(inside), len(self.columns)))
        for rows, orientation, payload in _poses(data):
            p = inside[rows]
            own = self._table({}, orientation, payload)(p, stiffer)
            out[rows] = own
            for name, size in more.items():
                w = size[rows, None]
                if not w.any():
                    continue
                heavy: Levels = {} if self.model.gravity or name == "gravity" else {"gravity": 1.0}
                bare = self._table(heavy, orientation, payload)(p, stiffer) if heavy else own
                states = [
                    self._table({**heavy, name: size}, orientation, payload)(p, stiffer)
                    for size in (0.5, 1.0)
                ]
                out[rows] += quadratic(w, bare, *states)
        return out

    def _table(self, more: Levels, orientation: float, payload: float) -> Table:
        place = (tuple(sorted(more.items())), orientation, payload)
        if place not in self.tables:
            loaded = _loaded(self.model, more)
            modulus = self.model.parameters["modulus"].value

            def settled(pressure: np.ndarray, stiffer: float) -> np.ndarray:
                rod = loaded.with_values(modulus=modulus * float(np.exp(stiffer)))
                return np.asarray(rod.settled(pressure, orientation, payload)[:, self.columns])

            self.tables[place] = tabulate(settled, self.low, self.high, True)
        return self.tables[place]


def supplied(data: Data, pressure: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """(n, m) Pa behind the rod's valve: `slew` s for the largest pressure, then a lag; see `pressure-lag`."""
    rise, fall, slew = map(float, theta)
    out = pressure
    if slew > 0.0:
        valve = Valve(rise=slew / data.p_max, drop=slew * fall / data.p_max)
        out = np.empty_like(pressure)
        for run in data.runs:
            time = data.clock[run.part] - data.clock[run.part.start]
            out[run.part] = valve_pressure(time, pressure[run.part], valve)
    if rise > 0.0:
        out = np.stack([lag_up_down(data, c, rise, rise * fall) for c in out.T], axis=1)
    return out


def _levels(data: Data, switches: Switches) -> dict[str, np.ndarray]:
    """Load -> (n,) its size, a compliant base among them."""
    found = loads(data, switches)
    if "base-compliance" in switches:
        found["base-compliance"] = np.full(len(data.clock), float(switches["base-compliance"][0]))
    return found


def damped(switches: Switches) -> float:
    """s: the time constant that damping is to make, zero for none."""
    return float(switches["viscous-lag"][0]) if "viscous-lag" in switches else 0.0


def _mean_lag(lags: np.ndarray) -> float:
    return float((1.0 - lags[2]) * lags[0] + lags[2] * lags[1])


def _loaded(rod: Any, more: Levels) -> Any:
    """The rod with further loads; a payload has weight, so gravity is on with it."""
    if "gravity" in more:
        size = rod.parameters["gravity_acceleration"].value * more["gravity"]
        rod = rod.switched(gravity=True).with_values(gravity_acceleration=size)
    if "payload" in more:
        rod = rod if "gravity" in more else rod.switched(gravity=True)
        rod = rod.with_values(payload=rod.parameters["payload"].value + PAYLOAD * more["payload"])
    if "base-compliance" in more:
        most = rod.parameters["base_compliance"].high
        rod = rod.with_values(base_compliance=min(rod.compliance + SOFT * more["base-compliance"], most))
    return rod


def _poses(data: Data) -> list[tuple[np.ndarray, float, float]]:
    """Rows that share orientation (rad) and payload (kg), with these."""
    marks = np.round(np.column_stack([data.orientation, data.payload]), 6)
    found = []
    for orientation, payload in np.unique(marks, axis=0):
        rows = np.nonzero((marks[:, 0] == orientation) & (marks[:, 1] == payload))[0]
        found.append((rows, float(orientation), float(payload)))
    return found


def _lag(x: np.ndarray, step: float, tau: float) -> np.ndarray:
    """First-order lag of (n, m) from rest at zero, exact for straight lines between rows."""
    decay = np.exp(-step / tau)
    part = -np.expm1(-step / tau) * tau / step
    b0 = 1.0 - part
    return np.asarray(lfilter([b0, part - decay], [1.0, -decay], x, axis=0, zi=-b0 * x[None, 0])[0])
