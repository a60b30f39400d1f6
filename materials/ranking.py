"""Laws side by side: each fitted, tried on what it has not seen, scanned for stability, and ranked.

Cross-validation leaves out one mode where the tests have several, else one specimen where there are
three or more, else one of five blocks of stretch. The ranking is by the error there, not by R2, which
only ever improves with more parameters. Recommended is the law of least such error among the stable
ones; of those within a twentieth of it, the one with fewest parameters.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from materials.errors import MaterialError
from materials.fitting import Data, Fit, Variant, fit, predict
from materials.identify import warnings as open_questions
from materials.intervals import Uncertainty, uncertainty
from materials.laws import Array
from materials.response import MODES
from materials.stability import reach_stretch, scan
from materials.stable_fit import fit_stable

BLOCKS = 5
NEARLY = 1.05
MOST_PRESSED = 0.2
"""Stability is not asked for below this stretch unless the user does."""


@dataclass(frozen=True)
class Ranked:
    """One law's outcome.

    Parameters
    ----------
    fit : the fit to all rows
    cv : root mean square of the weighted error on held-out rows; inf where the law could not be evaluated
    stable : in every mode, over the range asked
    stable_ranges : mode -> (low, high)
    uncertainty : None until asked for
    warnings : sentences
    """

    fit: Fit
    cv: float
    stable: bool
    stable_ranges: Mapping[str, tuple[float, float]]
    uncertainty: Uncertainty | None = None
    warnings: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the variant."""
        return self.fit.name


@dataclass(frozen=True)
class Ranking:
    """All of them, best first.

    Parameters
    ----------
    rows : by cross-validated error
    scheme : what was left out, in words
    asked : mode -> range in which stability was asked for
    failed : variant -> why it could not be fitted
    """

    rows: list[Ranked]
    scheme: str
    asked: Mapping[str, tuple[float, float]]
    failed: Mapping[str, str] = field(default_factory=dict)

    @property
    def recommended(self) -> Ranked:
        """Least cross-validated error among the stable; fewest parameters of those that are as good."""
        stable = [r for r in self.rows if r.stable] or self.rows
        good = [r for r in stable if r.cv <= NEARLY * stable[0].cv]
        return min(good, key=lambda r: (len(r.fit.values), r.cv))


def folds(data: Data) -> tuple[str, list[Array]]:
    """(what is left out, in words; masks (n,) of the rows left out)."""
    modes = sorted(set(data.mode.tolist()))
    if len(modes) > 1:
        return "one mode left out", [data.mode == m for m in modes]
    specimens = sorted(set(data.specimen.tolist()))
    if len(specimens) >= 3:
        return "one specimen left out", [data.specimen == k for k in specimens]
    order = np.argsort(data.stretches[0], kind="stable")
    masks = []
    for block in np.array_split(order, BLOCKS):
        mask = np.zeros(order.size, bool)
        mask[block] = True
        masks.append(mask)
    return f"one of {BLOCKS} blocks of stretch left out", masks


def cross_validate(
    variant: Variant, data: Data, whole: Fit, stable: Mapping[str, tuple[float, float]] | None = None
) -> float:
    """Root mean square of the weighted error over all folds; inf where a fold cannot be fitted or told.

    stable : mode -> stretches over which every fold's fit must be stable too; None: no constraint
    """
    total, count = 0.0, 0
    for mask in folds(data)[1]:
        rest = data.pick(~mask)
        if rest.stress.size < len(variant.free):
            return math.inf
        try:
            start = None if variant.law.linear else [whole.values]
            part = fit(variant, rest, start=start, reach=data.reach, thorough=False)
            if stable is not None and not scan(variant.law, part.parameters, stable)[0]:
                part = fit_stable(part, rest, stable)
        except MaterialError:
            return math.inf
        held = data.pick(mask)
        error = held.weight * (predict(variant.law, part.parameters, held.stretches) - held.stress)
        if not np.all(np.isfinite(error)):
            return math.inf
        total += float(np.sum(error**2))
        count += error.size
    return math.sqrt(total / count)


def asked_ranges(
    data: Data, low: float | None = None, high: float | None = None
) -> dict[str, tuple[float, float]]:
    """Mode -> stretches over which stability is asked: those given, else up to the tests' I1 - 3."""
    out = {}
    for mode in MODES:
        a, b = reach_stretch(mode, data.reach)
        out[mode] = (max(a, MOST_PRESSED) if low is None else low, b if high is None else high)
    return out


def rank(
    variants: Sequence[Variant],
    data: Data,
    asked: Mapping[str, tuple[float, float]] | None = None,
    only_stable: bool = False,
    details: str = "all",
) -> Ranking:
    """Fit and rank `variants`.

    Parameters
    ----------
    asked : mode -> stretch range of the stability scan; default up to the tests' I1 - 3
    only_stable : fit under the constraint of stability over `asked`
    details : intervals of "all", of the "recommended" law only, or of "none"

    Raises
    ------
    MaterialError : no law could be fitted
    """
    asked = asked_ranges(data) if asked is None else asked
    rows, failed = [], {}
    for variant in variants:
        try:
            whole = fit(variant, data)
            stable, ranges = scan(variant.law, whole.parameters, asked)
            if only_stable and not stable:
                whole = fit_stable(whole, data, asked)
                stable, ranges = scan(variant.law, whole.parameters, asked)
        except MaterialError as error:
            failed[variant.name] = str(error)
            continue
        cv = cross_validate(variant, data, whole, asked if only_stable else None)
        row = Ranked(whole, cv, stable, ranges)
        rows.append(row)
    if not rows:
        raise MaterialError("no law could be fitted: " + "; ".join(failed.values()))
    rows.sort(key=lambda r: (r.cv, -r.fit.r2))
    ranking = Ranking(rows, folds(data)[0], asked, failed)
    best = ranking.recommended.name
    rows = [
        detail(r, data, asked) if details == "all" or (details != "none" and r.name == best) else r
        for r in rows
    ]
    return Ranking(rows, ranking.scheme, asked, failed)


def detail(row: Ranked, data: Data, asked: Mapping[str, tuple[float, float]]) -> Ranked:
    """`row` with intervals and warnings."""
    u = uncertainty(row.fit, data)
    words = open_questions(row.fit, u, data)
    if row.fit.at_bound:
        words.append(f"{row.name}: {', '.join(row.fit.at_bound)} lies on the bound of what is allowed")
    if not row.stable:
        words.append(instability(row, asked, sorted(set(data.mode.tolist()))))
    return Ranked(row.fit, row.cv, row.stable, row.stable_ranges, u, tuple(words))


def instability(row: Ranked, asked: Mapping[str, tuple[float, float]], tested: Sequence[str]) -> str:
    """The sentence that names where a fit is unstable, first the modes that were not tested."""
    parts = []
    if all(b - a < 0.01 for a, b in row.stable_ranges.values()):
        parts.append("every mode, from rest on")
    for mode in sorted(MODES, key=lambda m: m in tested):
        (a, b), (low, high) = row.stable_ranges[mode], asked[mode]
        if b - a < 0.01 and parts:
            continue
        if b < high:
            parts.append(f"{mode} above stretch {b:.2f}" + (f" (and below {a:.2f})" if a > low else ""))
        elif a > low:
            parts.append(f"{mode} below stretch {a:.2f}")
    also = (
        f" though it follows the {' and '.join(tested)} test with R2 = {row.fit.r2:.4f}"
        if row.fit.r2 > 0.9
        else ""
    )
    return (
        f"{row.name}: UNSTABLE in {', '.join(parts)}{also}; --stable fits under the constraint of stability"
    )
