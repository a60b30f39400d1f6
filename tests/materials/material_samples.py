"""One believable parameter set a law, for tests that go over all of them."""

from __future__ import annotations

from materials.laws import LAWS
from materials.registry import resolve

SAMPLES: dict[str, dict[str, float]] = {
    "neo-hooke": {"C10": 2e5},
    "mooney-rivlin": {"C10": 1.1e5, "C01": 1e4},
    "yeoh": {"C10": 1.1e5, "C20": 2e4, "C30": 3e3},
    "ogden": {"mu1": 0.63e6, "alpha1": 1.3, "mu2": 0.0012e6, "alpha2": 5.0, "mu3": -0.01e6, "alpha3": -2.0},
    "gent": {"mu": 2e5, "Jm": 30.0},
    "arruda-boyce": {"mu": 2e5, "N": 8.0},
    "extended-tube": {"Gc": 2e5, "delta": 0.1, "Ge": 1e5, "beta": 0.3},
    "linear": {"E": 3.1e6, "nu": 0.5},
}


def parameters(name: str) -> dict[str, float]:
    """The sample of law `name`, every parameter of it."""
    assert name in SAMPLES, f"give a sample of law {name} in SAMPLES, so that it is tested"
    return resolve(LAWS[name], SAMPLES[name])
