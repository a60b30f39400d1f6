"""Three composite fingers on a sphere of 100 mm: where they touch it, and how they hold it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fem_spa.output.compare import cost, paint, save
from fem_spa.output.style import figure
from fem_spa.run import run_deck
from fem_spa.solid.observe import Silent
from fem_spa.solid.obstacle_distance import distance
from fem_spa.solid.problem import Problem, Row, State
from fem_spa.solid.space import Space

SUMMARY = "three composite fingers on a sphere of 100 mm: pressure of first touch, grip force over pressure"
DECK = Path(__file__).with_suffix(".toml")

REMARK = """The paper measured no force: its model ends at the touch. What accounts for the difference in the
pressure of touch: the finger's channel, end walls and joint are chosen; where the finger's origin lies in
its height is read from two printed points; the touch is sought on the seventh chamber there, and anywhere
here. Friction would hold the sphere, too."""

FINGERS = 3
MODEL, BENCH = 28.7, 29.0
"""kPa in the slow module when it reaches the sphere: the paper's model, and its bench (section 4)."""


SEVENTH = (56.0, 63.0)
"""mm along the finger: the slow module's seventh chamber, with which the paper seeks the touch."""


class Touch(Silent):
    """The observer that notes where along the finger (mm from its base, at rest) it first presses."""

    def __init__(self) -> None:
        self.place: float | None = None

    def start(self, problem: Problem, space: Space) -> None:
        self.sphere, self.points = problem.obstacles[0], space.points

    def converged(self, state: State, row: Row, fraction: float) -> None:
        if self.place is None and np.any(on_sphere(row)):
            gap = distance(self.sphere, self.points + state.displacement)[0]
            self.place = 1e3 * float(self.points[int(np.argmin(gap)), 0])


def run(out: Path) -> int:
    """Solve the deck beside this file into `out`; prints and draws the forces of the grip."""
    seen = Touch()
    outcome = run_deck(DECK, out, observers=[seen])
    rows = outcome.result.rows
    print("slow [kPa]   fast [kPa]   force a finger [N]   towards the axis [N]   along it [N]")
    for row in rows:
        if row.is_point:
            force = on_sphere(row)
            print(
                f"{row.pressure['slow'] / 1e3:10.1f} {row.pressure['fast'] / 1e3:12.1f}"
                f" {np.linalg.norm(force):20.3f} {0.0 - force[2]:22.3f} {force[0]:14.3f}"
            )
    touch = outcome.result.touch_pressure
    if touch and seen.place is not None:
        free = [(row.pressure["slow"], row.gap or 0.0) for row in rows if not np.any(on_sphere(row))]
        rate = (free[-2][1] - free[-1][1]) / (free[-1][0] - free[-2][0])
        print(
            f"The finger reaches the sphere at {touch['slow'] / 1e3:.1f} kPa in the slow module;\n"
            f"the paper's model says {MODEL} kPa, its bench {BENCH:.0f} kPa.\n"
            f"It first presses {seen.place:.0f} mm from its base; the seventh chamber is at "
            f"{SEVENTH[0]:.0f} to {SEVENTH[1]:.0f} mm.\n"
            f"Just before the gap closes by {1e6 * rate:.1f} mm a kPa: to touch at {MODEL} kPa instead the "
            f"finger would\nhave to sit some {1e3 * rate * (1e3 * MODEL - touch['slow']):.0f} mm further "
            "away, at that rate."
        )
    last = on_sphere(rows[-1])
    print(
        f"At the end three fingers press with {FINGERS} x {-last[2]:.2f} N towards the axis and move\n"
        f"the sphere with {FINGERS} x {last[0]:+.2f} N along it (minus: into the hand)."
    )
    print(REMARK)
    drawing = figure(11.0, 4.4)
    left, right = drawing.subplots(1, 2)
    slow = [row for row in rows if row.pressure["fast"] == 0.0]
    fast = [row for row in rows if row.pressure["slow"] >= rows[-1].pressure["slow"]]
    for axes, part, name in ((left, slow, "slow"), (right, fast, "fast")):
        curves = {
            "size of the force": over(part, name, lambda f: float(np.linalg.norm(f))),
            "towards the axis": over(part, name, lambda f: -float(f[2])),
        }
        lines = {"paper's model": MODEL} if name == "slow" else {}
        title = "Slow module, fast one at rest" if name == "slow" else "Then the fast module"
        paint(axes, title, (f"pressure {name} [kPa]", "force of a finger [N]"), curves, None, lines)
    save(drawing, out / "grip.png")
    print(cost("grasp_sphere", outcome.record))
    return outcome.exit_status


def on_sphere(row: Row) -> np.ndarray:
    """(3,) N, what one finger exerts on the sphere."""
    return np.zeros(3) if row.obstacle_force is None else np.asarray(row.obstacle_force)[0]


def over(rows, name, measure):  # type: ignore[no-untyped-def]
    """Pressures (kPa) of a network and a measure of the force."""
    return [row.pressure[name] / 1e3 for row in rows], [measure(on_sphere(row)) for row in rows]
