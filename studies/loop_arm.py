"""The arm paper's ablation in reverse: leave a component out of the rod, and let the loop find which.

Alessi, Falotico, Lucantonio (IEEE Access 2023) switch off gravity, strain gains, damping and valve one
at a time and report how much worse the rod gets (Fig. 11, Table 4). Here the records come from the whole
rod, with other numerics (another clamp and number of elements), another modulus, and noise and an offset
of each record as on a bench. The base model lacks one component; the program is told nothing but the
model file.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import read_model
from studies.loop_records import diagnose, errors, said, write_record

SUMMARY = (
    "the arm paper's ablation in reverse: which component does a rod lack, from records of the whole rod?"
)
EXPECTED = {
    "gravity": {"gravity"},
    "strain_gains": {"chamber-gain"},
    "damping": {"viscous-lag"},
    "valve": {"dead-band", "pressure-lag"},
}
PAPER = {"gravity": 1.88, "strain_gains": 1.18, "damping": 1.11, "valve": 0.27}
"""% of the arm's length that leaving it out adds to the mean error, Table 4."""
COMPONENTS = ("gravity", "strain_gains", "damping", "valve")
"""Those that `run` leaves out, one at a time."""
LENGTH = 190.0
SECONDS, RATE, TOP = 8.0, 50.0, 350.0
"""s a record, Hz, kPa."""
HELD = ("babble2", "level2")


def run(out: Path) -> int:
    """Records of the whole rod, then a report for each component left out; prints the table."""
    files = write_records(out / "records", np.random.default_rng(2023))
    held = [f for f in files if f.stem in HELD]
    train = [f for f in files if f.stem not in HELD]
    rows = []
    for component in COMPONENTS:
        model = out / f"without_{component}.toml"
        model.write_text(
            f'[model]\nkind = "rod"\npreset = "am-i-support"\n{component} = false\n', encoding="utf-8"
        )
        rows.append((component, diagnose(model, train, out / component, held)))
    print(words(rows))
    return 0


def protocols(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Name -> (n, 3) command in kPa: stretching, bending, sinusoids, babbling; two for a level arm."""
    n = round(SECONDS * RATE)
    t = np.arange(n) / RATE
    stairs = TOP * np.minimum(np.floor(t) / 6, 1.0)
    wave = TOP * 0.5 * (1 - np.cos(2 * math.pi * 0.25 * t))

    def babble() -> np.ndarray:
        levels = rng.uniform(0, TOP, (int(SECONDS) + 1, 3))
        return levels[np.floor(t).astype(int)]

    return {
        "stretch": np.outer(stairs, [1, 1, 1]),
        "bend1": np.outer(stairs, [1, 0, 0]),
        "bend2": np.outer(stairs, [0, 1, 1]),
        "sine": np.column_stack([wave, np.roll(wave, n // 6), np.roll(wave, n // 3)]),
        "babble1": babble(),
        "babble2": babble(),
        "level1": np.outer(wave, [1, 0, 0]),
        "level2": np.outer(stairs, [0, 1, 0]),
    }


def write_records(folder: Path, rng: np.random.Generator) -> list[Path]:
    """Records of the whole rod; the last two with the arm held level."""
    truth = read_model(
        {"kind": "rod", "preset": "am-i-support", "clamp": "base", "elements": 24, "modulus": "1.7 MPa"}
    )
    files = []
    for name, command in protocols(rng).items():
        time = np.arange(len(command)) / RATE
        way = math.pi / 2 if name.startswith("level") else 0.0
        tip = 1e3 * truth.simulate(Drive(time, 1e3 * command, orientation=way))
        tip = tip + rng.normal(0, 0.4, 3) + rng.normal(0, 0.2, tip.shape) + slow_noise(rng, tip.shape)
        columns = {"time [s]": time}
        columns |= {f"pressure {k + 1} [kPa]": command[:, k] for k in range(3)}
        columns |= {f"{axis} [mm]": tip[:, k] for k, axis in enumerate("xyz")}
        metadata = {"orientation": f"{math.degrees(way):g} deg", "history": "cycled", "session": "1"}
        files.append(write_record(folder / f"{name}.csv", metadata, columns))
    return files


def slow_noise(rng: np.random.Generator, shape: tuple[int, ...], size: float = 0.3) -> np.ndarray:
    """AR(1) noise with a memory of 1 s, standard deviation `size` (mm)."""
    keep = math.exp(-1 / RATE)
    noise = rng.normal(0, size * math.sqrt(1 - keep**2), shape)
    noise[0] = rng.normal(0, size, shape[1:])
    for k in range(1, len(noise)):
        noise[k] += keep * noise[k - 1]
    return noise


def by_protocol(report: dict[str, Any]) -> str:
    """Error of each protocol before and after; the held-out ones in brackets."""
    parts = []
    for record in report["error"]["records"]:
        text = f"{Path(record['file']).stem} {record['before']:.1f} to {record['after']:.1f}"
        parts.append(f"({text})" if record["role"] == "heldout" else text)
    return f"by protocol, mm: {', '.join(parts)}"


def words(rows: list[tuple[str, dict[str, Any]]]) -> str:
    """The table for the terminal."""
    lines = []
    for component, report in rows:
        names = {effect["name"] for effect in report["effects"]}
        expected = EXPECTED[component]
        found = (
            "found"
            if names == expected
            else "found in part"
            if names & expected
            else "among the rivals"
            if expected & set(report["candidates"])
            else "not found"
        )
        before, after = (report["error"]["heldout"][k] for k in ("before", "after"))
        lines.append(f"without {component}: {found} (expected {', '.join(sorted(expected))})")
        lines.append(f"  {said(report)}")
        lines.append(f"  {errors(report)}")
        lines.append(f"  {by_protocol(report)}")
        if before is not None:
            shares = f"{100 * before / LENGTH:.2f} before, {100 * after / LENGTH:.2f} after"
            cost = f"leaving it out cost the paper's rod {PAPER[component]:.2f} %"
            lines.append(f"  in % of the length: {shares}; {cost}")
    lines += [
        "The paper's figure is the mean error added over its own protocols against its bench; here modulus",
        "and offset are refitted without the component, which hides a part, and the protocols are others.",
    ]
    return "\n".join(lines)
