"""`fem-spa diagnose` on files, its answer held against the contract's text by the benchmark's own checker."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.loop.contract import breaches
from fem_spa.cli import main

TIME = np.arange(0.0, 30.0, 0.05)


def write(folder: Path, outputs: list[np.ndarray], pressure: np.ndarray) -> list[Path]:
    (folder / "curve.csv").write_text(
        "pressure [kPa],angle [deg]\n0,0\n20,15\n40,36\n60,70\n", encoding="utf-8"
    )
    (folder / "model.toml").write_text('[model]\nkind = "curve"\nfile = "curve.csv"\n', encoding="utf-8")
    files = []
    for k, y in enumerate(outputs):
        rows = "\n".join(f"{t:.3f},{p:.5g},{v:.6g}" for t, p, v in zip(TIME, pressure, y, strict=True))
        files.append(folder / f"r{k}.csv")
        files[-1].write_text(f"time [s],pressure [kPa],angle [deg]\n{rows}\n", encoding="utf-8")
    return files


@pytest.mark.parametrize("case", ["still", "foreign", "lagging"])
def test_every_answer_has_its_page_its_predictions_and_its_figures(tmp_path: Path, case: str) -> None:
    # `insufficient` once left neither page nor predictions; one branch is easily forgotten
    rng = np.random.default_rng(1)
    pressure = 30.0 * (1.0 - np.cos(TIME)) if case != "still" else np.full(len(TIME), 20.0)
    clean = np.interp(pressure, [0, 20, 40, 60], [0, 15, 36, 70])
    if case == "foreign":
        clean = 40.0 * clean
    if case == "lagging":
        clean = np.interp(TIME - 0.4, TIME, clean)
    files = write(
        tmp_path, [clean + rng.normal(0, 0.2, len(TIME)) + off for off in (0.0, 0.2, -0.1)], pressure
    )
    out = tmp_path / "out"
    assert main(["diagnose", str(tmp_path / "model.toml"), *map(str, files), "--out", str(out)]) == 0
    assert breaches(out, files, [], {"angle": "deg"}) == []
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert (report["verdict"] == "insufficient") == (case != "lagging")
    if case == "lagging":
        plan = report["next_experiment"]
        assert plan["apart"] and (out / plan["foretold"]).is_file() and "standard deviations" in plan["why"]
