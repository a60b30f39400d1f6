"""`fem-spa fit TEST.csv ...`: a rubber's tests -> a material card that `solve` takes as it is."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from materials.job import Options, Outcome

DESCRIPTION = """\
Fit hyperelastic laws to tests, rank them by the error on what was held out, scan their stability,
and write a card (CARD.toml) with a page of curves beside it (CARD.html, CARD.png).

Test files: CSV with the columns `stretch` or `strain` and `nominal stress [MPa]` or `true stress
[MPa]`, or `force [N]` and `displacement [mm]` with `# area: 24 mm^2` and `# gauge length: 25 mm`
above the header; there too `# mode: uniaxial`, `equibiaxial` or `planar`, and `# test: relaxation`,
`creep` or `cyclic`. All files of one call are one material, unless --each is given.

Exit status 0: the card was written; 2: the input is wrong, and nothing was written."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "tests", metavar="TEST.csv", nargs="*", help="tests of one material; a folder is its .csv files"
    )
    parser.add_argument(
        "--law",
        metavar="NAME",
        nargs="+",
        action="extend",
        default=[],
        help="laws to try: neo-hooke, mooney-rivlin, yeoh (yeoh-2, yeoh-3), ogden (ogden-1, -2, -3), gent, "
        "arruda-boyce, extended-tube, linear, or a .py file with your own (default: all but linear)",
    )
    parser.add_argument(
        "--out",
        metavar="CARD.toml",
        type=Path,
        help="the card (default: out/<name>.toml; a folder with --each)",
    )
    parser.add_argument("--name", help="name of the card (default: from the first file)")
    parser.add_argument("--each", action="store_true", help="every file is another material: one card each")
    parser.add_argument("--weights", default="absolute", help="absolute (default), relative, or noise")
    parser.add_argument(
        "--range", metavar="LO:HI", help="fit only rows with a stretch in this range, for example 1:3"
    )
    parser.add_argument("--stable", action="store_true", help="fit under the constraint of stability")
    parser.add_argument(
        "--stable-range", metavar="LO:HI", help="stretches over which stability is asked, in each mode"
    )
    parser.add_argument("--toe", default="auto", help="slack beginning: auto (force files only), on, off")
    parser.add_argument(
        "--drop-outliers", action="store_true", help="leave out rows that stand apart (named either way)"
    )
    parser.add_argument("--mode", help="mode of files that do not state theirs (default uniaxial)")
    parser.add_argument(
        "--ignore-time", action="store_true", help="take rows as they stand though times go back"
    )
    parser.add_argument("--density", metavar="QUANTITY", help='for the card, for example "1070 kg/m^3"')
    parser.add_argument(
        "--data", metavar="DIR", type=Path, help="folder where tests are looked for too (or FEM_SPA_DATA)"
    )


def run(arguments: argparse.Namespace) -> int:
    """Fit and write; the table goes to stdout."""
    from materials.card_writer import card_toml
    from materials.job import find_tests, fit_each, fit_tests, slug
    from materials.page import page
    from materials.picture import picture

    _sort_out(arguments)
    options = _options(arguments)
    files = find_tests(arguments.tests, options.data)
    command = shlex.join(["fem-spa", *sys.argv[1:]])
    if not arguments.each:
        outcome = fit_tests(files, options)
        target = arguments.out or Path("out") / f"{outcome.card.name}.toml"
        target = target if target.suffix == ".toml" else target / f"{outcome.card.name}.toml"
        drawn, seen = picture(outcome), target.with_suffix(".html")
        _write(
            {
                target: card_toml(outcome.card, target.parent),
                target.with_suffix(".png"): drawn,
                seen: page(outcome, drawn, command),
            }
        )
        print(_report(outcome))
        print(f"\nCard {target}, see {seen}")
        return 0
    folder = arguments.out or Path("out")
    _refuse_twins(files)
    outcomes = fit_each(files, [_named(options, slug(file.stem)) for file in files])
    from materials.overview import overview, overview_page

    drawn, seen = overview(outcomes), folder / "overview.html"
    cards: dict[Path, str | bytes] = {
        folder / f"{outcome.card.name}.toml": card_toml(outcome.card, folder) for outcome in outcomes
    }
    _write({**cards, folder / "overview.png": drawn, seen: overview_page(outcomes, drawn, command)})
    print(_summary(outcomes))
    print(f"{len(outcomes)} cards in {folder}, see {seen}")
    return 0


def _sort_out(arguments: argparse.Namespace) -> None:
    """`--law yeoh TEST.csv`: what ends in .csv is a test, wherever it stands."""
    from fem_spa.errors import InputError

    tests = [name for name in arguments.law if name.lower().endswith(".csv")]
    arguments.law = [name for name in arguments.law if name not in tests]
    arguments.tests = [*arguments.tests, *tests]
    if not arguments.tests:
        raise InputError(
            "given no test; at least one TEST.csv, or a folder of such, is needed (fem-spa fit --help)"
        )


def _options(arguments: argparse.Namespace) -> Options:
    from materials.job import Options
    from materials.units import quantity

    density = None if arguments.density is None else quantity(arguments.density, "density", "--density")
    return Options(
        laws=tuple(arguments.law),
        weights=arguments.weights,
        stretch=_range(arguments.range, "--range"),
        stable=arguments.stable,
        stable_stretch=_range(arguments.stable_range, "--stable-range"),
        toe=arguments.toe,
        drop_outliers=arguments.drop_outliers,
        mode=arguments.mode,
        ignore_time=arguments.ignore_time,
        data=arguments.data,
        name=arguments.name,
        density=density,
        details="recommended" if arguments.each else "all",
    )


def _range(text: str | None, what: str) -> tuple[float, float] | None:
    """(low, high) of "1:3"."""
    from fem_spa.errors import InputError

    if text is None:
        return None
    low, colon, high = text.partition(":")
    try:
        values = float(low), float(high)
    except ValueError:
        values = (0.0, 0.0)
    if not colon or not 0 < values[0] <= 1 <= values[1] or values[0] == values[1]:
        raise InputError(
            f"{what} {text}: two stretches around 1 are needed, low:high, for example 1:3 or 0.5:2"
        )
    return values


def _named(options: Options, name: str) -> Options:
    from dataclasses import replace

    return replace(options, name=name)


def _refuse_twins(files: list[Path]) -> None:
    """With --each, two files of one name would write the same card."""
    from fem_spa.errors import InputError
    from materials.job import slug

    seen: dict[str, Path] = {}
    for file in files:
        name = slug(file.stem)
        if name in seen:
            raise InputError(
                f"{seen[name]} and {file} would both write {name}.toml; fit them apart, or rename one"
            )
        seen[name] = file


def _write(files: Mapping[Path, str | bytes]) -> None:
    """Each file whole or as it was; they are made in this order."""
    from fem_spa.errors import InputError
    from fem_spa.output.files import write_whole

    for path, content in files.items():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(path, content)
        except OSError as error:
            raise InputError(
                f"--out {path} cannot be written: {error.strerror}; give another place"
            ) from None


def _report(outcome: Outcome) -> str:
    """Everything for the terminal."""
    from materials.job import table_rows

    fit, u = outcome.chosen.fit, outcome.chosen.uncertainty
    lines = _columns([dict(row) for row in table_rows(outcome)])
    lines.append(f"Held out: {outcome.ranking.scheme}. * is recommended and written.")
    lines.append("")
    for name in fit.variant.free:
        unit, scale = ("MPa", 1e6) if fit.law.parameters[name] == "Pa" else ("", 1.0)
        text = f"  {name} = {fit.parameters[name] / scale:.6g}"
        if u is not None:
            low, high = u.intervals[name]
            text += f"  ({low / scale:.5g} to {high / scale:.5g})"
        lines.append(f"{text} {unit}".rstrip())
    if u is not None:
        lines.append(f"  95 % intervals: {outcome.card.fit['intervals']}")
    for s, series in outcome.prony:
        terms = ", ".join(f"g {g:.3f} at {t:.3g} s" for g, t in zip(series.g, series.tau, strict=True))
        lines.append(f"  Prony ({s.name}): {terms}")
    for s, m in outcome.mullins:
        lines.append(
            f"  Mullins ({s.name}): r {m.r:.3f}, m {m.m / 1e3:.3g} kPa, beta {m.beta:.3g}; "
            f"rmse {m.rmse / 1e3:.3g} kPa ({m.rmse_without / 1e3:.3g} kPa without)"
        )
    lines += [f"Note: {note}" for note in outcome.notes]
    lines += [f"Warning: {warning}" for warning in outcome.warnings]
    return "\n".join(lines)


def _summary(outcomes: list[Outcome]) -> str:
    """One line a material."""
    rows = []
    for o in outcomes:
        fit = o.chosen.fit
        a, b = o.card.stretch_range or (1.0, 1.0)
        stable = {m: f"{r[0]:.2f}..{r[1]:.2f}" for m, r in o.chosen.stable_ranges.items()}
        rows.append(
            {
                "material": o.card.name,
                "law": fit.name,
                "rmse [kPa]": f"{fit.rmse / 1e3:.3g}",
                "of max [%]": f"{100 * fit.rmse_share:.2g}",
                "R2": f"{fit.r2:.4f}",
                "mu [kPa]": f"{o.card.small_strain.mu / 1e3:.4g}",
                "data": f"{a:.2f}..{b:.2f}",
                "stable uniaxial": stable["uniaxial"],
                "equibiaxial": stable["equibiaxial"],
                "planar": stable["planar"],
                "": "" if o.chosen.stable else "UNSTABLE",
            }
        )
    lines = _columns(rows)
    lines += [f"Note: {note}" for o in outcomes for note in o.notes]
    lines += [f"Warning: {o.card.name}: {w}" for o in outcomes for w in o.chosen.warnings]
    return "\n".join(lines)


def _columns(rows: list[dict[str, str]]) -> list[str]:
    """A text table, first column to the left."""
    head = list(rows[0])
    width = {h: max(len(h), *(len(r[h]) for r in rows)) for h in head}

    def line(cells: dict[str, str]) -> str:
        text = (
            cells[h].ljust(width[h]) if h in (head[0], head[-1]) else cells[h].rjust(width[h]) for h in head
        )
        return "  ".join(text).rstrip()

    return [line({h: h for h in head}), *map(line, rows)]
