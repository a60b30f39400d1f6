"""An answer of `diagnose` held against the contract's text, whatever the base model, without the program."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.loop.classes import FAMILY, same_class
from benchmarks.loop.tables import columns_of

VERDICTS = ("attributed", "ambiguous", "unexplained", "none", "insufficient")
TYPES: dict[str, Any] = {
    "verdict": str,
    "effects": list,
    "candidates": list,
    "error": dict,
    "signature": str,
    "excluded": list,
    "untestable": list,
    "next_experiment": (dict, type(None)),
    "seed": int,
    "versions": dict,
    "inputs": list,
}
NUMBER = (int, float)


def breaches(
    out: Path, records: Sequence[Path], held: Sequence[Path], outputs: Mapping[str, str]
) -> list[str]:
    """What of `out` is not as the contract says, in a few words each; () where all is.

    Parameters
    ----------
    records : all, in session order;  held : those named for --holdout, () where the program chose
    outputs : name -> unit that report and predictions are about
    """
    path = out / "report.json"
    if not path.is_file():
        return ["no report.json"]
    report = json.loads(path.read_text(encoding="utf-8"))
    found = [
        f"{key} missing or no {kind}" for key, kind in TYPES.items() if not isinstance(report.get(key), kind)
    ]
    if found:
        return found
    found += [f"{name} missing" for name in ("report.html",) if not (out / name).is_file()]
    found += _said(report, out)
    found += _figures(report, records, held, outputs)
    found += _predictions(report, out, records, outputs)
    names = {item.get("file") for item in report["inputs"]}
    found += [f"{r.name} not among inputs" for r in records if r.name not in names]
    found += ["an input without sha256" for i in report["inputs"] if len(i.get("sha256", "")) != 64]
    return found


def _said(report: Mapping[str, Any], out: Path) -> list[str]:
    """Verdict, effects, candidates, limits, experiment."""
    verdict, effects = report["verdict"], report["effects"]
    found = [] if verdict in VERDICTS else [f"verdict {verdict}"]
    claims = verdict in ("attributed", "ambiguous")
    if claims != (1 <= len(effects) <= 3) or (not claims and effects):
        found.append(f"{verdict} with {len(effects)} effects")
    if verdict == "ambiguous" and not any(e.get("rivals") for e in effects):
        found.append("ambiguous, none has rivals")
    if verdict == "unexplained" and not report["signature"]:
        found.append("unexplained without signature")
    union: list[str] = []
    for e in effects:
        if set(e) < {"name", "family", "probability", "rivals", "parameters"}:
            found.append(f"keys of an effect: {sorted(e)}")
            continue
        union += [e["name"], *e["rivals"]]
        if FAMILY.get(e["name"]) != e["family"]:
            found.append(f"{e['name']} of family {e['family']}")
        if not isinstance(e["probability"], float) or not 0.0 < e["probability"] < 1.0:
            found.append(f"probability {e['probability']}")
        for name, p in e["parameters"].items():
            good = {"value", "unit", "low", "high"} <= set(p) and isinstance(p["value"], NUMBER)
            if not good or any(not isinstance(p[k], (*NUMBER, type(None))) for k in ("low", "high")):
                found.append(f"parameter {name} of {e['name']}: {p}")
    if set(report["candidates"]) != set(union) or len(set(report["candidates"])) != len(report["candidates"]):
        found.append("candidates are not the union of effects and rivals")
    unknown = set(union) - set(FAMILY)
    found += [f"claims {name}" for name in unknown]
    if verdict == "attributed":
        odd = [r for e in effects for r in e["rivals"] if r not in same_class(e["name"])]
        found += [f"attributed with the rival {r}" for r in odd]
    for key, keys in (("excluded", {"name", "limit", "unit"}), ("untestable", {"name", "why"})):
        found += [f"{key}: {item}" for item in report[key] if set(item) != keys]
    found += [f"limit {i['limit']}" for i in report["excluded"] if not isinstance(i.get("limit"), NUMBER)]
    plan = report["next_experiment"]
    if plan is not None:
        missing = {"what", "why", "profile"} - set(plan)
        if missing:
            found.append(f"next_experiment lacks {sorted(missing)}")
        elif not (out / str(plan["profile"])).is_file():
            found.append("no profile of the next experiment")
    if claims and not (out / "model_next.toml").is_file():
        found.append("no model_next.toml")
    return found


def _figures(
    report: Mapping[str, Any], records: Sequence[Path], held: Sequence[Path], outputs: Mapping[str, str]
) -> list[str]:
    error = report["error"]
    found = []
    may_be_null = report["verdict"] == "insufficient"

    def number(value: Any, where: str) -> None:
        if not isinstance(value, NUMBER) and not (value is None and may_be_null):
            found.append(f"{where} is {value}")

    number(error.get("span"), "span")
    if error.get("unit") != next(iter(outputs.values())):
        found.append(f"unit {error.get('unit')}")
    for part, keys in (("train", ("before", "after")), ("heldout", ("before", "after", "floor"))):
        for key in keys:
            number(error[part].get(key, "missing"), f"{part} {key}")
    if not isinstance(error["heldout"].get("floor_from"), str):
        found.append("floor_from is no text")
    rows = error["records"]
    if sorted(r["file"] for r in rows) != sorted(p.name for p in records) and len(records) > 1:
        found.append(f"records {[r['file'] for r in rows]}")
    for row in rows:
        if row["role"] not in ("train", "heldout"):
            found.append(f"role {row['role']}")
        for key in ("before", "after"):
            number(row.get(key, "missing"), f"{row['file']} {key}")
    out_of_fit = {r["file"] for r in rows if r["role"] == "heldout"}
    if held and out_of_fit != {p.name for p in held}:
        found.append(f"held out {sorted(out_of_fit)}")
    if not held and len(records) > 1 and len(out_of_fit) != max(1, round(len(records) / 3)):
        found.append(f"{len(out_of_fit)} of {len(records)} held out")
    if report["verdict"] in ("unexplained", "none"):
        found += [
            f"{part}: after is not before"
            for part in ("train", "heldout")
            if error[part]["before"] != error[part]["after"]
        ]
    floor, after = error["heldout"].get("floor"), error["heldout"].get("after")
    if isinstance(floor, NUMBER) and isinstance(after, NUMBER) and floor > after * (1 + 1e-9):
        found.append("floor above after")
    return found


def _predictions(
    report: Mapping[str, Any], out: Path, records: Sequence[Path], outputs: Mapping[str, str]
) -> list[str]:
    """Columns and times; the report's figures are those of the predictions against the records."""
    found: list[str] = []
    heads = [f"{when} {name} [{unit}]" for name, unit in outputs.items() for when in ("before", "after")]
    role = {r["file"]: r["role"] for r in report["error"]["records"]}
    square = {part: np.zeros(3) for part in ("train", "heldout")}
    for record in records:
        path = out / "predictions" / f"{record.stem}.csv"
        if not path.is_file():
            found.append(f"no prediction of {record.name}")
            continue
        told, measured = columns_of(path), columns_of(record)
        if set(told) != {"time [s]", *heads}:
            found.append(f"predictions have {sorted(told)}")
            continue
        if not all(np.isfinite(told[h]).all() for h in heads):
            found.append(f"predictions of {record.name} are not finite")
            continue
        square[role[record.name]] += squares(told, measured, outputs)
    return found + (off(report["error"], square) if len(records) > 1 else [])


def squares(
    told: Mapping[str, np.ndarray], measured: Mapping[str, np.ndarray], outputs: Mapping[str, str]
) -> np.ndarray:
    """(3,): squares of what the prediction misses before and after, summed over the times that are known, and
    how many these are."""
    norms = []
    for when in ("before", "after"):
        miss = [
            np.interp(told["time [s]"], measured["time [s]"], measured[f"{n} [{u}]"])
            - told[f"{when} {n} [{u}]"]
            for n, u in outputs.items()
        ]
        norms.append(np.sum(np.square(miss), axis=0))
    good = np.isfinite(norms[0])
    return np.array([norms[0][good].sum(), norms[1][good].sum(), good.sum()])


def off(error: Mapping[str, Any], square: Mapping[str, np.ndarray]) -> list[str]:
    """Figures of a report that are not those of its own predictions.

    square : `squares` of the records in train and in heldout
    """
    found = []
    for part, (before, after, n) in square.items():
        for when, total in (("before", before), ("after", after)):
            value = error[part][when]
            own = float(np.sqrt(total / max(n, 1)))
            if value is not None and abs(value - own) > 0.02 * own + 1e-9:
                found.append(f"{part} {when} {value:.4g}, predictions give {own:.4g}")
    return found
