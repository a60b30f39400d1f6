"""`fem-spa sweep DECK.toml --vary key=lo:hi:n ...`: many designs, one run each."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path

DESCRIPTION = """\
Solve a deck for every combination of some of its values. Leaves sweep.csv (a row a case), curves, maps and
report.html in DIR, and a folder a case in DIR/cases, as `fem-spa solve` leaves it.

A key is one of the deck, dotted: geometry.wall, materials.body.C10, loads.pressure.slow. Its values:
  key=lo:hi:n      n values from lo to hi, both with their unit: geometry.wall=1mm:2mm:5
  key=a,b,c        these: loads.pressure=10kPa,20kPa or materials.body.card=dragon-skin-30,ecoflex-00-30
Several keys: every combination, or with --sample sobol:N so many points spread evenly over all ranges.

A case that is solved is not run again: the same call after Ctrl-C, or with more values, goes on where it was.
One that fails is a row with its reason. Cases run at the same time, one a core, or on the workers of a Dask
scheduler (pip install "fem-spa[cluster]").

Exit status 0: every case was run; 1: none of them was solved, or the sweep was interrupted (what was reached
is in DIR); 2: the input is wrong, and nothing was written."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("deck", metavar="DECK.toml", nargs="?", help="the deck")
    parser.add_argument(
        "--vary", metavar="KEY=VALUES", nargs="+", action="extend", default=[], help="a key and its values"
    )
    parser.add_argument("--sample", metavar="sobol:N", help="N points instead of every combination")
    parser.add_argument("--seed", type=int, default=0, help="of the sample (default 0)")
    parser.add_argument(
        "--set", metavar="KEY=VALUE", action="append", default=[], help="replace a value of the deck first"
    )
    parser.add_argument("--workers", metavar="N", type=int, help="cases at a time (default: one a core)")
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="of Dask, such as tcp://10.0.0.5:8786, or its scheduler file"
    )
    parser.add_argument(
        "--again", action="store_true", help="run cases that ended before their end (limit, diverged) again"
    )
    parser.add_argument(
        "--out", metavar="DIR", help="folder of the results (default: out/<name of the deck>)"
    )


def run(arguments: argparse.Namespace) -> int:
    """Sweep; the verdict and the place of the report go to stdout."""
    from fem_spa.errors import InputError
    from fem_spa.output.progress import Progress
    from fem_spa.run import listen, output_place
    from fem_spa.sweep.job import run_sweep
    from fem_spa.sweep.state import Request
    from fem_spa.sweep.words import best, verdict

    given, vary = arguments.deck, list(arguments.vary)
    if given is None:  # fem-spa sweep --vary key=lo:hi:n DECK.toml
        decks = [word for word in vary if "=" not in word]
        if len(decks) != 1:
            raise InputError("given no deck: fem-spa sweep DECK.toml --vary KEY=VALUES ...")
        given = decks[0]
        vary.remove(given)
    if not 0 <= arguments.seed < 2**32:
        raise InputError(f"given {arguments.seed} for --seed: 0 to {2**32 - 1} is allowed")
    path = Path(given)
    folder = output_place(arguments.out, path.stem)
    request = Request(
        path,
        tuple(vary),
        arguments.sample,
        arguments.seed,
        tuple(arguments.set),
        arguments.scheduler,
        arguments.workers,
        arguments.again,
        shlex.join(["fem-spa", *sys.argv[1:]]),
    )
    listen()
    terminal = sys.stderr.isatty()
    with Progress(quiet=not terminal) as progress:
        sweep = run_sweep(request, folder, progress.say if terminal else _log)
    print("\n".join([verdict(sweep), *best(sweep)]))
    print(f"See {folder / 'report.html'}; the table is {folder / 'sweep.csv'}")
    if sweep.status != "done":
        print(f"{sweep.status}: {sweep.message}", file=sys.stderr)
    return 0 if sweep.status == "done" and sweep.count("done") else 1


def _log(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
