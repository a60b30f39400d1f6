"""An arm segment of three tubes and rings: FE beside the paper's rod, which has the tubes alone."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from fem_spa.output.compare import cost, draw
from fem_spa.run import run_deck
from geometry import SHAPES

SUMMARY = "arm segment of three tubes and rings, one tube inflated: tip angle, the rod's formula beside it"
DECK = Path(__file__).with_suffix(".toml")

REMARK = """What the rod leaves out: it takes the force p A_i on the closed end of a tube and not the pressure
on its wall. For small strains a closed tube of incompressible rubber keeps its length under inner
pressure (its strain along is p A_i / (E A) times 1 - 2 nu, and nu is 1/2): it widens, and grows shorter
by what the end's force lengthens it. In FE a tube lengthens, and the segment bends, only as far as rings
and ends keep it from widening, and by more a kPa the more it has widened. So the two do not agree,
neither in size nor in shape. The paper's E is fitted to its arm's stretching by the
rod's own formula (24), so that it holds for the rod and the arm's elliptical bellows, not for plain tubes.
The paper prints no angle over pressure (its figures 7 and 8 are of the tip's place): no bench stands here."""


def rod_angle(shape: object, modulus: float, pressure: float) -> float:
    """Angle of the tip (rad) by the arm paper, equations (14) to (22) and (33), one chamber inflated.

    Parameters
    ----------
    shape : the segment;  modulus : Young's, Pa;  pressure : Pa
    """
    r_o, r_i = shape.chamber_outer_radius, shape.chamber_inner_radius  # type: ignore[attr-defined]
    offset, length = shape.chamber_offset, shape.chamber_length  # type: ignore[attr-defined]
    wall = math.pi * (r_o**2 - r_i**2)
    second = sum(
        math.pi / 4 * (r_o**4 - r_i**4) + wall * (offset * math.sin(math.radians(at))) ** 2
        for at in (90, 210, 330)
    )
    moment = pressure * math.pi * r_i**2 * offset
    return moment / (modulus * second) * length


def run(out: Path) -> int:
    """Solve the deck beside this file into `out`; prints the angles of FE and rod."""
    outcome = run_deck(DECK, out)
    given = outcome.setup.resolved["geometry"]["shape"]
    shape = SHAPES[given](**sizes(outcome.setup.resolved["geometry"]))
    modulus = outcome.record["materials"]["body"]["youngs_modulus"]["value"]
    pressure = np.array([row.pressure["1"] for row in outcome.result.rows])
    angle = np.abs(np.degrees([row.angle for row in outcome.result.rows]))
    rod = np.degrees([rod_angle(shape, modulus, p) for p in pressure])
    print("pressure [kPa]   FE [deg]   rod [deg]   FE / rod")
    for row, p, fe, r in zip(outcome.result.rows, pressure, angle, rod, strict=True):
        if row.is_point and p:
            print(f"{p / 1e3:14.0f} {fe:10.2f} {r:11.2f} {fe / r:10.3f}")
    named = [i for i, row in enumerate(outcome.result.rows) if row.is_point and pressure[i]]
    parts = [
        f"{angle[i] / rod[i]:.2f} of the rod's angle at {pressure[i] / 1e3:.0f} kPa "
        f"({angle[i]:.1f} against {rod[i]:.1f} deg)"
        for i in (named[0], named[-1])
    ]
    print(f"FE has {parts[0]},\n{parts[1]}.")
    print(REMARK)
    draw(
        out / "angle.png",
        "Arm segment, chamber 1 inflated",
        ("pressure [kPa]", "tip angle [deg]"),
        {"FE": (pressure / 1e3, angle), "rod, linear in pressure": (pressure / 1e3, rod)},
    )
    print(cost("arm_segment", outcome.record))
    return outcome.exit_status


def sizes(table: dict[str, object]) -> dict[str, object]:
    """The parameters of a resolved [geometry] in SI."""
    from fem_spa.units import quantity
    from geometry.parameters import parameters

    known = {item.name: item for item in parameters(SHAPES[str(table["shape"])])}
    return {
        name: quantity(table[name], item.unit) if item.kind in ("length", "angle") else table[name]
        for name, item in known.items()
    }
