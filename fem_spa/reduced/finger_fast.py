r"""Fast module of the composite finger: its angle by virtual work, (13)-(20), and what theta_2 is.

**What (13) says.** The pressure's work goes into the rubber, P dV_p = V_S dW, V_p = V_T - V_S. V_S, the
rubber of one chamber and one gap, is (14), whose h3 is h2 and whose 2 t1 is t1 + t2; V_T is lambda times
the block V_0 at rest, the bracket of (15). With W of (5), d lambda / d theta_2 stands on both sides and
cancels: (20) is a relation between pressure and stretch, whatever the angle is,

    P = (V_S / V_0) W'(lambda),     W' = 2 (lambda - lambda^-3) [C10 + 2 C20 (lambda - 1/lambda)^2].

**What theta_2 is.** The angle enters by (16) alone, lambda = R theta_2 / (R sin theta_2): arc over chord,
and theta_2 is half the opening of the arc, the angle between chord and tangent at its end. It cannot be an
arc of the layer at the bottom, which keeps its length. What bulges is the lateral wall, the thinnest one.
So theta_2 is half the opening of the bulged lateral wall, and a chamber's turn follows from how neighbours
squeeze each other:

- A wall of free height H, bulged to the half opening theta_2, stands off its plane by (H / 2) tan(theta_2/2)
  at its crown, half way up (the inscribed angle). It is free above the bridge: H = h2 + r3 - t3.
- Chambers turn about the paper, which keeps its length, as in the slow module. The crown is at the height
  c = t1 + t3 + H / 2 over it. The crowns of two neighbours meet in the plane between
  them, from which each is turned by

      tan(turn / 2) = (H / 2) tan(theta_2 / 2) / c.

- n2 chambers have n2 - 1 gaps:  alpha = 2 (n2 - 1) arctan[(H / 2c) tan(theta_2 / 2)].

Two things are assumed in this. At theta_2 = 0 flat walls touch: (16) knows no gap l2, nor does this (in the
FE solution the gap closes at 1.3 to 1.5 kPa; bulges reckoned from (20) would need 7 kPa for it;
`fast_touch` of finger_sizes.py lets it close where it does). And the walls flatten where they press each
other: rigid arcs would meet below their crowns, at 13.9 kPa with a turn 11 % larger.

With Table 1, H / 2c = 0.6, and alpha is 0.6 (n2 - 1) / n2, half, of n2 theta_2: the print takes theta_2
itself for a chamber's turn. Six chambers at 13.9 kPa: theta_2 = 21.5 deg, n2 theta_2 = 129 deg, alpha =
65.1 deg. The example of the egg asks for 100.4 deg less module one's (35.9 deg by (7), 30.7 deg by (8)):
64.5 or 69.7 deg.

`reading` "crowns" is this; "printed" takes n2 theta_2.

**Limits of both.** The angle starts as the root of the pressure, with an infinite slope, and flattens; a
finger starts linearly, by bending of each chamber alone, which is not in here (`fast_bending` of
finger_sizes.py adds it once it is known). FE with contact has 36, 67, 117, 203 deg at 5, 10, 20, 40 kPa
(studies/finger_map.py), "crowns" 39, 55, 79, 114, "printed" 77, 109, 156, 222 deg. Below zero the walls
part and squeeze nothing: no angle."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from fem_spa.reduced.finger_solve import smooth, solve_increasing

READINGS = ("crowns", "printed")
_LARGEST = 3.0  # rad, of theta_2: theta / sin theta is 21 there


def rubber_volume(size: Mapping[str, float]) -> float:
    """V_S of (14), m^3: a chamber's walls, its part of the layers, and one gap's bridge."""
    air = (size["l3"] - 2.0 * size["t4"]) * (0.5 * np.pi * size["r3"] ** 2 + size["w3"] * size["h2"])
    return block_volume(size) - float(air)


def block_volume(size: Mapping[str, float]) -> float:
    """V_0, m^3: air and rubber of a chamber and one gap, the bracket of (15)."""
    layers = size["t1"] + size["t2"]
    chamber = 0.5 * np.pi * size["r4"] ** 2 + size["w4"] * (size["h2"] + layers)
    return float(size["l3"] * chamber + (layers + size["t3"]) * size["w4"] * size["l2"])


def lever(size: Mapping[str, float]) -> float:
    """H / 2c: half the free height of a lateral wall over its crown's height above the paper."""
    half = 0.5 * (size["h2"] + size["r3"] - size["t3"])
    return half / (size["t1"] + size["t3"] + half)


def stretch(opening: np.ndarray) -> np.ndarray:
    """lambda of (16), theta / sin theta, for half opening angles in rad, (-pi, pi)."""
    return np.asarray(1.0 / np.sinc(np.asarray(opening, float) / np.pi))


def stretch_slope(opening: np.ndarray) -> np.ndarray:
    """(19): (sin - theta cos) / sin^2, from its series near zero."""
    t = np.asarray(opening, float)
    safe = np.where(np.abs(t) < 1e-3, 1.0, t)
    whole = (np.sin(safe) - safe * np.cos(safe)) / np.sin(safe) ** 2
    return np.where(np.abs(t) < 1e-3, t / 3.0 * (1.0 + 7.0 * t**2 / 15.0), whole)


def opening(pressure_: np.ndarray, size: Mapping[str, float]) -> np.ndarray:
    """theta_2 (rad) of (20) at pressures (Pa, any shape); zero below zero, 3 rad at most."""
    root = np.sqrt(np.maximum(np.asarray(pressure_, float), 0.0))
    ratio = rubber_volume(size) / block_volume(size)
    C10, C20 = size["C10"], size["C20"]
    early = math.sqrt(6.0 / (8.0 * C10 * ratio))  # near zero P = 8 C10 ratio theta^2 / 6

    def slope(t: np.ndarray) -> np.ndarray:
        s = stretch(t)
        difference = s - 1.0 / s
        inner = C10 + 2.0 * C20 * difference**2
        second = 2.0 * (1.0 + 3.0 * s**-4) * inner + 8.0 * C20 * (s - s**-3) * difference * (1.0 + s**-2)
        return ratio * second * stretch_slope(t)

    def solved(r: np.ndarray) -> np.ndarray:
        start = np.minimum(early * r, 0.5 * _LARGEST)
        return solve_increasing(lambda t: opening_pressure(t, size), slope, r**2, 0.0, _LARGEST, start)

    return smooth(solved, root)


def opening_pressure(opening_: np.ndarray, size: Mapping[str, float]) -> np.ndarray:
    """(20): pressure (Pa) at half opening angles theta_2 (rad, any shape, 0 to below pi)."""
    t = np.asarray(opening_, float)
    s = stretch(t)
    # lambda - 1 without cancellation: (theta - sin theta) / sin theta
    small = np.abs(t) < 1e-2
    sine = np.sin(np.where(small, 1.0, t))
    e = np.where(small, t**2 / 6.0 * (1.0 + 7.0 * t**2 / 60.0), (t - sine) / sine)
    grown = e * (2.0 + e) * (s**2 + 1.0) / s**3  # lambda - lambda^-3
    stiff = size["C10"] + 2.0 * size["C20"] * (e * (2.0 + e) / s) ** 2
    return np.asarray(rubber_volume(size) / block_volume(size) * 2.0 * grown * stiff)


def angle(
    pressure_: np.ndarray, size: Mapping[str, float], chambers: int, reading: str = "crowns"
) -> np.ndarray:
    """alpha, rad, of a module of `chambers` at pressures (Pa, any shape); zero below zero."""
    t = opening(pressure_, size)
    if reading == "printed":
        return chambers * t
    return 2.0 * (chambers - 1) * np.arctan(lever(size) * np.tan(0.5 * t))


def pressure(
    angle_: np.ndarray, size: Mapping[str, float], chambers: int, reading: str = "crowns"
) -> np.ndarray:
    """Pressure (Pa) at which a module of `chambers` has turned by `angle_` (rad, any shape, 0 or more).

    inf where no pressure turns it so far.
    """
    turned = np.asarray(angle_, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        if reading == "printed":
            t = turned / chambers
        else:
            half = turned / (2.0 * (chambers - 1))
            t = np.where(half < 0.5 * np.pi, 2.0 * np.arctan(np.tan(half) / lever(size)), np.inf)
        found = opening_pressure(np.minimum(t, _LARGEST), size)
        return np.where(turned == 0.0, 0.0, np.where(t <= _LARGEST, found, np.inf))
