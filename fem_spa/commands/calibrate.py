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
Or it is a model file with [model]: NAME is one of the model's parameters. Effects that `diagnose` added
([effects]) are held as they are, and calibrated.toml has them too.

RECORD.csv has `time [s]`, `pressure [kPa]` and an output such as `angle [deg]`; a file without time is
a static curve, such as the curve.csv of `fem-spa solve`. Held out are --holdout, else a third of the
records (of one record its last third, of one curve every third inner row).

--segment CAVITY solves the deck of a short piece instead, without records, and leaves the law of that
chamber (curvature and stretch against pressure, stiffness) as law.csv, which a rod reads (model.law); with
--count and --pitch also segments.toml, a row of such chambers as a model. --gauge: between which sections.

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
    parser.add_argument("--segment", metavar="CAVITY", help="the law of this chamber of a short piece")
    parser.add_argument(
        "--gauge", metavar=("NEAR", "FAR"), nargs=2, help="two sections from the base, '25 mm' '65 mm'"
    )
    parser.add_argument("--reach", metavar="LENGTH", help="half the thickness of a section of the gauge")
    parser.add_argument("--count", metavar="N", type=int, help="chambers of the row in segments.toml")
    parser.add_argument("--pitch", metavar="LENGTH", help="length of one of them")
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

    if arguments.segment is not None:
        return _segment(arguments)
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


def _segment(arguments: argparse.Namespace) -> int:
    """The law of one chamber."""
    from fem_spa.calibration.segment_job import SegmentJob, run_segment
    from fem_spa.errors import InputError
    from fem_spa.output.progress import Progress
    from fem_spa.run import output_place
    from fem_spa.units import quantity, show

    if arguments.records or arguments.vary or arguments.holdout:
        raise InputError("given --segment with records or --vary: it solves a piece and fits nothing")
    if arguments.gauge is None:
        raise InputError("given --segment without --gauge: give two sections from the base, '25 mm' '65 mm'")
    near, far = (quantity(text, "m", "--gauge", low=0.0, zero=True) for text in arguments.gauge)
    reach, pitch = (
        None if text is None else quantity(text, "m", name, positive=True)
        for text, name in ((arguments.reach, "--reach"), (arguments.pitch, "--pitch"))
    )
    given = Path(arguments.deck)
    folder = output_place(arguments.out, given.stem)
    job = SegmentJob(given, arguments.segment, near, far, reach, arguments.count, pitch, tuple(arguments.set))
    terminal = sys.stderr.isatty()
    with Progress(quiet=not terminal) as progress:
        law = run_segment(job, folder, progress.say if terminal else _log, [progress])
    axial = law.axial_stiffness
    print(
        f"Chamber {job.cavity} at {show(float(law.pressure[-1]), 'Pa')}: curvature {law.curvature[-1]:.4g} "
        f"1/m, stretch {100 * law.stretch[-1]:.3g} %; bending stiffness {law.bending_stiffness:.4g} N m^2, "
        + ("the line does not lengthen" if axial is None else f"axial {axial:.4g} N")
    )
    print(f"See {folder / 'law.png'}; the law is {folder / 'law.csv'}")
    if law.status != "done":
        print(f"{law.status}: the piece did not reach the pressure of the deck", file=sys.stderr)
    return 0 if law.status == "done" else 1


def _log(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
