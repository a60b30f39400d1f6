"""One zig-zag actuator as links: where its folds are, which of them the air opens, how stiff each is.

n segments of length d between n + 1 folds, at rest d leans by theta from the cross direction; solid ends of
length e before the first and behind the last fold. Folds lie by turns at y = +h/2 (even) and -h/2 (odd), h
= d cos theta. The air opens every fold by the same moment: at even folds it turns what lies behind to +y,
at odd ones to -y, (2): [t, -t, t, ...]. A limiting layer at y = +h/2 holds the distance of the even folds,
so that the odd ones between them cannot open: (3), [t, 0, t, ...], and the actuator bends to +y, towards
the layer.

Springs are linear in the paper. Where the layer is they may stiffen, k q (1 + s q^2): the linear actuator,
which gives the torque, opens its folds without a layer that turns along, and what stiffens in it is in
torque(p) already. `layer_stiffening` is s, 0 until it is calibrated.

The first and the last fold are half folds, between a segment and an end: twice as stiff, they open half as
far, and an actuator without layer stays straight. (The paper does not say what its model does there.)
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fem_spa.errors import InputError
from fem_spa.reduced.chain_links import Links
from fem_spa.reduced.curve import Curve
from fem_spa.reduced.model import Parameter


@dataclass(frozen=True, eq=False)
class Actuator:
    """What of an actuator is no number to be fitted.

    Attributes
    ----------
    segments : n
    layer : pieces of the limiting layer along the length, equally long: 1 there, 0 left out
    torque : Pa -> N m on a fold
    torques : factor of the torque on each of the n + 1 folds, sign included; None: (2) or (3) by the layer
    """

    segments: int
    layer: str
    torque: Curve
    torques: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if self.segments < 1:
            raise InputError(f"given {self.segments} segments; at least 1 is needed")
        if not self.layer or set(self.layer) - {"0", "1"}:
            raise InputError(
                f"given '{self.layer}' for the layer: '1' is a whole one, '0' none, '101' pieces"
            )
        if self.torques is not None and len(self.torques) != self.segments + 1:
            raise InputError(
                f"given {len(self.torques)} torques: {self.segments} segments have {self.segments + 1} folds"
            )

    def layered(self) -> np.ndarray:
        """(n + 1,) whether a fold lies in a piece with layer."""
        place = (np.arange(self.segments + 1) / max(self.segments, 1) * len(self.layer)).astype(int)
        return np.array([letter == "1" for letter in self.layer])[np.minimum(place, len(self.layer) - 1)]

    def pattern(self) -> np.ndarray:
        """(n + 1,) factor of the torque on each fold: (2) without layer, (3) with it."""
        if self.torques is not None:
            return np.array(self.torques, float)
        sign = 1.0 - 2.0 * (np.arange(self.segments + 1) % 2)
        return np.where(self.layered() & (sign < 0), 0.0, sign)

    def stiffness(self, values: Mapping[str, float]) -> np.ndarray:
        """(n + 1,) N m/rad: k_layer where the layer is, else k_theta; twice that at the ends' half folds."""
        k = np.where(self.layered(), values["k_layer"], values["k_theta"])
        return np.asarray(k / self.part())

    def stiffening(self, values: Mapping[str, float]) -> np.ndarray:
        """(n + 1,) 1/rad^2: of folds where the layer is; at the ends' half folds of twice the turn."""
        return np.asarray(np.where(self.layered(), values["layer_stiffening"], 0.0) / self.part() ** 2)

    def part(self) -> np.ndarray:
        """(n + 1,) of a whole fold: 1/2 for the first and the last, else 1."""
        return np.array([0.5, *[1.0] * (self.segments - 1), 0.5])

    def links(self, values: Mapping[str, float]) -> Links:
        """The actuator alone. Its mass is spread evenly over its length; segments are slender rods."""
        d, fold, end, mass = (values[name] for name in ("length", "fold", "end", "mass"))
        n = self.segments
        total = 2 * end + n * d * math.sin(fold)
        down = d * complex(math.sin(fold), -math.cos(fold))
        half = 0.5 * d * math.cos(fold)
        segment = np.where(np.arange(n) % 2 == 0, down, down.conjugate())
        tip = complex(end, half if n % 2 else -half)
        share = mass * end / total
        each = (mass - 2 * share) / n
        ends = end if end > 0 else 1e-9
        return Links(
            complex(end, half),
            np.append(segment, tip),
            np.append(0.5 * segment, tip - 0.5 * end),
            np.append(np.full(n, each), share if share > 0 else 1e-9 * mass),
            np.append(np.full(n, each * d**2 / 12), max(share, 1e-9 * mass) * ends**2 / 12),
            self.stiffness(values),
            values["damping"] / self.part(),
            self.part(),
            self.stiffening(values),
        )


def series(parts: list[Links]) -> Links:
    """Actuators end to end, the tip of one clamped to the base of the next.

    The base end of the next one joins the last body of the one before, its mass too.
    """
    whole = parts[0]
    for part in parts[1:]:
        vector = np.concatenate([whole.vector, part.vector])
        vector[whole.vector.size - 1] += part.start
        joined = [
            np.concatenate([getattr(whole, name), getattr(part, name)])
            for name in ("centre", "mass", "inertia", "stiffness", "damping", "part", "stiffening")
        ]
        centre, mass, inertia, stiffness, damping, folds, stiffening = joined
        last = whole.vector.size - 1
        end = complex(part.start.real, 0.0)
        extra = part.mass[-1]  # both ends of an actuator are alike
        apart = whole.vector[-1] + 0.5 * end - whole.centre[-1]
        both = mass[last] + extra
        inertia[last] += part.inertia[-1] + mass[last] * extra / both * abs(apart) ** 2
        centre[last] = whole.centre[-1] + apart * extra / both
        mass[last] = both
        whole = Links(whole.start, vector, centre, mass, inertia, stiffness, damping, folds, stiffening)
    return whole


def parameters(source: str) -> dict[str, Parameter]:
    """Names, units and bounds of an actuator's numbers, with the values of the linear actuator.

    Printed: k_theta (section IV A), mass, fold angle 45 deg between chambers. Not printed and chosen as in
    `geometry/zigzag.py`: 23 segments of 14.07 mm, so that they are as high as the actuator (13 mm) and 134 mm
    long with ends of 5.07 mm. With this chain the printed k_theta of the bending actuators (0.148 to
    0.166) would curl it up nine times as far as Table I says; k_layer is what gives Table I's 100 deg at
    350 kPa (`studies/zigzag_stiffness.py`). Damping is assumed: a time constant of 0.1 s, overdamped as in
    Fig. 10.
    """
    chosen = "assumed: 23 segments as high as the printed actuator"
    return {
        "k_theta": Parameter(1.3296, "N*m/rad", 1e-6, 1e4, f"{source}, section IV A"),
        "k_layer": Parameter(1.20982, "N*m/rad", 1e-6, 1e4, "makes 100 deg at 350 kPa, Table I"),
        "layer_stiffening": Parameter(0.0, "1/rad^2", 0.0, 1e4, "0: the paper's springs are linear"),
        "length": Parameter(13e-3 / math.cos(math.pi / 8), "mm", 1e-4, 1.0, chosen),
        "fold": Parameter(math.pi / 8, "deg", 0.01, 1.5, f"{source}, Table I: half of 45 deg"),
        "end": Parameter(0.5 * (134e-3 - 23 * 13e-3 * math.tan(math.pi / 8)), "mm", 0.0, 1.0, chosen),
        "mass": Parameter(13e-3, "g", 0.0, 10.0, f"{source}, Table I"),
        "damping": Parameter(0.13296, "N*m*s/rad", 0.0, 1e4, "assumed: 0.1 s of k_theta"),
    }


SEGMENTS = 23
REACH = np.array([350e3, 40e-3])
"""Pa and m: largest pressure and extension, Table I; the characteristic is linear, says the paper."""
