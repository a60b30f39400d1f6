"""Kind "kelvin-voigt": Kelvin-Voigt elements in series; pressure in, displacement (angle, force) out.

    [model]
    kind = "kelvin-voigt"        # four elements: two springs, two dampers
    k1 = "82.85 kPa/mm"
    eta1 = "345.6 kPa*s/mm"
    k2 = "11.45 kPa/mm"
    eta2 = "2.036 kPa*s/mm"      # k3, eta3 ... for more elements; k0: a spring in series without damper

Hashem et al., bellow-driven actuator, (2)-(5): the creep compliance of n elements is

    J(t) = 1/k0 + sum_i 1/k_i (1 - exp(-k_i t / eta_i))      (4), whose 1/k0 is zero

and D(t) = integral of J(t - s) dp(s) (3), linear in p (5). So k_i is pressure a displacement of that element
alone, 1/k_i its share of the displacement that a pressure reaches at last, eta_i/k_i its retardation time.
(4) has no instantaneous part: what the paper calls instantaneous elasticity is the retarded one of the
faster element. The series is a Prony series of the compliance. The unit of k1 says what comes out: kPa/mm a
displacement, kPa/deg an angle, kPa/N a force.

Each element obeys eta_i y' + k_i y = p. For p linear between samples that has a closed solution, used from
sample to sample: exact for any interval. Before its first sample the actuator is at rest and unpressurised;
the first pressure comes as a step.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numba import njit

from fem_spa.errors import InputError
from fem_spa.reduced.checks import check_drive
from fem_spa.reduced.model import Drive, Output, Parameter, Range
from fem_spa.reduced.tables import (
    amount,
    changed,
    common_table,
    factor,
    read_parameters,
    read_valid,
    refuse_unknown,
)
from fem_spa.units import brief

PAPER = {"k1": 82.85e6, "eta1": 345.6e6, "k2": 11.45e6, "eta2": 2.036e6}
"""Bellow paper, Table III, final, Pa/m and Pa s/m."""
START = {"k1": 107.1e6, "eta1": 1029e6, "k2": 11.96e6, "eta2": 1.784e6}
"""Bellow paper, Table III, initial."""
_OUTPUTS = {"displacement": "mm", "angle": "deg", "force": "N"}
_KEY = re.compile(r"(k|eta)(\d+)")
_WIDE = 1e6  # bounds of a stiffness or viscosity: this factor around 1 kPa a unit of output


@dataclass(frozen=True, eq=False)
class KelvinVoigt:
    """Elements in series; parameters k1, eta1, ..., k0 where there is one, and `offset` of the output."""

    outputs: tuple[Output, ...]
    parameters: Mapping[str, Parameter]
    valid: Range | None = None
    kind: str = "kelvin-voigt"
    chambers: int = 1

    def with_values(self, **values: float) -> Self:
        """A copy with other values (Pa and s a unit of output in SI)."""
        return replace(self, parameters=changed(self.parameters, values, self.kind))

    @property
    def elements(self) -> int:
        """Number of Kelvin-Voigt elements."""
        return sum(name.startswith("eta") for name in self.parameters)

    def coefficients(self) -> tuple[float, np.ndarray, np.ndarray]:
        """Instantaneous compliance 1/k0 (0 without), compliances 1/k_i (m,), rates k_i/eta_i (m,) in 1/s."""
        value = {name: p.value for name, p in self.parameters.items()}
        k = np.array([value[f"k{i}"] for i in range(1, self.elements + 1)])
        eta = np.array([value[f"eta{i}"] for i in range(1, self.elements + 1)])
        return (1.0 / value["k0"] if "k0" in value else 0.0), 1.0 / k, k / eta

    def compliance(self, time: np.ndarray) -> np.ndarray:
        """Creep compliance J (4) at times of any shape, output a Pa; zero before t = 0."""
        at_once, share, rate = self.coefficients()
        t = np.asarray(time, float)[..., None]
        grown = at_once + np.sum(-share * np.expm1(-rate * np.maximum(t, 0.0)), axis=-1)
        return np.where(t[..., 0] >= 0, grown, 0.0)

    def simulate(self, drive: Drive) -> np.ndarray:
        """(n, 1), the output in SI, exact for pressures that run linearly between the samples."""
        time, pressure = check_drive(drive, 1, self.kind)
        at_once, share, rate = self.coefficients()
        y = elements(time, np.ascontiguousarray(pressure[:, 0]), share, rate).sum(axis=1)
        return (y + at_once * pressure[:, 0] + self.parameters["offset"].value)[:, None]

    def table(self) -> dict[str, Any]:
        """The `[model]` table."""
        return common_table(self.kind, self.parameters, self.valid, self.outputs)


@njit(cache=True)
def elements(time, pressure, share, rate):
    """Response (n, m) of elements y' = rate (share p - y) to pressure (n,), linear between times (n,) s.

    share : (m,) output a Pa;  rate : (m,) 1/s. At rest before the first sample.
    """
    n, m = time.size, share.size
    y = np.zeros((n, m))
    for j in range(n - 1):
        dt, p, dp = time[j + 1] - time[j], pressure[j], pressure[j + 1] - pressure[j]
        for i in range(m):
            x = rate[i] * dt
            grown = -math.expm1(-x)  # of a step
            if x > 1e-3:
                ramp = 1.0 - grown / x
            else:
                ramp = x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x / 120.0)))
            y[j + 1, i] = y[j, i] + (share[i] * p - y[j, i]) * grown + share[i] * dp * ramp
    return y


def boltzmann(
    compliance: Callable[[np.ndarray], np.ndarray], time: np.ndarray, pressure: np.ndarray, points: int = 16
) -> np.ndarray:
    """(3) for any creep compliance: response (n,) to pressure (n,) Pa, linear between times (n,) s.

    Gauss-Legendre over each interval, `points` of them; the work grows with n^2. For series of elements
    `KelvinVoigt.simulate` is exact and far faster.

    Parameters
    ----------
    compliance : t (any shape) in s -> J(t), output a Pa, for t >= 0
    """
    t, p = np.asarray(time, float), np.asarray(pressure, float)
    x, weight = np.polynomial.legendre.leggauss(points)
    x, weight = 0.5 * (x + 1.0), 0.5 * weight
    past = t[:-1, None] + np.diff(t)[:, None] * x
    result = p[0] * compliance(t - t[0])
    for k in range(1, t.size):
        result[k] += np.sum(np.diff(p)[:k] * (compliance(t[k] - past[:k]) @ weight))
    return np.asarray(result)


def kelvin_voigt(
    stiffness: Sequence[float],
    viscosity: Sequence[float],
    instant: float | None = None,
    output: str = "displacement",
    source: str = "",
) -> KelvinVoigt:
    """A model of elements (Pa a unit of output, Pa s a unit of output, in SI), k0 = `instant` where given."""
    unit = _OUTPUTS[output]
    names = {f"k{i}": k for i, k in enumerate(stiffness, 1)} | {
        f"eta{i}": e for i, e in enumerate(viscosity, 1)
    }
    names |= {"k0": instant} if instant is not None else {}
    return KelvinVoigt((Output(output, unit),), _parameters(names, output, source))


def _parameters(values: Mapping[str, float], output: str, source: str) -> dict[str, Parameter]:
    unit = _OUTPUTS[output]
    one = 1e3 / factor(unit)
    parameters = {}
    for name, value in values.items():
        written = f"kPa*s/{unit}" if name.startswith("eta") else f"kPa/{unit}"
        parameters[name] = Parameter(float(value), written, one / _WIDE, one * _WIDE, source)
    parameters["offset"] = Parameter(0.0, unit, -1e3 * factor(unit), 1e3 * factor(unit))
    return parameters


def bellow() -> KelvinVoigt:
    """The paper's actuator with its final parameters."""
    parameters = _parameters(PAPER, "displacement", "Hashem et al., Table III, final")
    valid = Range((-20e3,), (70e3,), 0.3e-3, "Hashem et al., Fig. 9: fit -20 to 50 kPa, validation to 70 kPa")
    return KelvinVoigt((Output("displacement", "mm"),), parameters, valid)


def read(table: Mapping[str, Any], where: Path) -> KelvinVoigt:
    """The model of a `[model]` table; `preset = "bellow"` is the paper's, then overridden."""
    given = {key: table[key] for key in table if _KEY.fullmatch(key)}
    refuse_unknown(table, (*given, "k1", "eta1", "k2", "eta2", "offset", "preset"))
    if "preset" in table:
        return _preset(table, given)
    count = max((int(key.lstrip("keta")) for key in given), default=0)
    needed = [f"{letter}{i}" for i in range(1, max(count, 1) + 1) for letter in ("k", "eta")]
    missing = [key for key in needed if key not in given]
    if missing:
        raise InputError(f"given no model.{missing[0]}: kind 'kelvin-voigt' needs k and eta of each element")
    if "eta0" in given:
        raise InputError("given model.eta0: k0 is a spring alone; number the elements from 1")
    output = _output(given["k1"])
    values = {key: 1.0 for key in given}
    outputs = (Output(output, _OUTPUTS[output]),)
    parameters = read_parameters(table, _parameters(values, output, ""))
    return KelvinVoigt(outputs, parameters, read_valid(table, outputs))


def _preset(table: Mapping[str, Any], given: Mapping[str, Any]) -> KelvinVoigt:
    """The paper's model with what a table overrides; its range goes once an element is another."""
    if table["preset"] != "bellow":
        raise InputError(f"given {brief(table['preset'])} for model.preset: allowed is 'bellow'")
    base = bellow()
    if not set(given) <= set(base.parameters):
        raise InputError("given model.preset with more than two elements; leave the preset out and give all")
    valid = read_valid(table, base.outputs) or (None if given else base.valid)
    return replace(base, parameters=read_parameters(table, base.parameters), valid=valid)


def _output(given: Any) -> str:
    """What comes out of a model whose k1 is `given`."""
    for name, unit in _OUTPUTS.items():
        try:
            amount(given, f"kPa/{unit}", "model.k1")
        except InputError:
            continue
        return name
    raise InputError(
        f"given {brief(given)} for model.k1: a pressure a displacement is needed, '82.85 kPa/mm'"
    )
