"""The contract's table: family of each name, and which names one output alone cannot tell apart."""

from __future__ import annotations

FAMILY = {
    **dict.fromkeys(["hysteresis", "friction"], "rate-independent"),
    "creep": "viscoelastic",
    **dict.fromkeys(["viscous-lag", "inertia"], "rate"),
    **dict.fromkeys(["pressure-lag", "delay", "dead-band", "leak", "saturation"], "pneumatic"),
    **dict.fromkeys(["sensor-lag", "sensor-drift", "sensor-nonlinearity", "quantisation"], "sensor"),
    **dict.fromkeys(["mullins", "fatigue", "temperature", "delamination"], "history"),
    **dict.fromkeys(["gravity", "payload"], "load"),
    **dict.fromkeys(
        ["contact", "stiffening", "wall-thickness", "base-compliance", "snap-through"], "structure"
    ),
    **dict.fromkeys(["chamber-gain", "cross-coupling"], "asymmetry"),
}
SAME_FORM = {
    "wander": "sensor-drift: a power of the time",
    "coarse": "quantisation: equal steps",
    "threshold": "dead-band in the chamber: a softplus",
}
"""Forms of the generator that the library has too, parameters aside."""
_GROUPS = [
    {"hysteresis", "friction"},
    {"viscous-lag", "pressure-lag", "sensor-lag"},
    {"dead-band", "hysteresis", "friction"},
    {"fatigue", "temperature", "sensor-drift"},
    {"gravity", "payload"},
    {"contact", "stiffening", "wall-thickness", "sensor-nonlinearity", "base-compliance"},
]


def same_class(
    name: str, measured_pressure: bool = False, temperature: bool = False, several_loads: bool = False
) -> set[str]:
    """Names that count as right for a truth `name`, itself included, given what the records hold."""
    found = {name}
    for group in _GROUPS:
        # dead-band is a neighbour of hysteresis and friction, which are no neighbours through it
        if name in group and not (name in ("hysteresis", "friction") and "dead-band" in group):
            found |= group
    if name in ("hysteresis", "friction"):
        found.add("dead-band")
    apart: set[str] = set()
    if measured_pressure:
        apart |= {"pressure-lag", "delay", "dead-band"}
    if temperature:
        apart.add("temperature")
    if several_loads:
        apart |= {"gravity", "payload"}
    return {name} if name in apart else {name} | (found - apart)


def one_class(first: str, second: str) -> bool:
    """Whether one output alone cannot tell the two apart."""
    return second in same_class(first)
