"""Where the chamber was measured, what is behind the valve is seen past a law that is not the true one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from loop_bench import SPAN, STEP, TOP, curve, noise, rich, write_case


def orifice(q: np.ndarray) -> np.ndarray:
    """Filling and venting with the square root of the difference, twice as slow down: no first-order lag."""
    x, out = 0.0, np.empty(len(q))
    for k, aim in enumerate(q):
        for _ in range(20):
            d = aim - x
            rate = 1.6 if d > 0 else 0.8
            x += np.clip(rate * np.sign(d) * np.sqrt(abs(d)) * STEP / 20, -abs(d), abs(d))
        out[k] = x
    return out


def write_measured(folder: Path) -> tuple[Path, list[Path]]:
    """An orifice before a curve that bends by a wave of 1.5 %, with the chamber's pressure in the records."""
    rng = np.random.default_rng(4)
    model, _ = write_case(folder, lambda shares: [curve(q) for q in shares], shares=rich())
    files = []
    for k, q in enumerate(rich()):
        x = orifice(q)
        angle = curve(x) - 0.07 * SPAN * np.maximum(x - 0.6, 0.0)
        y = 0.95 * angle + 1.0 + noise(rng, len(q))
        p = TOP * (x + 0.002 * rng.standard_normal(len(q)))
        table = np.column_stack([STEP * np.arange(len(q)), TOP * q, p, y])
        lines = ["# history: virgin", f"# start: 2026-03-01T10:{5 * k:02d}:00", "# orientation: 0 deg"]
        lines.append("time [s],pressure [kPa],measured pressure [kPa],angle [deg]")
        lines += [",".join(f"{v:.7g}" for v in row) for row in table]
        files.append(folder / f"chamber{k}.csv")
        files[-1].write_text("\n".join(lines) + "\n")
    return model, files


def test_an_effect_behind_the_valve_is_seen_past_the_valve(tmp_path: Path, diagnosed: Any) -> None:
    model, files = write_measured(tmp_path)
    report = diagnosed(model, files, tmp_path / "out")
    names = [e["name"] for e in report["effects"]]
    assert names[0] == "pressure-lag", json.dumps(report["reasons"])
    static = {"stiffening", "sensor-nonlinearity", "contact", "wall-thickness", "base-compliance"}
    assert len(names) == 2 and names[1] in static, names
    held = report["error"]["heldout"]
    assert held["after"] < 0.6 * held["before"]
