"""A case as files: records and base model as the contract has them; beside them the truth, not passed on.

`NAME.truth.npz` has, a record, the undisturbed and the true output without noise, (2, n) in the unit shown.
"""

from __future__ import annotations

import datetime
import json
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.loop.cases import Case, observed
from benchmarks.loop.noise import measured, sampled

BEGIN = datetime.datetime(2026, 3, 2, 9, 0, 0)
POINTS = 61


def write_case(case: Case, folder: Path) -> dict[str, Any]:
    """Records, model.toml and curve.csv in `folder`, truth.json in its parent; the truth is also returned."""
    folder.mkdir(parents=True, exist_ok=True)
    _write_model(case, folder)
    chamber, output = observed(case)
    plain = case.base.respond(case.line, case.line.command)
    rng = np.random.default_rng([case.seed, 77, int(case.name[-4:])])
    unit, per = ("mm", 1e3) if case.base.springs else ("deg", np.degrees(1.0))
    oracle: dict[str, Any] = {}
    files: list[str] = []
    arrays: dict[str, np.ndarray] = {}
    for k, plan in enumerate(case.plans):
        rows = case.line.record == k
        t = sampled(rng, plan.duration, 1 / case.rate, case.noise)
        own = case.line.time[rows] - plan.start
        clean = np.interp(t, own, output[rows])
        y = measured(rng, clean, 1 / case.rate, case.base.span, case.base.offset, case.noise)
        columns = {"time [s]": t, "pressure [kPa]": np.interp(t, own, case.line.command[rows]) / 1e3}
        if case.protocol == "D+":
            p = np.interp(t, own, chamber[rows])
            columns["measured pressure [kPa]"] = (p + rng.normal(0, 0.002 * case.line.top, len(t))) / 1e3
        if case.logged and case.line.temperature is not None:
            warm = np.interp(t, own, case.line.temperature[rows])
            columns["temperature [degC]"] = warm - 273.15 + rng.normal(0, 0.05, len(t))
        columns[f"{case.base.output} [{unit}]"] = per * y
        file = f"r{k + 1:02d}_{plan.name}.csv"
        _write_record(folder / file, _metadata(case, k), columns)
        miss = (y - clean)[np.isfinite(y)]
        oracle[file] = {"n": len(miss), "square": float(per**2 * np.sum(miss**2))}
        arrays[file] = per * np.stack([np.interp(t, own, plain[rows]), clean])
        files.append(file)
    truth = {
        "name": case.name,
        "tier": case.tier,
        "seed": case.seed,
        "protocol": case.protocol,
        "target": case.target,
        "base": case.base.family,
        "material": case.base.material,
        "span": per * case.base.span,
        "unit": unit,
        "effects": [
            {
                "name": e.physics.name,
                "visible": e.visible,
                "size": e.size,
                "shape": e.shape,
                "form": e.physics.act.__name__.strip("_"),
            }
            for e in case.effects
        ],
        "noise": {k: v for k, v in vars(case.noise).items()},
        "measured_pressure": case.protocol == "D+",
        "temperature": case.logged,
        "several_loads": case.protocol == "D+",
        "records": files,
        "holdout": [file for file in files if file[4:-4] in case.holdout],
        "oracle": oracle,
    }
    np.savez_compressed(folder.parent / f"{case.name}.truth.npz", **arrays)  # type: ignore[arg-type]
    (folder.parent / f"{case.name}.truth.json").write_text(json.dumps(truth, indent=1), encoding="utf-8")
    return truth


def _metadata(case: Case, k: int) -> dict[str, str]:
    plan = case.plans[k]
    start = BEGIN + datetime.timedelta(seconds=plan.start)
    found = {
        "orientation": f"{np.degrees(plan.orientation):g} deg",
        "history": case.history if k == 0 else "cycled",
        "session": "1",
        "trial": str(k + 1),
        "start": start.isoformat(),
    }
    if case.line.payload.any() and (case.logged or case.protocol == "D+"):
        found["payload"] = f"{1e3 * plan.payload:g} g"
    if "metadata missing" in case.noise.faults:
        found = {} if case.seed % 2 else {"trial": str(k + 1)}
    return found


def _write_record(path: Path, metadata: dict[str, str], columns: dict[str, np.ndarray]) -> None:
    lines = [f"# {key}: {value}" for key, value in metadata.items()]
    lines.append(",".join(columns))
    for row in np.column_stack(list(columns.values())):
        lines.append(",".join("" if np.isnan(v) else f"{v:.6g}" for v in row))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _write_model(case: Case, folder: Path) -> None:
    base = case.base
    if base.springs:
        rng = np.random.default_rng([case.seed, 78])
        k1, k2, eta1, eta2 = (v * 1e-6 * rng.uniform(0.85, 1.15) for v in base.springs)
        text = f'[model]\nkind = "kelvin-voigt"\nk1 = "{k1:.6g} kPa/mm"\nk2 = "{k2:.6g} kPa/mm"\n'
        text += f'eta1 = "{eta1:.6g} kPa*s/mm"\neta2 = "{eta2:.6g} kPa*s/mm"\n'
    else:
        text = '[model]\nkind = "curve"\nfile = "curve.csv"\n'
        pressure = np.linspace(0.0, 1.2, POINTS) * base.top
        rows = np.column_stack([pressure / 1e3, np.degrees(base.curve(pressure))])
        body = "\n".join(f"{p:.6g},{a:.6g}" for p, a in rows)
        (folder / "curve.csv").write_text(f"pressure [kPa],angle [deg]\n{body}\n", encoding="utf-8")
    (folder / "model.toml").write_text(text, encoding="utf-8")
