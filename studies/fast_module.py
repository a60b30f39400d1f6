"""The fast module of the composite finger, up to where its walls touch."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fem_spa.run import run_deck

SUMMARY = "fast PneuNet module, six separate chambers, inflated until its walls touch one another"
DECK = Path(__file__).with_suffix(".toml")


def run(out: Path) -> int:
    """Solve the deck beside this file into `out`; prints the pressure of first touch."""
    outcome = run_deck(DECK, out)
    touch = outcome.result.touch_pressure
    last = outcome.result.rows[-1]
    angle = np.degrees(last.angle)
    if touch is None:
        print(f"The walls do not touch up to {1e-3 * last.pressure['fast']:.3g} kPa ({angle:.2f} deg).")
    else:
        print(
            f"The walls touch at {1e-3 * touch['fast']:.3g} kPa; just before, the tip has turned by "
            f"{angle:.2f} deg.\nFrom there on the chambers push one another apart, which bends the module "
            "more: contact is not\npart of this version, so the curve ends here. Yu et al. (2022) go on to "
            "40 kPa."
        )
    return outcome.exit_status
