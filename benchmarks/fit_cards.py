"""Make the fitted cards of materials/cards from the measured tests, and print their table.

Run: python benchmarks/fit_cards.py DATA [CARDS]      DATA: the folder of measured tests (docs/materials.md)

Silicones: stretches 1 to 3, which is where actuators work, and only laws of I1 (Yeoh, Gent, Arruda-Boyce,
neo-Hooke): each was tested in tension alone, and a law with I2 or free exponents would make up the
other modes. Printed TPU: the points of two published mean curves, typed in below.
"""

from __future__ import annotations

import dataclasses
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from fem_spa.output.files import write_whole
from materials.card_writer import card_toml
from materials.job import Options, Outcome, fit_tests

LAWS = ("yeoh", "gent", "arruda-boyce", "neo-hooke")
MARECHAL = (
    "L. Marechal et al., Toward a common framework and database of materials for soft robotics, "
    "Soft Robotics 8 (2021) 284; github.com/LucMarechal/Soft-Robotics-Materials-Database at 8ff66c3, ODbL"
)
SMOOTH_ON = "Density: manufacturer's typical value (Smooth-On)."
CROSSHEAD = (
    "One specimen pulled to failure at 450 mm/min, strain from the crosshead: the modulus is biased low. "
    "Tension alone: other modes are the law's word."
)
PRESSED = (
    " Another laboratory measured this rubber in compression (QMUL, ten specimens, platen friction unknown) "
    "as two to two and a half times as stiff."
)
SILICONES = {
    "dragon-skin-10": ("Dragon_Skin_10_MEDIUM", 1070, f"{CROSSHEAD} {SMOOTH_ON}"),
    "dragon-skin-20": ("Dragon_Skin_20", 1080, f"{CROSSHEAD} {SMOOTH_ON}"),
    "dragon-skin-30-fitted": (
        "Dragon_Skin_30",
        1080,
        f"{CROSSHEAD} {SMOOTH_ON} See dragon-skin-30 for the paper's.",
    ),
    "ecoflex-00-10": ("Ecoflex_00-10", 1040, f"{CROSSHEAD} {SMOOTH_ON}{PRESSED}"),
    "ecoflex-00-30": ("Ecoflex_00-30", 1070, f"{CROSSHEAD} {SMOOTH_ON}{PRESSED}"),
    "ecoflex-00-50": ("Ecoflex_00-50", 1070, f"{CROSSHEAD} {SMOOTH_ON}{PRESSED}"),
    "rtv615": ("RTV615", 1020, f"{CROSSHEAD} Density: manufacturer's typical value (Momentive)."),
}
TPU_SOURCE = (
    "Mean tensile curve of 20 printed specimens (6.13 x 1.25 mm, gauge 33 mm), MacCurdy lab, "
    "SoRoForge repository; points typed in benchmarks/fit_cards.py"
)
TPU_NOTE = (
    "No point below stretch 1.3: the modulus at rest is the law's word. Tension alone. "
    "Density: typical value (NinjaTek)."
)
TPU = {
    "ninjaflex": (
        1190,
        "1.31,0.61 1.63,1.07 1.94,1.48 2.25,1.89 2.57,2.33 2.88,2.83 3.19,3.38 3.50,3.99 3.82,4.67",
        "Shore 85 A.",
    ),
    "cheetah": (
        1220,
        "1.34,1.76 1.69,2.63 2.03,3.47 2.38,4.40 2.72,5.47 3.06,6.69 3.41,8.10 3.75,9.73 4.09,11.59",
        "Shore 95 A.",
    ),
}


def main() -> None:
    """Write the cards and print a line for each."""
    if len(sys.argv) < 2:
        raise SystemExit("usage: python benchmarks/fit_cards.py DATA [CARDS]")
    data = Path(sys.argv[1])
    cards = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(__file__).parents[1] / "materials" / "cards"
    for name, (file, density, note) in SILICONES.items():
        options = Options(laws=LAWS, stretch=(1.0, 3.0), name=name, density=density)
        outcome = fit_tests([data / "silicone_tensile_marechal" / f"{file}.csv"], options)
        save(outcome, cards, f"{MARECHAL}\n{outcome.card.source}", note)
    with tempfile.TemporaryDirectory() as folder:
        for name, (density, points, note) in TPU.items():
            test = Path(folder) / f"{name}.csv"
            test.write_text("stretch,nominal stress [MPa]\n" + "\n".join(points.split()) + "\n")
            outcome = fit_tests([test], Options(laws=LAWS, name=name, density=density))
            save(outcome, cards, f"{TPU_SOURCE}\n{outcome.card.source}", f"{note} {TPU_NOTE}")


def save(outcome: Outcome, folder: Path, source: str, note: str) -> None:
    """The card with its source, and its line."""
    card = dataclasses.replace(outcome.card, source=source, note=note)
    write_whole(folder / f"{card.name}.toml", card_toml(card, folder))
    fit = outcome.chosen.fit
    low, high = card.stretch_range or (1.0, 1.0)
    values = ", ".join(
        f"{k} {v / 1e6:.4g} MPa" if fit.law.parameters[k] == "Pa" else f"{k} {v:.4g}"
        for k, v in fit.parameters.items()
        if k in fit.variant.free
    )
    print(
        f"{card.name:22s} {fit.name:13s} {values:45s} mu {card.small_strain.mu / 1e3:7.1f} kPa  "
        f"stretch {low:.2f} to {high:.2f}  rmse {fit.rmse / 1e3:6.2f} kPa "
        f"({100 * fit.rmse_share:.2f} %)  stable {card.stable}"
    )


if __name__ == "__main__":
    main()
