"""What the studies of measured data share: where the data are, records as files, a run of `fem-spa diagnose`.

The measured data are not part of the program: docs/loop.md says where each set is from. They are looked for
in the folder that FEM_SPA_DATA names, else in `shared/data` beside the repository.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.errors import InputError


def data_folder(name: str) -> Path:
    """The folder of one data set; InputError where it is not there."""
    named = os.environ.get("FEM_SPA_DATA")
    place = Path(named) if named else Path(__file__).resolve().parents[3] / "shared" / "data"
    if not (place / name).is_dir():
        raise InputError(
            f"given {named or 'no FEM_SPA_DATA'}: the measured data {name} are not there; "
            "set FEM_SPA_DATA to the folder that holds them (docs/loop.md says where they are from)"
        )
    return place / name


def write_record(path: Path, metadata: Mapping[str, str], columns: Mapping[str, np.ndarray]) -> Path:
    """A record as the contract has it: `# key: value` lines, `name [unit]` cells, blank where not finite."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [f"# {key}: {value}" for key, value in metadata.items()]
    lines.append(",".join(columns))
    for row in np.column_stack(list(columns.values())):
        lines.append(",".join(f"{v:.8g}" if np.isfinite(v) else "" for v in row))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def write_curve(
    folder: Path, pressure: np.ndarray, values: np.ndarray, cell: str, name: str = "model"
) -> Path:
    """A `curve` model in `folder`: its CSV and its TOML, whose path is returned.

    Parameters
    ----------
    pressure : (n,) kPa;  values : (n,) in the unit of `cell`, such as "angle [deg]"
    """
    write_record(folder / f"{name}.csv", {}, {"pressure [kPa]": pressure, cell: values})
    path = folder / f"{name}.toml"
    path.write_text(f'[model]\nkind = "curve"\nfile = "{name}.csv"\n', encoding="utf-8")
    return path


def diagnose(
    model: Path, records: Sequence[Path], out: Path, holdout: Sequence[Path] = (), seed: int = 1
) -> dict[str, Any]:
    """Run `fem-spa diagnose` as a user does and read its report; InputError where it does not end well."""
    from fem_spa.cli import main

    words = ["diagnose", str(model), *map(str, records), "--seed", str(seed), "--out", str(out)]
    if holdout:
        words += ["--holdout", *map(str, holdout)]
    with contextlib.redirect_stdout(io.StringIO()):  # the studies say it in their own words
        status = main(words)
    if status != 0:
        raise InputError(f"given {model.name}: diagnose ended with status {status}; its line above says why")
    report: dict[str, Any] = json.loads((out / "report.json").read_text(encoding="utf-8"))
    return report


def kept(model: Path, records: Sequence[Path], out: Path, holdout: Sequence[Path] = ()) -> dict[str, Any]:
    """As `diagnose`; the report that is in `out` already where it is of the same files and versions."""
    from fem_spa.loop.report_json import inputs, versions

    held = {p.name for p in holdout}
    try:
        report: dict[str, Any] = json.loads((out / "report.json").read_text(encoding="utf-8"))
        roles = {row["file"]: row["role"] == "heldout" for row in report["error"]["records"]}
        same = report["inputs"] == inputs([model, *records, *holdout]) and report["versions"] == versions()
        if same and roles == {p.name: p.name in held for p in (*records, *holdout)}:
            return report
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return diagnose(model, records, out, holdout)


def said(report: Mapping[str, Any]) -> str:
    """The verdict in one line: names with their parameters, rivals, or what the remainder looks like."""
    parts = []
    for effect in report["effects"]:
        numbers = ", ".join(
            f"{name} {_number(part['value'])} {part['unit']}".strip()
            for name, part in effect["parameters"].items()
        )
        rivals = f"; not told apart from {', '.join(effect['rivals'])}" if effect["rivals"] else ""
        parts.append(f"{effect['name']} ({numbers}){rivals}")
    told = " and ".join(parts) or report.get("signature") or ""
    return f"{report['verdict']}: {told}" if told else str(report["verdict"])


def errors(report: Mapping[str, Any]) -> str:
    """Held-out error before and after, the floor, and how much of what can be explained is."""
    error = report["error"]
    unit, held = error["unit"], error["heldout"]
    if held["before"] is None:
        return "held out: no figures"
    text = f"held out: before {held['before']:.3g} {unit}, after {held['after']:.3g} {unit}"
    if held.get("floor") is not None:
        text += f", floor {held['floor']:.3g} {unit} ({held['floor_from']})"
    return text


def _number(value: float | None) -> str:
    return "?" if value is None else f"{value:.3g}"
