"""The fast module of the composite finger to the largest pressure of its bench, with contact and without."""

from __future__ import annotations

import math
from pathlib import Path

from fem_spa.output.compare import at, cost, draw
from fem_spa.run import Outcome, run_deck

SUMMARY = (
    "fast PneuNet module, six separate chambers to 40 kPa; what contact of their walls adds to the angle"
)
DECK = Path(__file__).with_suffix(".toml")

WITHOUT = ["loads.contact=false", "loads.pressure='6.6 kPa'", "loads.path=['1 kPa', '2 kPa', '4 kPa']"]
"""Beyond this pressure the walls have passed through one another wholly."""

EVIDENCE, EVIDENCE_DEG = (4.0, 6.6), "20 and 33"
"""kPa, and the angles there of the trial before this project, whose mesh the verification keeps."""

REMARK = """Where the walls touch, the angle's slope grows: they push one another apart, which bends
the module more. Without contact they pass through one another, and the angle comes out too low. Yu et
al. (2022) print no curve of the fast module that could stand beside this one; its bench goes to 40 kPa."""


def run(out: Path) -> int:
    """Solve the deck beside this file with contact into `out`, and without into a folder in it."""
    done = {"contact": run_deck(DECK, out), "contact off": run_deck(DECK, out / "contact_off", WITHOUT)}
    curves = {name: curve(outcome) for name, outcome in done.items()}
    print("pressure [kPa]   contact [deg]   contact off [deg]")
    for row in done["contact"].result.rows:
        if row.is_point:
            p = row.pressure["fast"] / 1e3
            texts = [f"{v:.2f}" if math.isfinite(v) else "" for v in (at(*c, p) for c in curves.values())]
            print(f"{p:14.1f} {texts[0]:>15s} {texts[1]:>19s}")
    touch = done["contact"].result.touch_pressure
    if touch:
        print(f"The walls first touch at {touch['fast'] / 1e3:.2f} kPa.")
    parts = [f"{at(*curves['contact'], p):.1f} deg at {p} kPa" for p in EVIDENCE]
    print(f"{' and '.join(parts)}: the {EVIDENCE_DEG} deg of the design evidence are those of another mesh,")
    print("whose lowest millimetre is a stiffer rubber instead of the paper (docs/verification.md).")
    print(REMARK)
    low = {name: within(c, 7.0) for name, c in curves.items()}
    draw(
        out / "contact.png",
        "Fast module: what contact does",
        ("pressure [kPa]", "bending angle [deg]"),
        low,
        None,
        {"first touch": touch["fast"] / 1e3} if touch else {},
    )
    for name, outcome in done.items():
        print(cost(name, outcome.record))
    return max(outcome.exit_status for outcome in done.values())


def curve(outcome: Outcome) -> tuple[list[float], list[float]]:
    """kPa and deg of every step."""
    rows = outcome.result.rows
    return [row.pressure["fast"] / 1e3 for row in rows], [math.degrees(row.angle) for row in rows]


def within(given: tuple[list[float], list[float]], highest: float) -> tuple[list[float], list[float]]:
    """The part of a curve up to a pressure, kPa."""
    kept = [(p, a) for p, a in zip(*given, strict=True) if p <= highest]
    return [p for p, _ in kept], [a for _, a in kept]
