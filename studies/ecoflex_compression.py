"""Ecoflex in compression against cards from tension: what do the cards miss?

Cylinders of 50 mm diameter and 30 mm height, ten tests a hardness (Queen Mary University of London, CC BY
4.0), against the cards `ecoflex-00-10`, `-30`, `-50`, fitted to one tensile test each by another laboratory
(Marechal et al. 2021). Load over rest area is the `pressure` of the records, the platen's travel the output.
The five tests A train, the five tests B are held out.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from materials.card import load_card
from materials.response import nominal_stress
from studies.loop_records import data_folder, diagnose, errors, said, write_curve, write_record

SUMMARY = "Ecoflex cards from tension against thirty measured compression tests; what the cards lack"
HARDNESSES = ("10", "30", "50")
HEIGHT, DIAMETER = 30e-3, 50e-3
"""m, of the cylinders."""
EVERY = 4
"""Of ten samples a second, these many are one."""


def run(out: Path) -> int:
    """Records, cards and reports a hardness in a folder of its own under `out`; prints what was found."""
    source = data_folder("ecoflex_compression_qmul")
    table = []
    for hardness in HARDNESSES:
        tests = {p.stem[-2:]: read_test(p) for p in sorted((source / f"EF{hardness}_0T").glob("*.csv"))}
        place = out / f"ecoflex-00-{hardness}"
        model = base_model(hardness, place)
        files = {
            name: write_record(
                place / "records" / f"{name}.csv",
                {"specimen": name, "history": "unknown"},
                {"time [s]": t, "pressure [kPa]": p, "displacement [mm]": d},
            )
            for name, (t, p, d) in tests.items()
        }
        train = [file for name, file in files.items() if name[0] == "A"]
        held = [file for name, file in files.items() if name[0] == "B"]
        report = diagnose(model, train, place / "diagnose", held)
        raw = card_error(hardness, [tests[file.stem] for file in held])
        table.append((hardness, raw, report, stiffness_ratio(hardness, tests)))
    print(words(table))
    return 0


def read_test(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time (s), load over rest area (kPa), travel (mm) of one test, both positive in compression."""
    lines = path.read_text(encoding="utf-8").splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("Time"))
    columns = np.loadtxt(lines[head + 1 :], delimiter=",", usecols=(0, 1, 2))[::EVERY]
    area = np.pi * DIAMETER**2 / 4
    return columns[:, 0], columns[:, 2] / area / 1e3, columns[:, 1]


def card_curve(hardness: str) -> tuple[np.ndarray, np.ndarray]:
    """Pressure (kPa) and travel (mm) of a cylinder that compresses freely, by the card."""
    card = load_card(f"ecoflex-00-{hardness}")
    stretch = np.linspace(1.0, 0.12, 160)
    pressure = -nominal_stress(card.law, card.parameters, "uniaxial", stretch) / 1e3
    return pressure, 1e3 * HEIGHT * (1 - stretch)


def base_model(hardness: str, place: Path) -> Path:
    """The card's cylinder as a `curve` model."""
    pressure, travel = card_curve(hardness)
    return write_curve(place, pressure, travel, "displacement [mm]")


def card_error(hardness: str, tests: list[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> float:
    """RMSE (mm) of the card as it is, with nothing refitted."""
    pressure, travel = card_curve(hardness)
    miss = [np.interp(p, pressure, travel) - d for _, p, d in tests]
    return float(np.sqrt(np.mean(np.concatenate(miss) ** 2)))


def stiffness_ratio(hardness: str, tests: dict[str, Any]) -> float:
    """Measured pressure over the card's at 30 % compression, mean over the tests."""
    pressure, travel = card_curve(hardness)
    at = 0.3 * HEIGHT * 1e3
    wanted = float(np.interp(at, travel, pressure))
    return float(np.mean([np.interp(at, d, p) for _, p, d in tests.values()]) / wanted)


def words(table: list[tuple[str, float, dict[str, Any], float]]) -> str:
    """What was found, for the terminal."""
    shape = DIAMETER / (4 * HEIGHT)
    bonded = 1 + 2 * shape**2
    lines = []
    for hardness, raw, report, ratio in table:
        lines.append(f"Ecoflex 00-{hardness}")
        lines.append(f"  the card as it is misses the held-out tests by {raw:.2f} mm (nothing refitted);")
        lines.append(f"  at 30 % compression the cylinder carries {ratio:.2f} times the card's load")
        lines.append(f"  with gain and offset refitted, {errors(report)}")
        lines.append(f"  {said(report)}")
    lines.append(
        f"""Platens that hold the faces fast would stiffen this cylinder (shape factor {shape:.2f}) by at most
a factor of about {bonded:.2f} (1 + 2 S^2, Gent and Lindley 1959). What is above that is a modulus too low
in the cards, as strain from the crosshead of a tensile test makes it. One loading branch does not tell
friction from stiffening: unloading, or lubricated platens, would."""
    )
    return "\n".join(lines)
