"""Smooth truths: what an undisturbed actuator does, given to the program as its base model.

Families of static maps (angle over pressure), and two Kelvin-Voigt elements in series (displacement).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from benchmarks.loop.session import Line

FAMILIES = ("soft-s", "power", "exponential", "rational", "late")


@dataclass(frozen=True)
class Base:
    """The undisturbed actuator.

    Attributes
    ----------
    family, material : of the draw
    span : rad or m, output at the largest pressure;  top : Pa
    shape : two numbers of the family
    gain, offset : true output = gain * curve + offset, which the program must refit
    springs : k1, k2 (Pa/m), eta1, eta2 (Pa s/m) of a Kelvin-Voigt base, else empty
    table : (n, 2) Pa, rad of a curve that was given, from FE say; else None. Linear beyond its end.
    """

    family: str
    material: str
    span: float
    top: float
    shape: tuple[float, float]
    gain: float
    offset: float
    springs: tuple[float, ...] = field(default=())
    table: np.ndarray | None = field(default=None)

    @property
    def output(self) -> str:
        return "displacement" if self.springs else "angle"

    def curve(self, pressure: np.ndarray) -> np.ndarray:
        """Static map as the program is given it, (n,) rad; odd below zero pressure."""
        if self.table is not None:
            return self._between(pressure)
        x = np.abs(pressure) / self.top
        a, b = self.shape
        return np.sign(pressure) * self.span * _FORMS[self.family](x, a, b) / _FORMS[self.family](1.0, a, b)

    def _between(self, pressure: np.ndarray) -> np.ndarray:
        """The given curve: Akima's piecewise cubic through its points."""
        assert self.table is not None
        p, y = self.table.T
        inside = np.asarray(Akima1DInterpolator(p, y)(np.clip(pressure, p[0], p[-1])))
        slope = (y[-1] - y[-2]) / (p[-1] - p[-2])
        return inside + slope * np.maximum(pressure - p[-1], 0) + y[1] / p[1] * np.minimum(pressure - p[0], 0)

    def static(self, pressure: np.ndarray) -> np.ndarray:
        """The true static output of a pressure, (n,)."""
        if self.springs:
            return self.gain * pressure * (1 / self.springs[0] + 1 / self.springs[1]) + self.offset
        return self.gain * self.curve(pressure) + self.offset

    def respond(self, line: Line, pressure: np.ndarray) -> np.ndarray:
        """The true output over the line, (n,), for the pressure that acts."""
        if not self.springs:
            return self.static(pressure)
        k1, k2, eta1, eta2 = self.springs
        step = line.step
        total = np.zeros(len(pressure))
        for k, eta in ((k1, eta1), (k2, eta2)):
            decay = np.exp(-step * k / eta)
            x = pressure[0] / k
            for i in range(len(pressure)):
                mean = pressure[i] if i == 0 else 0.5 * (pressure[i] + pressure[i - 1])
                x = x * decay[i] + (1 - decay[i]) * mean / k
                total[i] += x
        return self.gain * total + self.offset


def _soft_s(x: np.ndarray, a: float, b: float) -> np.ndarray:
    return x * (1 + a * x) / (1 + b * x**2)


def _power(x: np.ndarray, a: float, b: float) -> np.ndarray:
    return x + a * x ** (1.5 + b)


def _exponential(x: np.ndarray, a: float, b: float) -> np.ndarray:
    return np.expm1((0.3 + a) * x) + 0.2 * b * x


def _rational(x: np.ndarray, a: float, b: float) -> np.ndarray:
    return x / (1 + 0.5 * a * x) * (1 + b * x)


def _late(x: np.ndarray, a: float, b: float) -> np.ndarray:
    return np.log1p((0.2 + b) * x**2) + (0.3 + a) * x


_FORMS: dict[str, Callable[..., np.ndarray]] = {
    "soft-s": _soft_s,
    "power": _power,
    "exponential": _exponential,
    "rational": _rational,
    "late": _late,
}


def draw_base(rng: np.random.Generator, kind: str) -> Base:
    """A silicone or a printed TPU actuator; `kind` is "curve" or "kelvin-voigt"."""
    material = str(rng.choice(["silicone", "tpu"]))
    log = lambda low, high: float(np.exp(rng.uniform(np.log(low), np.log(high))))  # noqa: E731
    top = log(2e4, 9e4) if material == "silicone" else log(1e5, 3.5e5)
    gain, offset = float(rng.uniform(0.88, 1.12)), float(rng.normal(0, 0.01))
    shape = (float(rng.uniform(0.1, 1.0)), float(rng.uniform(0.05, 0.8)))
    family = str(rng.choice(FAMILIES))
    if kind == "curve":
        span = np.radians(rng.uniform(40, 160) if material == "silicone" else rng.uniform(25, 110))
        return Base(family, material, float(span), top, shape, gain, offset * span)
    span = float(rng.uniform(4e-3, 2e-2))
    share = float(rng.uniform(0.6, 0.9))
    k1, k2 = top / (span * share), top / (span * (1 - share))
    springs = (k1, k2, k1 * log(0.05, 0.4), k2 * log(1.5, 8.0))
    return Base("two elements", material, span, top, shape, 1.0, offset * span, springs)
