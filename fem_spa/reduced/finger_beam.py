r"""The finger as a cantilever, for comparison: the conventional model of Yu et al. (2022), section 4.

The paper cites it without its formulas; this is Euler-Bernoulli as the text tells it. A module is a
straight beam clamped at its base, with one bending moment along it, the pressure's about the paper, M = P
S. The rubber is linear, E = 6 C10 (incompressible, 3 mu), stresses uniaxial, and the curvature is M / (E I)
with the second moment I of the rubber's section about the paper.

A slow chamber has one section over its pitch l1. A fast chamber has two in turn: its own over l3, and the
bridge's, a slab of width w4 from -t2 to t1 + t3, over the gap l2. Neighbours press each other over the gap
with what the air presses on their walls, so that the moment is the same there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fem_spa.reduced.finger_slow import drive_moment, second_moment


def slow_angle(pressure: np.ndarray, size: Mapping[str, float]) -> np.ndarray:
    """Turn of a slow chamber (rad) at pressures in Pa."""
    bending = 6.0 * size["C10"] * second_moment(size)
    return np.asarray(pressure, float) * drive_moment(size) * size["l1"] / bending


def fast_angle(pressure: np.ndarray, size: Mapping[str, float]) -> np.ndarray:
    """Turn of a fast chamber and a gap (rad) at pressures in Pa."""
    chamber = dict(size) | {"w1": size["w3"], "w2": size["w4"], "h1": size["h2"]}
    chamber |= {"r1": size["r3"], "r2": size["r4"]}
    bridge = size["w4"] * (size["t2"] ** 3 + (size["t1"] + size["t3"]) ** 3) / 3.0
    flexibility = size["l3"] / second_moment(chamber) + size["l2"] / bridge
    return np.asarray(pressure, float) * drive_moment(chamber) * flexibility / (6.0 * size["C10"])
