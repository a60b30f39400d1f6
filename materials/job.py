"""From test files to a card: read, prepare, fit, rank, and say what is not known."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np

from materials.card import Card
from materials.errors import MaterialError
from materials.fitting import Data, Variant, collect, predict, variants
from materials.laws import LAWS, Law
from materials.mullins import Mullins, fit_mullins
from materials.names import allowed
from materials.prony import Prony, fit_creep, fit_prony
from materials.ranking import Ranked, Ranking, asked_ranges, rank
from materials.reading import read_test
from materials.response import principal_stretches
from materials.rest import find_preload, find_toe, without_preload, without_toe
from materials.specimen import Specimen, first_loading, in_range, noise, outliers, thin
from materials.user_law import load_law

TOE = ("auto", "on", "off")


@dataclass(frozen=True)
class Options:
    """What a fit is asked to do.

    Parameters
    ----------
    laws : names of laws or variants, or paths of a user's .py; empty: all but `linear`
    weights : "absolute", "relative" or "noise" (see materials.fitting.collect)
    stretch : (low, high), only rows in it are fitted; None: all
    stable : fit under the constraint of stability
    stable_stretch : (low, high) over which stability is asked in each mode; None: up to the tests' I1 - 3
    toe : "auto": tests of force and displacement are freed of toe and pre-load, others are only told of;
        "on"; "off"
    drop_outliers : leave out rows that stand apart (they are named either way)
    mode : of files that do not state theirs
    ignore_time : take rows as they stand although their times are out of order
    data : folder in which test files are looked for, after the working folder
    name : of the card;  density : kg/m^3;  details : intervals of "all" laws or of the "recommended"
    """

    laws: Sequence[str] = ()
    weights: str = "absolute"
    stretch: tuple[float, float] | None = None
    stable: bool = False
    stable_stretch: tuple[float, float] | None = None
    toe: str = "auto"
    drop_outliers: bool = False
    mode: str | None = None
    ignore_time: bool = False
    data: Path | None = None
    name: str | None = None
    density: float | None = None
    details: str = "all"


@dataclass(frozen=True)
class Outcome:
    """What came of it.

    Parameters
    ----------
    card : of the recommended law
    ranking : all laws, best first
    chosen : the recommended one, with its intervals
    specimens : the rows that were fitted, before thinning
    data : the same, thinned, as fitted
    notes : what was found in the tests; warnings : what to mind about the result
    prony, mullins : where tests for them were given
    """

    card: Card
    ranking: Ranking
    chosen: Ranked
    specimens: list[Specimen]
    data: Data
    notes: list[str]
    warnings: list[str]
    prony: list[tuple[Specimen, Prony]] = field(default_factory=list)
    mullins: list[tuple[Specimen, Mullins]] = field(default_factory=list)


def data_folder(given: Path | None) -> Path | None:
    """`given`, else the folder that FEM_SPA_DATA names, else None."""
    named = os.environ.get("FEM_SPA_DATA")
    return given or (Path(named) if named else None)


def find_tests(names: Sequence[str | Path], data: Path | None = None) -> list[Path]:
    """Files of `names`: each a file, or a folder, which stands for its .csv files; looked for here and
    then in the data folder. Raises MaterialError for a name that is nowhere."""
    out: list[Path] = []
    folder = data_folder(data)
    for name in names:
        places = [Path(name)] + ([] if folder is None else [folder / name])
        found = next((p for p in places if p.exists()), None)
        if found is None:
            where = "here" if folder is None else f"here and in {folder}"
            raise MaterialError(
                f'test file "{name}" is not {where}; give a CSV file or a folder of such'
                + ("" if folder else ", or name the folder of tests with --data or FEM_SPA_DATA")
            )
        files = sorted(found.glob("*.csv")) if found.is_dir() else [found]
        if not files:
            raise MaterialError(f'folder "{name}" has no .csv file in it')
        out += files
    return out


def chosen_variants(names: Sequence[str]) -> list[Variant]:
    """Variants of `names`, which may be paths of user's laws; all but `linear` where there are none."""
    if not names:
        return variants()
    laws: dict[str, Law] = dict(LAWS)
    plain = []
    for name in names:
        if str(name).endswith(".py"):
            law = load_law(name)
            laws[law.name] = law
            plain.append(law.name)
        else:
            plain.append(str(name))
    return variants(plain, laws)


def prepare(s: Specimen, options: Options) -> tuple[Specimen | None, list[str]]:
    """The rows of `s` that are fitted, and what was noticed; None where none are left."""
    notes: list[str] = []
    if s.kind == "cyclic":
        s = first_loading(s)
    odd = outliers(s)
    if odd.size:
        lines = [] if s.rows is None else s.rows[odd[:8]].tolist()
        more = "" if odd.size <= 8 else f" and {odd.size - 8} more"
        does = "left out" if options.drop_outliers else "kept (--drop-outliers leaves them out)"
        notes.append(f"{s.name}: outliers at line {', '.join(map(str, lines))}{more}: {does}")
        if options.drop_outliers:
            keep = np.ones(s.stretch.size, bool)
            keep[odd] = False
            s = s.pick(keep)
    toe = None if options.toe == "off" else find_toe(s)
    if toe is not None:
        if options.toe == "on" or s.from_force:
            s = without_toe(s, toe)
        else:
            notes.append(
                f"{s.name}: toe up to stretch {toe.end:.3f} (the slope rises {toe.rise:.1f} times); "
                f"--toe on leaves it out and moves the rest length by {100 * (toe.rest - 1):+.1f} %"
            )
    preload = None if options.toe == "off" or toe is not None else find_preload(s)
    if preload is not None:
        if options.toe == "on" or s.from_force:
            s = without_preload(s, preload)
        else:
            notes.append(
                f"{s.name}: stress at stretch 1, as of a pre-load stretching by {100 * (preload - 1):.1f} %; "
                "--toe on counts the stretch from the unloaded length"
            )
    notes = list(s.notes) + notes
    if options.stretch is not None:
        s = in_range(s, *options.stretch)
        if s.stretch.size < 5:
            low, high = options.stretch
            return None, [
                *notes,
                f"{s.name}: fewer than 5 rows between stretch {low:g} and {high:g}; not used",
            ]
    return s, notes


def fit_tests(files: Sequence[str | Path], options: Options | None = None) -> Outcome:
    """Everything from files to an outcome.

    Raises
    ------
    MaterialError : a file cannot be used (which, where, why), a law is unknown, or nothing can be fitted
    """
    options = options or Options()
    if options.toe not in TOE:
        raise MaterialError(f'toe "{options.toe}" is not known; {allowed(options.toe, TOE)}')
    wanted = chosen_variants(options.laws)
    paths = find_tests(files, options.data)
    raw = [s for path in paths for s in read_test(path, options.mode, options.ignore_time)]
    _refuse_twice(raw)
    notes: list[str] = []
    used: list[Specimen] = []
    for s in raw:
        if s.kind in ("relaxation", "creep"):
            continue
        ready, said = prepare(s, options)
        notes += said
        if ready is not None:
            used.append(ready)
    if not used:
        why = "; ".join(notes) if notes else "only relaxation or creep tests were given"
        raise MaterialError(f"no test of stress over stretch to fit a law to ({why}); give one")
    data = collect([thin(s) for s in used], options.weights)
    low, high = options.stable_stretch or (None, None)
    ranking = rank(wanted, data, asked_ranges(data, low, high), options.stable, options.details)
    chosen = next(r for r in ranking.rows if r.name == ranking.recommended.name)
    prony, mullins, trouble = _inelastic(raw, chosen)
    warnings = [*chosen.warnings, *trouble, *_law_warnings(ranking, chosen)]
    card = _card(options, chosen, ranking, used, raw, prony, mullins)
    return Outcome(card, ranking, chosen, used, data, notes, warnings, prony, mullins)


def _refuse_twice(specimens: Sequence[Specimen]) -> None:
    """The same rows twice would count as two specimens."""
    seen: dict[tuple[str, str], str] = {}
    for s in specimens:
        key = (s.sha256, s.name.removeprefix(s.file))
        if key in seen:
            raise MaterialError(f"{seen[key]} and {s.file} are the same, byte for byte; give each test once")
        seen[key] = s.file


def fit_each(files: Sequence[Path], options: Sequence[Options]) -> list[Outcome]:
    """One outcome a file, each its own material with its own options, on all cores.

    Raises MaterialError of the first file that cannot be used.
    """
    workers = min(os.cpu_count() or 1, len(files))
    if workers < 2:
        return [fit_tests([file], own) for file, own in zip(files, options, strict=True)]
    with ProcessPoolExecutor(workers) as pool:
        return list(pool.map(_fit_one, files, options))


def _fit_one(file: Path, options: Options) -> Outcome:
    return fit_tests([file], options)


def _law_warnings(ranking: Ranking, chosen: Ranked) -> list[str]:
    """What concerns the other laws, and the choice."""
    out = [w for r in ranking.rows if r.name != chosen.name for w in r.warnings if "UNSTABLE" in w]
    if ranking.rows[0].name != chosen.name and not ranking.rows[0].stable:
        out.append(
            f"{ranking.rows[0].name} has the least held-out error but is unstable; {chosen.name} is taken"
        )
    return out + [f"{name} could not be fitted: {why}" for name, why in ranking.failed.items()]


def _inelastic(
    raw: Sequence[Specimen], chosen: Ranked
) -> tuple[list[tuple[Specimen, Prony]], list[tuple[Specimen, Mullins]], list[str]]:
    law, p = chosen.fit.law, chosen.fit.parameters
    prony, mullins, trouble = [], [], []
    for s in raw:
        try:
            if s.kind == "relaxation":
                assert s.time is not None
                held = (
                    float(np.ptp(s.stretch)) < 0.02 * abs(float(s.stretch.max()) - 1.0)
                    or np.ptp(s.stretch) == 0
                )
                elastic = None if held else predict(law, p, principal_stretches(s.mode, s.stretch))
                prony.append((s, fit_prony(s.time, s.stress, elastic)))
            elif s.kind == "creep":
                assert s.time is not None
                prony.append((s, fit_creep(s.time, s.stretch - 1.0)))
            elif s.kind == "cyclic":
                softening = fit_mullins(s, law, p)
                mullins.append((s, softening))
                left = softening.rmse / float(np.max(np.abs(s.stress)))
                if left > 0.03 or softening.r < 1.001:
                    trouble.append(
                        f"{s.name}: Mullins softening leaves {100 * left:.1f} % of the largest stress"
                        + (", r at its bound of 1" if softening.r < 1.001 else "")
                        + ": part of this loop is viscous"
                    )
        except MaterialError as error:
            trouble.append(f"{s.name}: {error}" if s.name not in str(error) else str(error))
    return prony, mullins, trouble


def slug(text: str) -> str:
    """A card's name from a file's."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-") or "material"


def _common_name(specimens: Sequence[Specimen]) -> str:
    """What the files' names begin with, where that says something; else the first one's."""
    stems = [Path(s.file).stem for s in specimens]
    same = [letters[0] for letters in takewhile(lambda c: len(set(c)) == 1, zip(*stems, strict=False))]
    common = "".join(same)
    return slug(common) if len(common) >= 4 else slug(stems[0])


def _card(
    options: Options,
    chosen: Ranked,
    ranking: Ranking,
    used: Sequence[Specimen],
    raw: Sequence[Specimen],
    prony: Sequence[tuple[Specimen, Prony]],
    mullins: Sequence[tuple[Specimen, Mullins]],
) -> Card:
    fit, u = chosen.fit, chosen.uncertainty
    noises = [v for v in map(noise, used) if math.isfinite(v)]
    table: dict[str, Any] = {
        "variant": fit.name,
        "modes": sorted({s.mode for s in used}),
        "stretch_range": [
            float(min(s.stretch.min() for s in used)),
            float(max(s.stretch.max() for s in used)),
        ],
        "r2": fit.r2,
        "rmse": {"value": float(f"{fit.rmse / 1e3:.6g}"), "unit": "kPa"},
        "cv_error": float(f"{chosen.cv:.5g}"),
        "cv_scheme": ranking.scheme,
        "weights": options.weights,
        "specimens": len(used),
    }
    if noises:
        table["noise"] = {"value": float(f"{np.median(noises) / 1e3:.3g}"), "unit": "kPa"}
    if u is not None:
        table["intervals"] = u.method + (
            "" if u.widening == 1.0 else f", widened {u.widening:.1f} times for correlated residuals"
        )
        table["correlation"] = [[float(f"{v:.4f}") for v in row] for row in u.correlation]
    stability: dict[str, Any] = {"stable": chosen.stable}
    stability.update(
        {m: [float(f"{a:.5g}"), float(f"{b:.5g}")] for m, (a, b) in chosen.stable_ranges.items()}
    )
    stability["asked"] = {m: [float(f"{a:.5g}"), float(f"{b:.5g}")] for m, (a, b) in ranking.asked.items()}
    inelastic: dict[str, Any] = {}
    if prony:
        inelastic["prony"] = prony[0][1].table()
        inelastic["prony_from"] = prony[0][0].name
    if mullins:
        inelastic["mullins"] = mullins[0][1].table()
        inelastic["mullins_from"] = mullins[0][0].name
    files = dict.fromkeys((s.file, s.sha256) for s in raw)
    return Card(
        name=options.name or _common_name(used),
        law=fit.law,
        parameters=fit.parameters,
        intervals={} if u is None else u.intervals,
        density=options.density,
        source="\n".join(f"{file} sha256 {digest}" for file, digest in files),
        fit=table,
        stability=stability,
        inelastic=inelastic,
    )


def with_source(card: Card, source: str, note: str = "") -> Card:
    """`card` with another word on where it is from."""
    return replace(card, source=source, note=note or card.note)


def table_rows(outcome: Outcome) -> list[Mapping[str, str]]:
    """The ranking as text cells, one mapping a law: for the terminal and the page."""
    unit = {"absolute": "% of max", "relative": "% of value", "noise": "noises"}
    weights = str(outcome.card.fit["weights"])
    scale = 1.0 if weights == "noise" else 100.0
    rows: list[Mapping[str, str]] = []
    for r in outcome.ranking.rows:
        cv = "open" if math.isinf(r.cv) else f"{scale * r.cv:.3g}"
        unstable = [
            f"{m} {a:.2f}..{b:.2f}"
            for m, (a, b) in r.stable_ranges.items()
            if (a, b) != tuple(outcome.ranking.asked[m])
        ]
        rows.append(
            {
                "law": ("* " if r.name == outcome.chosen.name else "  ") + r.name,
                "parameters": str(len(r.fit.values)),
                f"held-out [{unit[weights]}]": cv,
                "rmse [kPa]": f"{r.fit.rmse / 1e3:.3g}",
                "R2": f"{r.fit.r2:.5f}",
                "mu [kPa]": f"{r.fit.law.shear_modulus(**r.fit.parameters) / 1e3:.4g}",
                "stable": "yes" if r.stable else "NO, only " + ", ".join(unstable),
            }
        )
    return rows
