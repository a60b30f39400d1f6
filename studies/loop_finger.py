"""The whole loop on a finger: FE curve, blind records with an effect that nobody told of, verdict, truth.

The slow module of the composite finger is solved to 60 kPa on a coarse mesh. The generator of
benchmarks/loop, which shares no formula with the library of effects, draws an effect and its size from a
seed and writes bench records of this finger: three rates, two amplitudes, minor loops, a hold, random
steps, two records upside down, the chamber's pressure measured. `diagnose` gets the FE curve and the
records. The truth is read only after its verdict is printed.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from fem_spa.errors import InputError
from fem_spa.run import run_deck
from studies.loop_records import diagnose, errors, said

SUMMARY = (
    "blind test on a finger: FE curve, records with an effect that the seed chose, verdict, then the truth"
)
DECK = Path(__file__).with_name("slow_module.toml")
CHANGES = ["loads.pressure='60 kPa'", "loads.points=12", "geometry.size='5 mm'"]
SEED = 31
CASES = (0, 1, 2)
"""Numbers of the cases drawn from the seed."""
GAIN, OFFSET = 0.94, 0.6
"""The finger on the bench against its FE curve: modulus a little off, sensor (deg) too; both are refitted."""


def run(out: Path) -> int:
    """Solve the deck, then a case after another in folders under `out`; prints verdicts and truths."""
    try:
        from benchmarks.loop.base import Base
        from benchmarks.loop.cases import draw_case
        from benchmarks.loop.files import write_case
        from benchmarks.loop.score import right_names
    except ImportError:
        raise InputError(
            "given no folder benchmarks/loop: the generator of blind records comes with the repository only; "
            "run this study from a checkout"
        ) from None
    outcome = run_deck(DECK, out / "fe", CHANGES)
    rows = np.array([[row.pressure["slow"], row.angle] for row in outcome.result.rows])
    top, span = rows[-1]
    base = Base("fe", "silicone", float(span), float(top), (0, 0), GAIN, np.radians(OFFSET), table=rows)
    print(f"FE: {np.degrees(span):.1f} deg at {top / 1e3:.0f} kPa, {len(rows)} points")
    for number in CASES:
        case = draw_case("single", number, SEED, "D+", base=base)
        folder = out / f"case{number}"
        truth = write_case(case, folder / "records")
        model = folder / "model.toml"
        shutil.copy(out / "fe" / "curve.csv", folder / "curve.csv")
        model.write_text('[model]\nkind = "curve"\nfile = "curve.csv"\n', encoding="utf-8")
        files = [folder / "records" / name for name in truth["records"]]
        held = [f for f in files if f.name in truth["holdout"]]
        report = diagnose(model, [f for f in files if f not in held], folder / "diagnose", held, SEED)
        true = truth["effects"][0]
        named = [effect["name"] for effect in report["effects"]]
        right = len(named) == 1 and named[0] in right_names(truth, true["name"])
        print(f"case {number}: {said(report)}\n  {errors(report)}")
        print(
            f"  truth: {true['name']} ({true['form']}), visible {100 * true['visible']:.1f} % of the span: "
            f"{'right class' if right else 'not found'}"
        )
    return outcome.exit_status
