"""Command line of the benchmark: `run` cases, write the `page`."""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.loop.cases import TIERS
from benchmarks.loop.classes import FAMILY
from benchmarks.loop.kinds import KINDS
from benchmarks.loop.run import run_cases


def main() -> None:
    """Parse and go."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.loop", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    run = commands.add_parser("run", help="write cases, diagnose them, append to OUT/results.csv")
    run.add_argument("--tier", choices=TIERS, required=True)
    run.add_argument("--count", type=int, default=10)
    run.add_argument("--start", type=int, default=0, help="number of the first case")
    run.add_argument("--seed", type=int, default=1)
    run.add_argument("--protocol", help="A, B, C, D or D+; default: each in turn")
    run.add_argument("--jobs", type=int, default=1, help="cases at a time")
    run.add_argument("--rate", type=float, help="samples per second of every record")
    run.add_argument("--without", nargs="*", default=[], help="effects or a family taken out of the library")
    run.add_argument("--out", type=Path, required=True)
    page = commands.add_parser("page", help="write the tables of one or more result folders")
    page.add_argument("folders", type=Path, nargs="+")
    page.add_argument("--page", type=Path, default=Path("docs/loop.md"))
    page.add_argument("--engine", default="", help="version of the program that ran")
    kinds = commands.add_parser("kinds", help="the other base kinds, one pressure and several; OUT/kinds.csv")
    kinds.add_argument("--base", nargs="+", choices=KINDS, default=list(KINDS))
    kinds.add_argument("--effect", nargs="*", default=[], help="names, null, or all; default: by the seed")
    kinds.add_argument("--count", type=int, default=4, help="cases a kind, where no effect is named")
    kinds.add_argument("--seed", type=int, default=1)
    kinds.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    if given.command == "kinds":
        from benchmarks.loop.run_kinds import run_kinds

        run_kinds(given.out, given.base, given.seed, given.count, given.effect)
        return
    if given.command == "page":
        from benchmarks.loop.page import write_page

        write_page(given.folders, given.page, given.engine)
        return
    out = [name for word in given.without for name in ([n for n, f in FAMILY.items() if f == word] or [word])]
    numbers = range(given.start, given.start + given.count)
    run_cases(
        given.out,
        given.tier,
        numbers,
        given.seed,
        protocol=given.protocol,
        jobs=given.jobs,
        rate=given.rate,
        without=out,
    )


if __name__ == "__main__":
    main()
