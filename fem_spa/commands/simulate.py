"""`fem-spa simulate MODEL.toml RECORD.csv ...`: a model, with its effects, over the commands of records."""

from __future__ import annotations

import argparse
from pathlib import Path

DESCRIPTION = """\
Run a model (with the effects that `diagnose` added to it) over the pressures of records: nothing
is fitted. Writes DIR/predictions/<record>.csv with `time [s]` and each output, and prints the error of each
record where its output was measured.

Records given together belong together: what happened in one is remembered in the next."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "model", metavar="MODEL.toml", type=Path, help="a model file, with or without effects"
    )
    parser.add_argument("records", metavar="RECORD.csv", type=Path, nargs="+", help="records of one actuator")
    parser.add_argument("--out", metavar="DIR", type=Path, help="folder (default: out/<name of the model>)")


def run(arguments: argparse.Namespace) -> int:
    """Simulate and write; a line a record goes to stdout."""
    from fem_spa.loop.simulate import simulate

    out = arguments.out or Path("out") / arguments.model.stem
    for line in simulate(arguments.model, arguments.records, out):
        print(line)
    print(f"Predictions: {out / 'predictions'}")
    return 0
