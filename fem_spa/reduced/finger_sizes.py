"""Sizes, rubber and corrections of the composite finger as parameters (Yu et al. 2022, Table 1)."""

from __future__ import annotations

import math
from collections.abc import Mapping

from fem_spa.reduced.model import Parameter

TABLE = "Yu et al. (2022), Table 1"
RUBBER = "Yu et al. (2022), section 3.2: Dragon Skin 30, Yeoh"

SIZES: dict[str, tuple[float, str]] = {
    "w1": (18.0, "inner width of a slow chamber"),
    "w2": (20.0, "outer width of the slow module"),
    "w3": (16.0, "inner width of a fast chamber"),
    "w4": (20.0, "outer width of the fast module"),
    "r1": (9.0, "radius of a slow chamber's inner top"),
    "r2": (10.0, "radius of the slow module's outer top"),
    "r3": (8.0, "radius of a fast chamber's inner top"),
    "r4": (10.0, "radius of a fast chamber's outer top"),
    "h1": (10.0, "height of a slow chamber's straight walls"),
    "h2": (10.0, "height of a fast chamber's straight walls"),
    "l1": (9.0, "pitch of the slow chambers"),
    "l2": (2.0, "gap between fast chambers"),
    "l3": (5.0, "outer length of a fast chamber"),
    "t1": (2.0, "layer between paper and air"),
    "t2": (2.0, "layer under the paper"),
    "t3": (3.0, "bridge between fast chambers, above t1"),
    "t4": (1.0, "lateral wall of a fast chamber"),
}
"""Symbol -> mm and meaning. t5, t6, t7 of the table (inner walls, crowns) are in none of the formulas."""

BASE = ("stiffness", "offset")
"""What `diagnose` refits before it looks for an effect: one stiffness and an offset."""
CALIBRATED = ("slow_stiffness", "fast_stiffness", "fast_bending", "offset")
"""What `calibrate` fits: a factor on the rubber's moduli in each module, module two's bending besides what
squeezing gives, and an offset of the angle. Where the gap shows, at pressures of a few kPa, also
`fast_touch`, at which the walls meet, and `fast_squeezing`, a factor on the turn that pressing walls give.

C10 and C20 are not among them: C10 acts as the factors do, and C20 is hardly seen (a tenth of a per cent of
the egg example's angle). `stiffness` multiplies both factors, so fit it or the two, not all three.
"""


def parameters() -> dict[str, Parameter]:
    """Name -> Parameter, the paper's values; lengths 0.1 to 200 mm, gaps and layers from zero."""
    found = {}
    for name, (size, _) in SIZES.items():
        low = 0.0 if name in ("l2", "t1", "t2", "t3") else 1e-4
        found[name] = Parameter(1e-3 * size, "mm", low, 0.2, TABLE)
    found["C10"] = Parameter(0.11e6, "MPa", 1e2, 1e8, RUBBER)
    found["C20"] = Parameter(0.02e6, "MPa", 0.0, 1e8, RUBBER)
    one = "1: the moduli as given; to be calibrated"
    for name in ("stiffness", "slow_stiffness", "fast_stiffness"):
        found[name] = Parameter(1.0, "", 0.05, 20.0, one)
    one_turn = "1: the crowns' turn as derived, walls that do not flatten; to be calibrated"
    none = "0: not in the paper's model, whose chambers bend by squeezing alone; to be calibrated"
    found["fast_bending"] = Parameter(0.0, "deg/kPa", 0.0, math.radians(20.0) / 1e3, none)
    found["fast_touch"] = Parameter(0.0, "kPa", 0.0, 40e3, "0: (16) knows no gap; to be calibrated")
    found["fast_squeezing"] = Parameter(1.0, "", 0.05, 5.0, one_turn)
    found["offset"] = Parameter(0.0, "deg", -3.2, 3.2, "0: straight at rest; to be calibrated")
    return found


def values(parameters: Mapping[str, Parameter]) -> dict[str, float]:
    """Name -> value in SI."""
    return {name: p.value for name, p in parameters.items()}
