"""Dragon Skin 30: the paper's numbers against a card fitted to a measured test, in the same finger.

The composite PneuNet paper (Yu et al. 2022) takes Yeoh C10 0.11, C20 0.02 MPa from its references, with
neither tests nor stretch range. The card `dragon-skin-30-fitted` is the tensile test of Marechal et al.
(2021) up to a stretch of 3. What angle does the difference make?
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.run import run_deck
from materials.card import Card, load_card
from materials.response import nominal_stress

SUMMARY = (
    "Dragon Skin 30 in the slow module: the paper's two constants against a card fitted to a tensile test"
)
DECK = Path(__file__).with_name("slow_module.toml")
CARDS = {"paper": "dragon-skin-30", "fitted": "dragon-skin-30-fitted"}
PRESSURE = "40 kPa"
POINTS = 8


def run(out: Path) -> int:
    """Solve the slow module with each card into its own folder under `out`; print and draw both angles."""
    curves: dict[str, np.ndarray] = {}
    status = 0
    for name, card in CARDS.items():
        changes = [f"materials.body.card='{card}'", f"loads.pressure='{PRESSURE}'", f"loads.points={POINTS}"]
        outcome = run_deck(DECK, out / name, changes)
        status = max(status, outcome.exit_status)
        rows = [row for row in outcome.result.rows if row.is_point]
        curves[name] = np.array(
            [[row.pressure["slow"] / 1e3, np.degrees(row.angle), row.max_stretch] for row in rows]
        )
    table = compare(curves)
    (out / "curve.csv").write_text(table_csv(table), encoding="utf-8")
    print(words(table))
    draw(curves, out / "curve.png")
    print(f"See {out / 'curve.png'}, and the reports in {out / 'paper'} and {out / 'fitted'}")
    return status


def compare(curves: dict[str, np.ndarray]) -> np.ndarray:
    """Rows of pressure [kPa], angle with the paper's card, with the fitted card [deg], and the largest
    stretch with each, at the pressures that both reached."""
    a, b = curves["paper"], curves["fitted"]
    n = min(len(a), len(b))
    return np.column_stack([a[:n, 0], a[:n, 1], b[:n, 1], a[:n, 2], b[:n, 2]])


def table_csv(table: np.ndarray) -> str:
    """The comparison as CSV."""
    head = "pressure [kPa],angle paper [deg],angle fitted [deg],max stretch paper,max stretch fitted"
    return "\n".join([head, *(",".join(f"{v:.6g}" for v in row) for row in table)]) + "\n"


def words(table: np.ndarray) -> str:
    """The comparison for the terminal."""
    lines = ["pressure [kPa]   paper [deg]   fitted [deg]   difference   largest stretch"]
    for p, a, b, _, stretch in table:
        share = f"{100 * (b / a - 1):+11.1f} %" if abs(a) > 1e-9 else f"{'':>13s}"
        lines.append(f"{p:14.0f} {a:13.2f} {b:14.2f}{share} {stretch:17.2f}")
    fitted, paper = (load_card(CARDS[name]) for name in ("fitted", "paper"))
    lines.append(
        f"Shear modulus at rest: {paper.small_strain.mu / 1e3:.0f} kPa (paper), "
        f"{fitted.small_strain.mu / 1e3:.0f} kPa (fitted)."
    )
    lines.append(
        "Part of it may be the test's: strain from the crosshead makes a rubber look softer than it is."
    )
    top = fitted.stretch_range[1] if fitted.stretch_range else np.inf
    beyond = table[table[:, 4] > top]
    if len(beyond):
        lines.append(
            f"From {beyond[0, 0]:.0f} kPa on the fitted finger is beyond its test (stretch {top:g})."
        )
    return "\n".join(lines)


def draw(curves: dict[str, np.ndarray], path: Path) -> None:
    """Both cards' tension and both fingers' angle; PNG."""
    from fem_spa.output.style import ACCENT, SECOND, figure, tidy

    picture = figure(11.0, 4.4)
    left, right = picture.subplots(1, 2)
    cards = {name: load_card(card) for name, card in CARDS.items()}
    for name, colour in (("paper", SECOND), ("fitted", ACCENT)):
        _tension(left, cards[name], name, colour)
        right.plot(curves[name][:, 0], curves[name][:, 1], "o-", ms=4, color=colour, label=f"{name} card")
    low, high = cards["fitted"].stretch_range or (1.0, 3.0)
    left.axvspan(low, high, color="#eef2f7", zorder=0, label="range of the test")
    left.set(title="Dragon Skin 30 in tension", xlabel="stretch [1]", ylabel="nominal stress [kPa]")
    right.set(title="Slow module", xlabel="pressure [kPa]", ylabel="angle [deg]")
    for axes in (left, right):
        tidy(axes)
        axes.legend(frameon=False)
    picture.savefig(path, dpi=120)


def _tension(axes: Any, card: Card, name: str, colour: str) -> None:
    stretch = np.linspace(1.0, 3.0, 100)
    stress = nominal_stress(card.law, card.parameters, "uniaxial", stretch) / 1e3
    axes.plot(stretch, stress, color=colour, lw=2, label=f"{name} card")
