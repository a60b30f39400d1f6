"""`fem-spa calibrate DECK.toml RECORD.csv ... --vary NAME ...`: numbers of a deck or model from records."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path

DESCRIPTION = """\
Fit numbers of a deck or of a reduced model to measured records or to FE curves, and say how good they are
on data held out. Leaves calibrated.toml, calibration.json, calibration.png and report.html in DIR.

DECK.toml is a solver deck: NAME is materials.VOLUME.C10 (or another parameter of its law),
materials.VOLUME.scale (all its moduli), layers.NAME.modulus, walls.scale (thickness of all walls),
geometry.LENGTH, or offset (zero of the sensor). A handful of FE runs, with the solver's own derivatives.
Or it is a model file with [model]: NAME is one of the model's parameters.

RECORD.csv has `time [s]`, `pressure [kPa]` and an output such as `angle [deg]`; a file without time is
a static curve, such as the curve.csv of `fem-spa solve`. Held out are --holdout, else a third of the
records (of one record its last third, of one curve every third inner row).

A number that would leave what physics allows is not accepted: it stays, and what may be missing is named.
Exit status 0: calibrated; 1: interrupted, the best so far is in DIR; 2: the input is wrong."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("deck", metavar="DECK.toml", help="a deck, or a model file with [model]")
    parser.add_argument("records", metavar="RECORD.csv", nargs="*", help="measured records, or static curves")
    parser.add_argument(
        "--vary", metavar="NAME", nargs="+", action="extend", default=[], help="numbers to fit"
    )
    parser.add_argument(
        "--holdout", metavar="RECORD.csv", nargs="+", action="extend", default=[], help="never fitted"
    )
    parser.add_argument(
        "--set", metavar="KEY=VALUE", action="append", default=[], help="replace a value of the deck first"
    )
    parser.add_argument(
        "--output", metavar="NAME", help="compare this output only (default: the first that both have)"
    )
    parser.add_argument("--seed", type=int, default=0, help="chooses what is held out (default 0)")
    parser.add_argument(
        "--out", metavar="DIR", help="folder of the results (default: out/<name of the deck>)"
    )


def run(arguments: argparse.Namespace) -> int:
    """Calibrate; the numbers and the place of the report go to stdout."""
    from fem_spa.calibration.job import Job, run_job
    from fem_spa.calibration.words import lines
    from fem_spa.errors import InputError
    from fem_spa.output.progress import Progress
    from fem_spa.run import output_place

    tests = [name for name in arguments.vary if name.lower().endswith(".csv")]
    vary = [name for name in arguments.vary if name not in tests]
    records = [*arguments.records, *tests]
    if not vary:
        raise InputError("given no --vary: say which numbers to fit, for example --vary materials.body.scale")
    if not records:
        raise InputError("given no record: at least one RECORD.csv is needed (fem-spa calibrate --help)")
    given = Path(arguments.deck)
    folder = output_place(arguments.out, given.stem)
    job = Job(
        given,
        tuple(map(Path, records)),
        tuple(map(Path, arguments.holdout)),
        tuple(vary),
        tuple(arguments.set),
        arguments.seed,
        arguments.output,
    )
    terminal = sys.stderr.isatty()
    with Progress(quiet=not terminal) as progress:
        outcome = run_job(
            job,
            folder,
            progress.say if terminal else _log,
            [progress],
            shlex.join(["fem-spa", *sys.argv[1:]]),
        )
    print("\n".join(lines(outcome)))
    print(f"See {folder / 'report.html'}; the calibrated file is {folder / 'calibrated.toml'}")
    return 1 if outcome.status == "interrupted" else 0


def _log(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
