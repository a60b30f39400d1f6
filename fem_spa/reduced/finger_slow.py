r"""Slow module of the composite finger: a chamber's angle by equilibrium of moments about the paper.

The paper keeps its length and carries whatever force along the finger is needed, so moments about it do not
contain that force. A fibre at height z above the paper (below: z < 0) of a chamber that turns by theta over
its pitch l1 has the stretch (9)

    lambda = (R + z) theta / l1 = 1 + z theta / l1,            R theta = l1.

Widths of a section keep their length (lambda_3 = 1), so the rubber is in plane strain and its nominal
stress is (7), or linearised (8):

    (7) sigma = 2 (lambda - lambda^-3) [C10 + 2 C20 (lambda - 1/lambda)^2]
    (8) sigma = 8 C10 (lambda - 1).

Pressure acts on the air's section, w1 wide and h1 high with a half disc of radius r1 on it, over the layer
t1:

    M_D = P S,   S = int z dA over the air                                        (11), whose W is w1.

The rubber resists with M_R = int sigma(lambda(z)) z dA over the rubber's section, (12). Its widths, from the
drawing of the section:

    below the paper    0 < -z < t2        w2                     print: W, not defined, and t1 for t2
    above it           0 < z < t1         w2                     print: none
    two walls          t1 < z < t1 + h1   (w2 - w1) / 2 each     print: none (it is 1 mm here)
    top                two half discs, r2 less r1, centred at z = t1 + h1                as printed

(in the top's crown the print's integral over t7 = r2 - r1 is the half disc above r1). With (8),
M_R = 8 C10 I theta / l1, I = int z^2 dA: 11 238 mm^4, from the print in millimetres with W = w2 11 187 mm^4,
so the slip is worth 0.5 %. theta = P S l1 / (8 C10 I): 3.41 deg a chamber at 20 kPa.

The inner walls between chambers (t5) are in neither: their pressures balance, and they are counted as if they
bent like the chambers.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fem_spa.reduced.finger_solve import smooth, solve_increasing

_ORDER = 24


def strips(size: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Heights z (m) over the paper and signed areas (m^2) of a quadrature of the rubber's section.

    Exact for polynomials in z over the flat parts, to 1e-12 over the discs.
    """
    x, weight = np.polynomial.legendre.leggauss(_ORDER)
    x, weight = 0.5 * (x + 1.0), 0.5 * weight
    t1, t2, h1 = size["t1"], size["t2"], size["h1"]
    heights, areas = [], []
    for low, high, width in (
        (-t2, 0.0, size["w2"]),
        (0.0, t1, size["w2"]),
        (t1, t1 + h1, size["w2"] - size["w1"]),
    ):
        heights.append(low + (high - low) * x)
        areas.append(width * (high - low) * weight)
    for radius, sign in ((size["r2"], 1.0), (size["r1"], -1.0)):
        turned = 0.5 * np.pi * x  # z = radius sin: no singular end
        heights.append(t1 + h1 + radius * np.sin(turned))
        areas.append(sign * 2.0 * (radius * np.cos(turned)) ** 2 * 0.5 * np.pi * weight)
    return np.concatenate(heights), np.concatenate(areas)


def drive_moment(size: Mapping[str, float]) -> float:
    """S of (11), m^3: moment about the paper a pressure."""
    t1, h1, r1 = size["t1"], size["h1"], size["r1"]
    walls = size["w1"] * h1 * (t1 + 0.5 * h1)
    return walls + 0.5 * np.pi * r1**2 * (t1 + h1) + 2.0 / 3.0 * r1**3


def second_moment(size: Mapping[str, float]) -> float:
    """I = int z^2 dA of the rubber about the paper, m^4."""
    z, area = strips(size)
    return float(area @ z**2)


def stress(stretch: np.ndarray, C10: float, C20: float, law: str) -> np.ndarray:
    """Nominal stress in plane strain, Pa: (8) for `law` "linear", (7) for "yeoh"."""
    if law == "linear":
        return 8.0 * C10 * (stretch - 1.0)
    return 2.0 * (stretch - stretch**-3) * (C10 + 2.0 * C20 * (stretch - 1.0 / stretch) ** 2)


def stress_slope(stretch: np.ndarray, C10: float, C20: float, law: str) -> np.ndarray:
    """Derivative of `stress` by the stretch, Pa."""
    if law == "linear":
        return np.full_like(stretch, 8.0 * C10)
    s, difference = stretch, stretch - 1.0 / stretch
    inner = C10 + 2.0 * C20 * difference**2
    return 2.0 * (1.0 + 3.0 * s**-4) * inner + 8.0 * C20 * (s - s**-3) * difference * (1.0 + s**-2)


def pressure(angle: np.ndarray, size: Mapping[str, float], law: str = "linear") -> np.ndarray:
    """Pressure (Pa) at which a chamber turns by `angle` (rad, any shape): M_R / S."""
    z, area = strips(size)
    turn = np.asarray(angle, float)[..., None]
    moment = stress(1.0 + z * turn / size["l1"], size["C10"], size["C20"], law) @ (area * z)
    return np.asarray(moment / drive_moment(size))


def angle(pressure_: np.ndarray, size: Mapping[str, float], law: str = "linear") -> np.ndarray:
    """Turn of a chamber (rad) at pressures (Pa, any shape); with (7) between -30 and 100 deg a chamber."""
    P = np.asarray(pressure_, float)
    z, area = strips(size)
    S, l1 = drive_moment(size), size["l1"]
    turn_each = S * l1 / (8.0 * size["C10"] * float(area @ z**2))
    if law == "linear":
        return P * turn_each
    highest = 0.95 * l1 / max(float(z.max()), 1e-9)
    low, high = -highest, min(20.0 * highest, 0.9 * l1 / max(size["t2"], 1e-9))

    def slope(turn: np.ndarray) -> np.ndarray:
        stretch = 1.0 + z * turn[..., None] / l1
        return stress_slope(stretch, size["C10"], size["C20"], law) @ (area * z**2) / (l1 * S)

    def solved(p: np.ndarray) -> np.ndarray:
        return solve_increasing(lambda turn: pressure(turn, size, law), slope, p, low, high, turn_each * p)

    return smooth(solved, P)
