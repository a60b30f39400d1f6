"""One answer against its truth: the row of the table, and what in the answer breaks the contract."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.loop.classes import FAMILY, same_class
from benchmarks.loop.contract import VERDICTS, off, squares
from benchmarks.loop.tables import columns_of

KEYS = "verdict effects candidates error signature excluded untestable next_experiment seed versions inputs"
COLUMNS = (
    "name tier protocol target visible material base truth forms faults held status seconds peak_mb verdict "
    "effects probability rivals trained right lenient family holds set_size set_classes before after oracle "
    "floor reduction problems signature"
).split()


def score(truth: dict[str, Any], out: Path, status: int, seconds: float, said: str) -> dict[str, Any]:
    """The row of one case; `out` is the folder that `diagnose` wrote."""
    true = [e["name"] for e in truth["effects"]]
    row: dict[str, Any] = dict.fromkeys(COLUMNS, "")
    row |= {
        "name": truth["name"],
        "tier": truth["tier"],
        "protocol": truth["protocol"],
        "target": truth["target"],
        "visible": " ".join(f"{e['visible']:.4f}" for e in truth["effects"]),
        "material": truth["material"],
        "base": truth["base"],
        "truth": "+".join(true),
        "forms": "+".join(e["form"] for e in truth["effects"]),
        "faults": "+".join(truth["noise"]["faults"]),
        "held": "given" if truth["holdout"] else "chosen",
        "status": status,
        "seconds": f"{seconds:.1f}",
    }
    if status != 0 or not (out / "report.json").is_file():
        row["problems"] = f"status {status}: {_last(said)}"
        return row
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    names = [e["name"] for e in report["effects"]]
    row["peak_mb"] = next((line[8:] for line in said.splitlines() if line.startswith("PEAK_MB ")), "")
    row["verdict"], row["effects"] = report["verdict"], "+".join(names)
    row["signature"] = report["signature"] or ""
    if report["effects"]:
        row["probability"] = f"{report['effects'][0]['probability']:.3f}"
    row["rivals"] = "+".join(n for n in report["candidates"] if n not in names)
    row |= _judge(truth, true, names, report["candidates"])
    row |= _errors(truth, report)
    row["trained"] = f"{trained(truth, report):.4f}"
    row["problems"] = "; ".join(problems(truth, report, out))
    return row


def _last(said: str) -> str:
    """The last line of stderr that the program itself wrote."""
    lines = [line for line in said.splitlines() if line.strip() and not line.startswith("PEAK_MB")]
    return lines[-1][:200] if lines else "silent"


def right_names(truth: dict[str, Any], name: str) -> set[str]:
    """Names that count as right for a true effect in these records."""
    return same_class(name, truth["measured_pressure"], truth["temperature"], truth["several_loads"])


def _judge(truth: dict[str, Any], true: list[str], said: list[str], candidates: list[str]) -> dict[str, Any]:
    known = all(name in FAMILY for name in true)
    found: dict[str, Any] = {"set_size": len(candidates), "set_classes": classes_in(candidates)}
    if not true or not known:
        return found
    classes = [right_names(truth, name) for name in true]
    families = [
        {FAMILY[n] for n in (c if len(true) == 1 else {t})} for c, t in zip(classes, true, strict=True)
    ]
    found["right"] = int(len(said) == len(true) and matched(classes, said))
    found["lenient"] = int(bool(said) and any(said[0] in c for c in classes))
    found["family"] = int(
        len(said) == len(true)
        and matched(
            [f | {FAMILY[n] for n in c} for f, c in zip(families, classes, strict=True)],
            [FAMILY.get(n, n) for n in said],
        )
    )
    found["holds"] = int(all(name in candidates for name in true))
    return found


def matched(wanted: Sequence[set[str]], said: Sequence[str]) -> bool:
    """Whether each wanted set can be given a said name of its own."""
    if not wanted:
        return True
    first, rest = wanted[0], wanted[1:]
    return any(name in first and matched(rest, [*said[:k], *said[k + 1 :]]) for k, name in enumerate(said))


def classes_in(names: Sequence[str]) -> int:
    """How many classes the names fall into, taking each with those it cannot be told from, in their order."""
    left, count = list(names), 0
    while left:
        group = same_class(left[0])
        left = [n for n in left if n not in group]
        count += 1
    return count


def _errors(truth: dict[str, Any], report: dict[str, Any]) -> dict[str, Any]:
    held = [r["file"] for r in report["error"]["records"] if r["role"] == "heldout"]
    error = report["error"]["heldout"]
    before, after = error.get("before"), error.get("after")
    if before is None or after is None:
        return {}
    found = {"before": f"{before:.5g}", "after": f"{after:.5g}", "floor": error.get("floor") or ""}
    parts = [truth["oracle"][f] for f in held if f in truth["oracle"]]
    if not parts or len(held) != len(parts) or len(truth["records"]) < 2:
        return found
    oracle = float(np.sqrt(sum(p["square"] for p in parts) / sum(p["n"] for p in parts)))
    found["oracle"] = f"{oracle:.5g}"
    if before > 1.25 * oracle:
        found["reduction"] = f"{(before - after) / (before - oracle):.4f}"
    return found


def trained(truth: dict[str, Any], report: dict[str, Any]) -> float:
    """What the training records show of the effects: RMS left by gain and offset, as a share of the span."""
    arrays = np.load(Path(truth["folder"]).parent / f"{truth['name']}.truth.npz")
    names = [r["file"] for r in report["error"]["records"] if r["role"] == "train"]
    kept = [arrays[name] for name in names if name in arrays] or [arrays[name] for name in arrays]
    plain, clean = np.concatenate(kept, axis=1)
    columns = np.column_stack([plain, np.ones(len(plain))])
    left = clean - columns @ np.linalg.lstsq(columns, clean, rcond=None)[0]
    return float(np.sqrt(np.mean(left**2)) / truth["span"])


def problems(truth: dict[str, Any], report: dict[str, Any], out: Path) -> list[str]:
    """What breaks the contract, in a few words each."""
    found = [f"no key {key}" for key in KEYS.split() if key not in report]
    verdict, effects, error = report["verdict"], report["effects"], report["error"]
    if verdict not in VERDICTS:
        found.append(f"verdict {verdict}")
    if verdict in ("attributed", "ambiguous") and not 1 <= len(effects) <= 3:
        found.append(f"{verdict} with {len(effects)} effects")
    if verdict in ("unexplained", "none", "insufficient") and effects:
        found.append(f"{verdict} with effects")
    if verdict == "unexplained" and not report["signature"]:
        found.append("no signature")
    if verdict in ("unexplained", "none") and error["heldout"]["before"] != error["heldout"]["after"]:
        found.append("after is not before")
    if verdict == "ambiguous" and not any(e["rivals"] for e in effects):
        found.append("ambiguous without rivals")
    union = {e["name"] for e in effects} | {r for e in effects for r in e["rivals"]}
    if set(report["candidates"]) != union:
        found.append("candidates are not effects and rivals")
    for e in effects:
        for name, part in e["parameters"].items():
            if not {"value", "unit", "low", "high"} <= set(part):
                found.append(f"parameter {name} of {e['name']}")
        if not 0 < e["probability"] < 1:
            found.append(f"probability {e['probability']}")
        if e["name"] in ("sensor-offset", "sensor-gain"):
            found.append("claims a sensor constant")
    found += _held_out(truth, error)
    found += _predictions(truth, report, out)
    found += [f"no {name}" for name in ("report.html",) if not (out / name).is_file()]
    if (report["next_experiment"] or {}).get("profile") and not (
        out / report["next_experiment"]["profile"]
    ).is_file():
        found.append("no profile of the next experiment")
    if verdict in ("attributed", "ambiguous") and not (out / "model_next.toml").is_file():
        found.append("no model_next.toml")
    return found


def _held_out(truth: dict[str, Any], error: dict[str, Any]) -> list[str]:
    held = sorted(r["file"] for r in error["records"] if r["role"] == "heldout")
    n = len(truth["records"])
    if truth["holdout"] and held != sorted(truth["holdout"]):
        return [f"held out {held}"]
    if not truth["holdout"] and len(held) != max(1, round(n / 3)):
        return [f"{len(held)} of {n} held out"]
    return []


def _predictions(truth: dict[str, Any], report: dict[str, Any], out: Path) -> list[str]:
    """Figures of the report against its own predictions and the records, without the program's help."""
    square = {role: np.zeros(3) for role in ("train", "heldout")}
    name, unit = "displacement" if truth["unit"] == "mm" else "angle", truth["unit"]
    for record in report["error"]["records"]:
        path = out / "predictions" / record["file"]
        if not path.is_file():
            return [f"no prediction of {record['file']}"]
        told = columns_of(path)
        if not {"time [s]", f"before {name} [{unit}]", f"after {name} [{unit}]"} <= set(told):
            return [f"columns of predictions {list(told)}"]
        measured = columns_of(Path(truth["folder"]) / record["file"])
        square[record["role"]] += squares(told, measured, {name: unit})
    return [] if truth["noise"]["faults"] else off(report["error"], square)
