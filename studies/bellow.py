"""The bellow-driven actuator: displacement from vacuum to pressure, and the force of its blocked top."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fem_spa.output.compare import at, cost, paint, save, table
from fem_spa.output.style import figure
from fem_spa.run import Outcome, run_deck

SUMMARY = "bellow-driven actuator, -80 to 120 kPa: displacement, and the force of its blocked top"
DECK = Path(__file__).with_suffix(".toml")

REMARK = """The paper's values between -50 and 90 kPa are its straight lines; of -50 to -80 kPa it says
only that the bellow is fully retracted there. Here the folds meet at about -49 kPa and then hold one
another off. The bellow's modulus is not printed (here from the hardness, Shore 50 A: a third off is
usual). What it can close: a softer bellow moves all four figures above towards the paper's, the force
too, since held at -7 mm it is a pressed spring that pushes without pressure. What it cannot: all four
at once. Softer by as much as closes -50 kPa, free, it is still short at 90 kPa (above), as it gets stiffer
while its folds open, where the paper's line is straight; and the slope of the blocked force is an area,
much the same whatever the modulus. What makes that up is a guess: the shape (what of the height is neck,
and whether a convolution is a flank or a wave, is not printed either), the soft layer's modulus, from one
point at 22 mm, or that the bellow rubs on its frame in the bench. The neck is solid: hollow, with
a wall of 0.8 mm like the rest, its tube gives way at 10 to 11 kPa of vacuum (benchmarks/bellow_stability.py),
and the bench shows nothing of the kind."""

# Hashem, Stommel, Cheng, Xu: section VI, Figs. 6 and 7
DISPLACEMENT = ([-50.0, 90.0], [-7.0, 9.0])
BLOCKED = ([-50.0, 90.0], [0.2, 6.0])
RETRACTED = "-7 mm"
"""Where the load cell stands: the actuator is blocked at its full retraction."""

SOFTER = 0.8
"""The factor on the moduli with which the free bellow is at the paper's place at -50 kPa."""

RUNS = {
    "pressure": ["loads.points=12"],
    "vacuum": ["loads.pressure='-80 kPa'", "loads.points=16"],
    "blocked": [
        f"loads.tip_displacement=[0, 0, '{RETRACTED}']",
        "loads.pressure='90 kPa'",
        "loads.path=['-50 kPa', '-25 kPa', '0 kPa', '30 kPa', '60 kPa']",
    ],
}
Curve = tuple[list[float], list[float]]


def run(out: Path) -> int:
    """Solve pressure, vacuum and blocked top into folders under `out`; prints and draws both figures."""
    done = {name: run_deck(DECK, out / name, changes) for name, changes in RUNS.items()}
    move = displacement(done["vacuum"], done["pressure"])
    force = blocked(done["blocked"])
    table(out / "curve.csv", {"pressure [kPa]": move[0], "displacement [mm]": move[1]})
    table(out / "blocked.csv", {"pressure [kPa]": force[0], "force [N]": force[1]})
    tell(move, force)
    drawing = figure(11.0, 4.4)
    left, right = drawing.subplots(1, 2)
    names = ("pressure [kPa]", "displacement of the top [mm]")
    paint(left, "Free", names, {"FE": move}, {"paper": DISPLACEMENT})
    left.legend(frameon=False, fontsize=9, loc="upper left")
    names = ("pressure [kPa]", f"force of the top, held at {RETRACTED} [N]")
    paint(right, "Blocked", names, {"FE": force}, {"paper": BLOCKED})
    save(drawing, out / "bellow.png")
    for name, outcome in done.items():
        print(cost(name, outcome.record))
    return max(outcome.exit_status for outcome in done.values())


def displacement(vacuum: Outcome, pressure: Outcome) -> Curve:
    """Pressures in kPa, from the deepest vacuum up, and displacements of the top in mm."""
    rows = [*reversed(vacuum.result.rows[1:]), *pressure.result.rows]
    moved = [1e3 * row.motion.extension for row in rows if row.motion is not None]
    return [row.pressure["main"] / 1e3 for row in rows], moved


def blocked(outcome: Outcome) -> Curve:
    """Pressures in kPa and the upward force of the top in N, from the deepest vacuum on."""
    rows = outcome.result.rows
    start = min(range(len(rows)), key=lambda i: rows[i].pressure["main"])
    rows = rows[start:]
    forces = [float(row.force_vector[2]) for row in rows if row.force_vector is not None]
    return [row.pressure["main"] / 1e3 for row in rows], forces


def tell(move: Curve, force: Curve) -> None:
    """The paper's figures beside ours."""
    print("pressure [kPa]   displacement [mm]   paper [mm]   blocking force [N]   paper [N]")
    for p in (-80.0, -65.0, -50.0, -25.0, 0.0, 30.0, 60.0, 90.0, 120.0):
        paper = at(*DISPLACEMENT, p), at(*BLOCKED, p)
        cells = (at(*move, p), paper[0], at(*force, p), paper[1])
        texts = [f"{value:.2f}" if np.isfinite(value) else "" for value in cells]
        print(f"{p:14.0f} {texts[0]:>19s} {texts[1]:>12s} {texts[2]:>20s} {texts[3]:>11s}")
    print(told_by_modulus(move, force))
    print(REMARK)


def told_by_modulus(move: Curve, force: Curve) -> str:
    """The four figures beside the paper's, and what other moduli and no modulus would change of them.

    With all moduli s times as large, shapes are those of the pressure over s, forces s times those there.
    """
    low, high = DISPLACEMENT[0]
    lines = []
    for words, unit, ours, paper in (("Free", "mm", move, DISPLACEMENT), ("Blocked", "N", force, BLOCKED)):
        parts = [f"{at(*ours, p):.2f} against {at(*paper, p):g} {unit} at {p:g} kPa" for p in (high, low)]
        lines.append(f"{words}: {parts[0]}, {parts[1]}.")
    if min(move[0]) <= low / SOFTER and high / SOFTER <= max(move[0]):
        parts = [f"{at(*move, p / SOFTER):.2f} mm at {p:g} kPa" for p in (high, low)]
        lines.append(f"With {SOFTER} of all moduli, free: {parts[0]}, {parts[1]}.")
    push, line = at(*force, 0.0), at(*BLOCKED, 0.0)
    area, theirs = (1e3 * (at(*c, high) - at(*c, low)) / (high - low) for c in (force, BLOCKED))
    held = f"Held at {RETRACTED} it pushes with {push:.2f} N without pressure"
    lines.append(f"{held} (paper's line: {line:.2f} N).")
    lines.append(f"The force grows by {area:.1f} mm^2 times the pressure (paper's line: {theirs:.1f} mm^2).")
    return "\n".join(line for line in lines if "nan" not in line)  # without pressures that were not reached
