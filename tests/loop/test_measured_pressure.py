"""Where the chamber was measured, what is behind the valve is seen past a law that is not the true one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from loop_bench import SPAN, STEP, curve, rich, write_case


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


def bent(shares: list[np.ndarray]) -> list[np.ndarray]:
    """Behind the orifice the curve flattens from 60 % of the pressure on."""
    return [curve(x) - 0.07 * SPAN * np.maximum(x - 0.6, 0.0) for x in map(orifice, shares)]


def test_an_effect_behind_the_valve_is_seen_past_the_valve(tmp_path: Path, diagnosed: Any) -> None:
    model, files = write_case(tmp_path, bent, 4, rich(), orifice)
    report = diagnosed(model, files, tmp_path / "out")
    names = [e["name"] for e in report["effects"]]
    assert names[0] == "pressure-lag", json.dumps(report["reasons"])
    static = {"stiffening", "sensor-nonlinearity", "contact", "wall-thickness", "base-compliance"}
    assert len(names) == 2 and names[1] in static, names
    held = report["error"]["heldout"]
    assert held["after"] < 0.6 * held["before"]
