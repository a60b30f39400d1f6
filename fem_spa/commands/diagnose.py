"""`fem-spa diagnose MODEL.toml RECORD.csv ...`: the effect that a model lacks, with the evidence."""

from __future__ import annotations

import argparse
from pathlib import Path

DESCRIPTION = """\
Compare a model with measured records, trace what is left to an effect that the model lacks, add it,
and report the error before and after on records that were not used.

Verdicts: attributed (named), ambiguous (a set, and the experiment that decides), unexplained (predictable,
but nothing in the library), none (noise), insufficient (the data cannot tell). Each is exit status 0.
Records: CSV with `time [s]`, `pressure [kPa]` and an output; see docs/diagnose.md."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("model", metavar="MODEL.toml", type=Path, help="base model, [model] kind = ...")
    parser.add_argument("records", metavar="RECORD.csv", type=Path, nargs="+", help="records of one actuator")
    parser.add_argument(
        "--holdout",
        metavar="RECORD.csv",
        type=Path,
        nargs="+",
        action="extend",
        default=[],
        help="records to hold out (default: a third, the one that goes furthest among them)",
    )
    parser.add_argument(
        "--seed", type=int, default=0, help="for the choice of records held out and the draws"
    )
    parser.add_argument("--out", metavar="DIR", help="folder (default: out/<name of the model>)")
    parser.add_argument("--no-page", action="store_true", help="figures only: no report.html, no plots")


def run(arguments: argparse.Namespace) -> int:
    """Diagnose and write; a sentence goes to stdout."""
    from fem_spa.loop.diagnose import diagnose
    from fem_spa.run import output_place

    out = output_place(arguments.out, arguments.model.stem)
    outcome = diagnose(
        arguments.model, arguments.records, arguments.holdout, arguments.seed, out, page=not arguments.no_page
    )
    print(outcome.sentence)
    print(f"{outcome.figures}\nReport: {out / ('report.json' if arguments.no_page else 'report.html')}")
    return 0
