"""Write cases of the other base kinds, diagnose each as a user does, judge it and its files; a row a case."""

from __future__ import annotations

import datetime
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from benchmarks.loop.body import BODY
from benchmarks.loop.classes import same_class
from benchmarks.loop.contract import breaches
from benchmarks.loop.files import BEGIN
from benchmarks.loop.kinds import KINDS, Bench, Kind, draw, fem_rows
from benchmarks.loop.noise import draw_noise, measured
from benchmarks.loop.rubber import RUBBER
from benchmarks.loop.run import ended
from benchmarks.loop.score import matched
from benchmarks.loop.sensing import SENSING
from benchmarks.loop.supply import SUPPLY
from benchmarks.loop.tables import add_row, columns_of
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import read_model
from fem_spa.reduced.tables import toml_text

COLUMNS = (
    "name kind effect visible seconds status verdict effects rivals right holds before after reduction "
    "problems"
).split()
RATE = 25.0
LIMIT = 1200.0


def write_bench(bench: Bench, folder: Path) -> tuple[list[Path], list[Path], float]:
    """Model and records in `folder`: all records, those to be held out (or none), oracle's RMSE there."""
    folder.mkdir(parents=True, exist_ok=True)
    kind = bench.kind
    (folder / "model.toml").write_text(toml_text(dict(bench.given)), encoding="utf-8")
    if kind.deck:
        (folder / "deck.toml").write_text(kind.deck, encoding="utf-8")
    rng = np.random.default_rng([bench.seed, 9])
    noise = draw_noise(rng)
    files, held, square, count = [], [], 0.0, 0
    chosen = {"middle", "levels2", "turned2"} if bench.seed % 2 else set()
    for plan, (t, p, y) in zip(bench.plans, bench.clean, strict=True):
        every = np.arange(0.0, t[-1], 1 / RATE)
        clean = np.stack([np.interp(every, t, c) for c in y.T], axis=1)
        loud = np.stack(
            [measured(rng, c, 1 / RATE, bench.span, float(y[0, j]), noise) for j, c in enumerate(clean.T)], 1
        )
        heads = (
            ["pressure [kPa]"] if p.shape[1] == 1 else [f"pressure {j + 1} [kPa]" for j in range(p.shape[1])]
        )
        cells = ["time [s]", *heads, *(f"{n} [{u}]" for n, u in kind.outputs.items())]
        start = BEGIN + datetime.timedelta(seconds=plan.start)
        lines = [
            f"# orientation: {np.degrees(plan.orientation):g} deg",
            "# history: cycled",
            f"# start: {start.isoformat()}",
            ",".join(cells),
        ]
        pressure = [np.interp(every, t, c) for c in p.T]
        lines += [",".join(f"{v:.6g}" for v in row) for row in np.column_stack([every, *pressure, loud])]
        path = folder / f"{plan.name}.csv"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        files.append(path)
        if plan.name in chosen:
            held.append(path)
        square += float(np.sum((loud - clean) ** 2))
        count += len(every)
    return files, held, float(np.sqrt(square / count))


def run_bench(out: Path, name: str, seed: int, effect: str | None, jobs_page: bool = True) -> dict[str, Any]:
    """One case, its row also appended to `out`/kinds.csv."""
    bench = draw(name, seed, effect, [*SUPPLY, *RUBBER, *SENSING, *BODY])
    label = f"{name}-{seed}-{bench.effect or 'null'}".replace("+", "_")
    folder, result = out / "cases" / label, out / "results" / label
    files, held, oracle = write_bench(bench, folder)
    words = ["diagnose", str(folder / "model.toml"), *(str(f) for f in files if f not in held)]
    words += ["--holdout", *map(str, held)] if held else []
    words += ["--seed", str(seed), "--out", str(result)]
    begin = time.perf_counter()
    status, told = ended(["-m", "fem_spa.cli", *words], LIMIT)
    row: dict[str, Any] = dict.fromkeys(COLUMNS, "")
    row |= {
        "name": label,
        "kind": name,
        "effect": bench.effect,
        "visible": f"{bench.visible:.4f}",
        "seconds": f"{time.perf_counter() - begin:.1f}",
        "status": status,
    }
    if status != 0:
        row["problems"] = f"status {status}: {(told.strip().splitlines() or ['silent'])[-1][:200]}"
    else:
        row |= _judged(bench, result, files, held, oracle, folder)
    add_row(out / "kinds.csv", COLUMNS, row)
    return row


def _judged(
    bench: Bench, result: Path, files: Sequence[Path], held: Sequence[Path], oracle: float, folder: Path
) -> dict[str, Any]:
    report = json.loads((result / "report.json").read_text(encoding="utf-8"))
    said = [e["name"] for e in report["effects"]]
    true = bench.effect.split("+") if bench.effect else []
    error = report["error"]["heldout"]
    problems = breaches(result, files, held, bench.kind.outputs)
    if error["before"] is not None:
        problems += refit_breach(bench.kind, folder, report, files)
    row: dict[str, Any] = {
        "verdict": report["verdict"],
        "effects": "+".join(said),
        "rivals": "+".join(n for n in report["candidates"] if n not in said),
        "right": int(matched([same_class(t) for t in true], said) and len(said) == len(true)),
        "holds": int(all(t in report["candidates"] for t in true)),
        "before": error["before"] and f"{error['before']:.4g}",
        "after": error["after"] and f"{error['after']:.4g}",
        "problems": "; ".join(problems),
    }
    if error["before"] and error["before"] > 1.25 * oracle:
        row["reduction"] = f"{(error['before'] - error['after']) / (error['before'] - oracle):.3f}"
    return row


def refit_breach(kind: Kind, folder: Path, report: dict[str, Any], files: Sequence[Path]) -> list[str]:
    """Whether `before` is what the contract's refit gives: one stiffness (or gain), offsets, no more."""
    role = {r["file"]: r["role"] for r in report["error"]["records"]}
    tables = [(columns_of(f), _orientation(f)) for f in files if role[f.name] == "train"]
    if kind.deck:
        columns, rows = fem_rows(kind.deck)
        keep = [
            next(i for i, c in enumerate(columns) if c.startswith("pressure")),
            columns.index("angle [deg]"),
        ]
        cells = ["pressure [kPa]", "angle [deg]"]
        given = {"kind": "curve", "columns": cells, "rows": [[row[i] for i in keep] for row in rows]}
        model = read_model({"model": given})
    else:
        model = read_model(folder / "model.toml")
    every = [o.name for o in model.outputs]
    sizes = [1e3 if u == "mm" else np.degrees(1.0) for u in kind.outputs.values()]

    def error(log: float) -> float:
        own = model.with_values(**{n: model.parameters[n].value * float(np.exp(log)) for n in kind.stiff})
        told, seen = [], []
        for table, way in tables:
            p = np.stack([v for k, v in table.items() if k.startswith("pressure")], axis=1)
            y = own.simulate(Drive(table["time [s]"], 1e3 * p, way))
            told.append(np.stack([y[:, every.index(n)] for n in kind.outputs], 1) * sizes)
            seen.append(np.stack([table[f"{n} [{u}]"] for n, u in kind.outputs.items()], 1))
        a, b = np.concatenate(told), np.concatenate(seen)
        if not kind.stiff:
            columns = np.column_stack([a[:, 0], np.ones(len(a))])
            left = b[:, 0] - columns @ np.linalg.lstsq(columns, b[:, 0], rcond=None)[0]
            return float(np.sqrt(np.mean(left**2)))
        left = (b - a) - (b - a).mean(axis=0)
        return float(np.sqrt(np.mean(np.sum(left**2, axis=1))))

    best = error(0.0)
    if kind.stiff:
        found = minimize_scalar(
            error, bounds=(-0.7, 0.7), method="bounded", options={"xatol": 2e-3, "maxiter": 14}
        )
        best = float(found.fun)
    told = report["error"]["train"]["before"]
    return (
        [] if abs(told / best - 1) < 0.02 else [f"train before {told:.4g}, the contract's refit {best:.4g}"]
    )


def _orientation(path: Path) -> float:
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("# orientation:"):
            return float(np.radians(float(line.split(":")[1].split()[0])))
    return 0.0


def run_kinds(out: Path, names: Sequence[str], seed: int, count: int, effects: Sequence[str]) -> None:
    """Cases of each kind; `effects` named (or "null"), else drawn by the seed."""
    out.mkdir(parents=True, exist_ok=True)
    for name in names:
        wanted: list[str | None] = [None] * count
        if effects:
            every = ("", *KINDS[name].effects) if effects == ["all"] else effects
            wanted = ["" if e == "null" else e for e in every]
        for k, effect in enumerate(wanted):
            if effect and effect not in KINDS[name].effects:
                print(f"{name} has no {effect}; it has {', '.join(KINDS[name].effects)}", flush=True)
                continue
            row = run_bench(out, name, seed + k, effect)
            print(*(row[c] for c in COLUMNS if c != "kind"), sep=" | ", flush=True)
