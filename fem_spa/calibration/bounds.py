"""What a number may become by calibration before it stands for an effect that the model lacks.

A measured I-SUPPORT arm fitted without bounds came out with a density of 6471 instead of 1104 kg/m3 and 43
times the damping: the fit was good, the model wrong. So numbers stay within what spread of material, mould
and print can do; one that wants to leave is not accepted but reported.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Bounds:
    """low, high : factors of the starting value;  why : what sets them"""

    low: float
    high: float
    why: str


_OF_MATERIAL = Bounds(0.5, 2.0, "batches and tests of one rubber differ by less than a factor of two")
_HIGHER = Bounds(0.1, 10.0, "of the higher terms a test fixes little more than the order of magnitude")
_SHAPE = Bounds(0.3, 3.0, "of the law's shape a test fixes no more than a factor of three")


def bounds_of(name: str, unit: str) -> Bounds:
    """Factors between which a knob of an FE problem may move, by its dotted name and SI unit."""
    group, _, word = name.rpartition(".")
    if group.startswith("materials"):
        if word == "density":
            return Bounds(0.9, 1.1, "a density is weighed to a few per cent")
        if word == "bulk":
            return Bounds(0.1, 10.0, "bulk moduli of rubber span an order of magnitude")
        if word == "scale" or word in ("C10", "mu", "mu1", "E", "Gc"):
            return _OF_MATERIAL
        return _HIGHER if unit == "Pa" else _SHAPE
    if group.startswith("layers"):
        if word == "modulus":
            return Bounds(0.1, 10.0, "sheets of paper and fabric differ by an order of magnitude")
        return Bounds(0.5, 2.0, "a sheet's thickness is measured better than that")
    if group.startswith("walls"):
        return Bounds(0.8, 1.25, "cast and printed walls are off by less than a quarter")
    if group.startswith("geometry"):
        return Bounds(0.8, 1.25, "a drawing's lengths are kept better than that")
    return Bounds(0.1, 10.0, "an order of magnitude")


_OF_MODELS = (
    (("density", "mass"), Bounds(0.8, 1.25, "a mass is weighed, a density known, to a few per cent")),
    (
        ("length", "distance", "radius", "width", "height", "wall", "pitch"),
        Bounds(0.8, 1.25, "it is measured"),
    ),
    (("angle", "gravity_acceleration", "poisson"), Bounds(0.9, 1.1, "it is known")),
    (("damping",), Bounds(0.1, 10.0, "damping of one rubber spans an order of magnitude")),
    (
        ("modulus", "stiffness", "k_theta", "C10", "mu"),
        Bounds(0.3, 3.0, "a factor of three is much"),
    ),
)


def plausible(name: str, value: float, low: float, high: float, kind: str) -> tuple[float, float, str]:
    """Bounds (SI) of a reduced model's parameter: its own, and for what can be weighed or measured narrower.

    Parameters
    ----------
    name, kind : of the parameter and its model;  value : where it starts;  low, high : its own bounds
    """
    why = "the model's own bounds"
    if value <= 0 or kind in ("curve", "kelvin-voigt"):
        return low, high, why
    for words, bounds in _OF_MODELS:
        if any(name == word or name.endswith(f"_{word}") for word in words):
            return max(low, bounds.low * value), min(high, bounds.high * value), bounds.why
    return low, high, why


def missing_effect(name: str, kind: str) -> str:
    """Words for effects that a number which leaves its bounds may stand for."""
    word = name.rpartition(".")[2]
    if word in ("density", "mass"):
        return "gravity that is too weak or too strong: payload, or a tube that pulls"
    if word.startswith(("damping", "eta", "viscos")) or word in ("tau", "rise", "drop"):
        return "viscous-lag, pressure-lag or sensor-lag"
    if word.startswith("gain") or word in ("strain_gains",):
        return "stiffening, contact, chamber-gain or cross-coupling"
    if kind == "finite elements":
        return "wall-thickness, contact, mullins, leak or sensor-nonlinearity"
    return "contact, stiffening, gravity, hysteresis or creep"
