"""The linear zig-zag actuator over its whole pressure range: extension."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fem_spa.output.compare import at, cost, draw
from fem_spa.run import Outcome, run_deck

SUMMARY = "linear zig-zag actuator, 0 to 350 kPa: its extension, the paper's 40 mm beside it"
DECK = Path(__file__).with_suffix(".toml")

REMARK = """The paper prints neither the number nor the width of the chambers; the 22 chambers of 5.5
mm here are chosen so that this figure comes out, with the stated modulus of 26 MPa. What they then say
of the bending actuator (study zigzag_bending) is free of choice. The modulus is that of small strains:
the card cheetah, fitted from a stretch of 1.34 on, is a fifth as stiff at rest. The card tpu-95a is a
stated modulus for strains of some 20 %, and the rubber is stretched further here (below): from there on
the curve is that of neo-Hooke's law, of which no test is at hand. The tip leans, since the outer joints
open less freely than the others."""

PAPER = (350.0, 40.0)
"""kPa, mm: Table I of the zig-zag paper, the ends of pressure and extension range."""

STATED = 1.2
"""The stretch up to which the card's modulus is stated."""


def run(out: Path) -> int:
    """Solve the deck beside this file into `out`; prints and draws the extension over pressure."""
    outcome = run_deck(DECK, out)
    rows = [row for row in outcome.result.rows if row.motion is not None]
    pressure = [row.pressure["main"] / 1e3 for row in rows]
    stroke = [1e3 * row.motion.extension for row in rows if row.motion is not None]
    print("pressure [kPa]   extension [mm]   angle of the tip [deg]")
    for row, p, x in zip(rows, pressure, stroke, strict=True):
        if row.is_point:
            print(f"{p:14.0f} {x:16.2f} {np.degrees(row.angle):24.2f}")
    ours = at(pressure, stroke, PAPER[0])
    print(f"At {PAPER[0]:.0f} kPa: {ours:.1f} mm; the paper's range ends at {PAPER[1]:.0f} mm.")
    print(REMARK)
    print(leaves(outcome))
    draw(
        out / "extension.png",
        "Linear zig-zag actuator",
        ("pressure [kPa]", "extension [mm]"),
        {"FE": (pressure, stroke)},
        {"end of the paper's range": ([PAPER[0]], [PAPER[1]])},
    )
    print(cost("zigzag_linear", outcome.record))
    return outcome.exit_status


def leaves(outcome: Outcome) -> str:
    """Where the largest stretch passes the strains that the card stands for, and where it ends."""
    rows = outcome.result.rows
    first = next((row for row in rows if row.max_stretch > STATED), None)
    last = f"{rows[-1].max_stretch:.2f} at {rows[-1].pressure['main'] / 1e3:.0f} kPa"
    if first is None:
        return f"Largest stretch: {last}, within the card's."
    begin = f"{first.pressure['main'] / 1e3:.0f} kPa"
    return (
        f"Largest principal stretch: above {STATED} from {begin} on, {last}. (The card's warning comes "
        "later, where the invariants leave those of such stretches.)"
    )
