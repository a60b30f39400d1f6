"""The slow module of the composite finger over the whole pressure range of its bench."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fem_spa.output.compare import cost
from fem_spa.run import run_deck

SUMMARY = "slow PneuNet module, nine chambers with common inner walls, to the 80 kPa of its bench"
DECK = Path(__file__).with_suffix(".toml")


def run(out: Path) -> int:
    """Solve the deck beside this file into `out`; prints the angle at the paper's pressures."""
    outcome = run_deck(DECK, out)
    print("pressure [kPa]   angle [deg]   angle a chamber [deg]")
    for row in outcome.result.rows:
        pressure = 1e-3 * row.pressure["slow"]
        if row.is_point and round(pressure) % 10 == 0:
            print(f"{pressure:14.0f} {np.degrees(row.angle):13.2f} {np.degrees(row.angle) / 9:23.3f}")
    print(cost("slow_module", outcome.record))
    return outcome.exit_status
