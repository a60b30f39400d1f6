"""`fem-spa solve DECK.toml`: the finite-element run of a deck."""

from __future__ import annotations

import argparse
import sys

DESCRIPTION = """\
Solve a deck and leave curve.csv, result.json, fields.pvd, curve.png, shape.png and report.html in DIR.
Exit status 0: the end of the load path was reached; 1: the run ended before it (what was reached is
in DIR, result.json says why); 2: the input is wrong, and nothing was written.
Every converged step is a checkpoint. Ctrl-C ends after the current iteration; --resume goes on."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("deck", metavar="DECK.toml", help="the deck")
    parser.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="replace a value of the deck, for example --set loads.pressure='15 kPa'; may be repeated",
    )
    parser.add_argument(
        "--out", metavar="DIR", help="folder of the results (default: out/<name of the deck>)"
    )
    parser.add_argument(
        "--resume",
        action="store_true",
        help="go on after the last step of a run in DIR that was cut off; anew where there is none",
    )


def run(arguments: argparse.Namespace) -> int:
    """Solve; the verdict and the place of the report go to stdout."""
    from fem_spa.run import run_deck

    outcome = run_deck(arguments.deck, arguments.out, arguments.set, resume=arguments.resume)
    print(outcome.verdict)
    for warning in outcome.record["warnings"]:
        print(f"Note: {warning}")
    if outcome.exit_status:
        print(f"{outcome.result.status}: {outcome.result.message}", file=sys.stderr)
    if (outcome.folder / "report.html").is_file():
        print(f"See {outcome.folder / 'report.html'}")
    return outcome.exit_status
