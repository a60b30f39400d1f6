"""The signatures of named effects, before and after: a table for report.json, a line for a person."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.signatures.measure import gauge, seen
from fem_spa.loop.signatures.statistic import Seen
from fem_spa.loop.signatures.unmarked import NOISE, without
from fem_spa.output.words import number

if TYPE_CHECKING:
    from fem_spa.loop.diagnose import Study

PARTLY = " (what of it shows, at most)"
MOSTLY = 0.25
"""Share of the figure before that may be left of one that is called gone."""


def signature_of(name: str, study: Study, size: float, unit: str) -> dict[str, Any] | None:
    """Statistic in words, its value and standard deviations of noise before and after; None without one.

    Parameters
    ----------
    size, unit : SI units of the output in one unit shown, and that unit
    """
    statistic = EFFECTS[name].signature
    if statistic is None:
        return None
    table: dict[str, Any] = {
        "statistic": statistic.words,
        "unit": unit if statistic.unit == "output" else statistic.unit,
        "expected_sign": statistic.sign or None,
    }
    what, before = _seen(name, study)
    made = gauge(statistic, what, study.decision.noise)
    if isinstance(made, str):
        none = dict.fromkeys(("before", "after", "z_before", "z_after"))
        return {**table, "at": "", **none, "why_not": made}
    read = made.read(before, residual(study, study.after_rows))
    one = size if statistic.unit == "output" or read.partly else 1.0
    if read.partly:
        table |= {"statistic": statistic.words + PARTLY, "unit": unit}
    return {
        **table,
        "at": read.at,
        "before": read.values[0] / one,
        "after": read.values[1] / one,
        "z_before": read.deviations[0],
        "z_after": read.deviations[1],
        "why_not": None,
    }


def _seen(name: str, study: Study) -> tuple[Seen, np.ndarray]:
    """What the statistic may look at, and (n, d) what is left before.

    By the refitted base, or by the model with the other effects in it where several are named. Of a lattice
    its step, too, and what is rounded to it.
    """
    base, data = study.case.chain, study.case.data
    if name == "quantisation":
        after = study.after
        theta = next(t for e, t in zip(after.effects, after.thetas, strict=True) if e.name == name)
        smooth = without(after, name)
        sensed = smooth.response(data, smooth.thetas, smooth.base.values)
        return seen(base, data, theta, sensed), residual(study, study.before_rows)
    found = study.decision.best.trial.fit.chain
    if len(found.effects) > 1 and name in [e.name for e in found.effects]:
        rest = without(found, name)
        return seen(rest, data), data.output - rest.predict(data)
    return seen(base, data), residual(study, study.before_rows)


def residual(study: Study, predictions: list[np.ndarray]) -> np.ndarray:
    """(n, d) output less predictions given at the records' own samples, on the grid of the search."""
    case = study.case
    out = case.data.output.copy()
    for record, fine, coarse, rows in zip(
        case.split.records, case.full.runs, case.data.runs, predictions, strict=True
    ):
        block = round(coarse.step / fine.step)
        n = coarse.part.stop - coarse.part.start
        grid = record.time[0] + fine.step * np.arange(n * block)
        columns = np.stack([np.interp(grid, record.time, column) for column in rows.T], axis=1)
        out[coarse.part] -= columns.reshape(n, block, -1).mean(axis=1)
    return out


def cells(mark: Mapping[str, Any]) -> tuple[str, str, str]:
    """Before, after, and what to make of it."""
    if mark["before"] is None:
        return "", "", f"these records cannot show it: {mark['why_not']}"
    before, after, z = mark["before"], mark["after"], (mark["z_before"], mark["z_after"])
    figures = [
        f"{number(v, 2)} {mark['unit']} ({_times(s)})" for v, s in zip((before, after), z, strict=True)
    ]
    if abs(z[0]) < NOISE:
        return figures[0], figures[1], "was hardly there before"
    if mark["expected_sign"] and mark["expected_sign"] * before < 0.0:
        return figures[0], figures[1], "was there with the other sign"
    if abs(z[1]) < NOISE:
        return figures[0], figures[1], "was there, is gone"
    share = abs(after / before)
    word = "was there, mostly gone" if share < MOSTLY else f"{100 * share:.0f} % of it is still there"
    return figures[0], figures[1], word


def _times(deviations: float) -> str:
    """How often a figure is its noise."""
    z = abs(deviations)
    return f"{z:.1f} times its noise" if z < 10.0 else f"{z:.0f} times its noise"
