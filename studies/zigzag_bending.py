"""The bending zig-zag actuator: three thicknesses of its limiting layer, then the layer in pieces."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fem_spa.output.compare import at, cost, draw, table
from fem_spa.run import run_deck

SUMMARY = "bending zig-zag actuator, 0 to 350 kPa: limiting layers of 1, 1.5 and 2 mm, whole and in pieces"
DECK = Path(__file__).with_suffix(".toml")

REMARK = """What accounts for the difference: number and width of the chambers are not printed (they
were chosen by the extension of the linear actuator, not by these angles); the polyurethane's modulus
falls with strain, and is one number here, stated for strains of some 20 %; T2 and T6 are a guess at a
figure. Whether printed walls of 0.6 mm are thicker than drawn is a guess, too. The folds touch at their
own edges, beside the crease in which two chambers meet, not wall on wall."""

# Section IV-D: T1, T2 and T6 have a layer of 0.6 mm. Their figure is not at hand: T2 as two pieces and T6 as
# six pieces with gaps of a third of their length are what the names suggest.
CASES = {
    "T1, 1 mm": ("1 mm", "1"),
    "T1, 1.5 mm": ("1.5 mm", "1"),
    "T1, 2 mm": ("2 mm", "1"),
    "T1, 0.6 mm": ("0.6 mm", "1"),
    "T2, 0.6 mm": ("0.6 mm", "1110111"),
    "T6, 0.6 mm": ("0.6 mm", "11101110111011101110111"),
}
STIFFNESS = {"T1, 1 mm": 0.14791, "T1, 1.5 mm": 0.1538, "T1, 2 mm": 0.1659}
"""N m / rad a joint: Table II of the paper, found there from measured angles."""

RANGE = (350.0, 100.0)
"""kPa and deg: the ends of pressure and bending range in Table I of the paper."""


def run(out: Path) -> int:
    """Solve every case into a folder of its own under `out`; prints and draws the chord angles."""
    curves, costs, status = {}, [], 0
    print(f"{'':11s}  largest stretch   first touch [kPa]")
    for name, (layer, pieces) in CASES.items():
        folder = name.replace(", ", "_").replace(" ", "")
        changes = [f"geometry.layer='{layer}'", f"geometry.layer_pattern='{pieces}'"]
        outcome = run_deck(DECK, out / folder, changes)
        status = max(status, outcome.exit_status)
        rows, touch = outcome.result.rows, outcome.result.touch_pressure
        first = f"{touch['main'] / 1e3:.0f}" if touch else "none"
        print(f"{name:11s} {rows[-1].max_stretch:16.2f} {first:>19s}")
        curves[name] = ([row.pressure["main"] / 1e3 for row in rows], np.degrees([r.angle for r in rows]))
        costs.append(cost(name, outcome.record))
    grid = np.linspace(0.0, RANGE[0], 11)
    columns = {name: [at(*curve, p) for p in grid] for name, curve in curves.items()}
    table(
        out / "curve.csv",
        {"pressure [kPa]": grid} | {f"{n.replace(',', '')} [deg]": v for n, v in columns.items()},
    )
    print("chord angle [deg]")
    print("pressure [kPa] " + " ".join(f"{name:>11s}" for name in columns))
    for i, p in enumerate(grid):
        print(f"{p:14.0f} " + " ".join(f"{values[i]:11.1f}" for values in columns.values()))
    tell(columns)
    draw(
        out / "angle.png",
        "Bending zig-zag actuator",
        ("pressure [kPa]", "chord angle [deg]"),
        curves,
        {"end of the paper's range": ([RANGE[0]], [RANGE[1]])},
    )
    print("\n".join(costs))
    return status


def tell(columns: dict[str, list[float]]) -> None:
    """The paper's figures beside ours."""
    last = {name: values[-1] for name, values in columns.items()}
    first = next(iter(STIFFNESS))
    print(
        f"\nAt {RANGE[0]:.0f} kPa: {last[first]:.0f} deg ({first}); "
        f"the paper's range ends at {RANGE[1]:.0f} deg."
    )
    print("Layer       angle to that of 1 mm   the paper's stiffness of 1 mm to its own")
    for name, stiffness in STIFFNESS.items():
        print(f"{name:11s} {last[name] / last[first]:21.3f} {STIFFNESS[first] / stiffness:42.3f}")
    print(REMARK)
