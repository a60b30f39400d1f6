"""A calibration in words and as calibration.json."""

from __future__ import annotations

import math
from typing import Any

from fem_spa import __version__
from fem_spa.calibration.outcome import Fitted, Outcome
from fem_spa.reduced.tables import factor
from fem_spa.units import KINDS, show


def quantity_text(value: float, unit: str) -> str:
    """A value in SI as people write it: in the unit's habit, else in the parameter's own unit."""
    if not math.isfinite(value):
        return "unknown" if math.isnan(value) else ("inf" if value > 0 else "-inf")
    if unit in ("", "1"):
        return f"{value:.4g}"
    if unit in KINDS and unit in ("Pa", "m", "kg/m^3", "N"):
        return show(float(f"{value:.4g}"), unit)
    return f"{value / factor(unit):.4g} {unit}"


def _plain(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def number_table(number: Fitted) -> dict[str, Any]:
    """One entry of `parameters`."""
    one = factor(number.unit)
    table: dict[str, Any] = {
        "value": _plain(number.value / one),
        "unit": number.unit,
        "low": _plain(number.low / one),
        "high": _plain(number.high / one),
        "start": _plain(number.start / one),
        "bounds": [_plain(end / one) for end in number.bounds],
        "accepted": not number.refused,
    }
    if number.wanted is not None:
        table |= {"wanted": _plain(number.wanted / one), "why": number.why, "missing effect?": number.advice}
    return table


def record(outcome: Outcome, given: str, seed: int) -> dict[str, Any]:
    """Content of calibration.json."""
    shown = outcome.shown

    def pair(index: int) -> dict[str, float | None]:
        return {
            "before": _plain(shown(outcome.before[index])),
            "after": _plain(shown(outcome.after[index])),
        }

    return {
        "status": outcome.status,
        "message": verdict(outcome),
        "kind": outcome.kind,
        "given": given,
        "effects held": list(outcome.effects),
        "outputs": list(outcome.outputs),
        "parameters": {number.name: number_table(number) for number in outcome.parameters},
        "error": {
            "unit": outcome.unit,
            "span": _plain(shown(outcome.span)),
            "train": pair(0),
            "heldout": pair(1),
            "records": [
                {
                    "file": run.path.name,
                    "role": role,
                    "before": _plain(shown(before)),
                    "after": _plain(shown(after)),
                    "rows": int(run.use.sum()),
                    "sha256": run.sha256,
                }
                for run, role, before, after in outcome.runs
            ],
        },
        "range": {
            "unit": "kPa",
            "low": [p / 1e3 for p in outcome.valid.low],
            "high": [p / 1e3 for p in outcome.valid.high],
            "source": outcome.valid.source,
        },
        "correlation": outcome.correlation.tolist(),
        "FE runs" if outcome.kind == "finite elements" else "simulations": outcome.evaluations,
        "iterations": outcome.iterations,
        "warnings": outcome.warnings,
        "notes": outcome.notes,
        "seed": seed,
        "versions": {"fem_spa": __version__},
    }


def verdict(outcome: Outcome) -> str:
    """One sentence: the error before and after on held-out data, and what was refused."""
    unit, shown = outcome.unit, outcome.shown
    before, after = shown(outcome.before[1]), shown(outcome.after[1])
    share = 100 * outcome.after[1] / outcome.span if outcome.span > 0 else math.nan
    text = (
        f"Held-out error {before:.3g} {unit} before, {after:.3g} {unit} after calibration "
        f"({share:.2g} % of the range)"
    )
    if outcome.effects:
        text += f", {' and '.join(outcome.effects)} held as in the model file"
    refused = [number for number in outcome.parameters if number.refused]
    if outcome.status == "interrupted":
        return f"{text}; interrupted, so these are the best values so far, without intervals."
    if refused:
        names = ", ".join(number.name for number in refused)
        return f"{text}; {names} would leave what physics allows, so a missing effect is likelier."
    return f"{text}."


def lines(outcome: Outcome) -> list[str]:
    """For the terminal: parameters, refusals, warnings."""
    out = [verdict(outcome)]
    for number in outcome.parameters:
        value = quantity_text(number.value, number.unit)
        ends = f"{quantity_text(number.low, number.unit)} to {quantity_text(number.high, number.unit)}"
        start = quantity_text(number.start, number.unit)
        if number.wanted is not None:
            wanted = quantity_text(number.wanted, number.unit)
            low, high = (quantity_text(end, number.unit) for end in number.bounds)
            out.append(
                f"  {number.name}: not accepted, kept at {start}. The data ask for {wanted}, allowed is "
                f"{low} to {high} ({number.why}). Missing effect? {number.advice}"
            )
        else:
            out.append(f"  {number.name} = {value}  (95 %: {ends}; before {start})")
    out += [f"Warning: {text}" for text in outcome.warnings]
    out += [f"Note: {text}" for text in outcome.notes]
    return out
