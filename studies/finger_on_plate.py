"""A finger pressing on a plate: force over pressure, for plates at three distances and for a held tip."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fem_spa.output.compare import at, cost, paint, save, table
from fem_spa.output.style import figure
from fem_spa.run import Outcome, run_deck

SUMMARY = (
    "finger against a plate, 0 to 40 kPa: pressure of touch and force over pressure; a held tip beside it"
)
DECK = Path(__file__).with_suffix(".toml")

REMARK = """The composite finger's paper stops where the finger touches, and asks for a model of its output
force: this is FE's. No bench stands beside it. A plate lets the tip turn and slide (without friction) and
takes a force across it only. A held tip face can do neither: what holds it takes a moment instead, and a
beam that bends evenly needs no force across it at all. What is left is mostly thrust along the finger, so
that the held tip is no measure of how hard a finger presses on something."""

UNDERSIDE = -2.0
"""mm: where the finger's underside is at rest."""

PLATES = (1.0, 5.0, 15.0)
"""mm: distances of the plate from the underside."""


def run(out: Path) -> int:
    """Solve every plate and the held tip into folders under `out`; prints and draws the forces."""
    done = {}
    for gap in PLATES:
        plane = f"[{{plane={{point=[0, 0, '{UNDERSIDE - gap:g} mm'], normal=[0, 0, 1]}}}}]"
        done[f"plate {gap:g} mm away"] = run_deck(DECK, out / f"{gap:g}mm", [f"loads.obstacles={plane}"])
    held = run_deck(DECK, out / "held_tip", ["loads.obstacles=[]", "observe.blocked=true"])
    pressed = {name: (kilopascals(outcome), on_plate(outcome)) for name, outcome in done.items()}
    force = on_holder(held)
    holds = {
        "down, across the finger": (kilopascals(held), -force[:, 2]),
        "along the finger": (kilopascals(held), force[:, 0]),
    }
    columns = {"pressure [kPa]": np.array([row.pressure["slow"] / 1e3 for row in points(held)])}
    for name, curve in pressed.items():
        columns[f"{name} [N]"] = np.array([at(*curve, p) for p in columns["pressure [kPa]"]])
    for name, curve in holds.items():
        words = f"held tip {name.partition(',')[0]} [N]"
        columns[words] = np.array([at(*curve, p) for p in columns["pressure [kPa]"]])
    table(out / "curve.csv", columns)
    tell(columns, done)
    drawing = figure(11.0, 4.4)
    left, right = drawing.subplots(1, 2)
    paint(left, "Finger above a plate", ("pressure [kPa]", "force on the plate [N]"), pressed)
    paint(right, "Tip face held where it is", ("pressure [kPa]", "force on its holder [N]"), holds)
    save(drawing, out / "force.png")
    for name, outcome in {**done, "held tip": held}.items():
        print(cost(name, outcome.record))
    return max(outcome.exit_status for outcome in (*done.values(), held))


def points(outcome: Outcome) -> list:  # type: ignore[type-arg]
    """The rows of the path's load points, rest first."""
    return [row for row in outcome.result.rows if row.is_point]


def kilopascals(outcome: Outcome) -> np.ndarray:
    return np.array([row.pressure["slow"] / 1e3 for row in outcome.result.rows])


def on_plate(outcome: Outcome) -> np.ndarray:
    """N of every step, pushing the plate down."""
    rows = outcome.result.rows
    return np.array([0.0 if row.obstacle_force is None else -row.obstacle_force[0][2] for row in rows])


def on_holder(outcome: Outcome) -> np.ndarray:
    """(steps, 3) N, what the held tip exerts on its holder."""
    rows = outcome.result.rows
    return np.array([np.zeros(3) if row.force_vector is None else row.force_vector for row in rows])


def tell(columns: dict[str, np.ndarray], done: dict[str, Outcome]) -> None:
    """The table, where each plate is touched, and how the force grows from there."""
    names = list(columns)
    print("pressure [kPa]  " + "  ".join(f"{name:>24s}" for name in names[1:]))
    for values in zip(*columns.values(), strict=True):
        print(f"{values[0]:14.0f}  " + "  ".join(f"{0.0 + round(v, 4):24.3f}" for v in values[1:]))
    for name, outcome in done.items():
        touch = outcome.result.touch_pressure
        if touch is None:
            print(f"{name}: not touched.")
            continue
        first, last = touch["slow"] / 1e3, kilopascals(outcome)[-1]
        rate = 1e3 * on_plate(outcome)[-1] / (last - first) if last > first else float("nan")
        print(f"{name}: touched at {first:.1f} kPa; {rate:.0f} mN a kPa from there on average.")
    print(REMARK)
