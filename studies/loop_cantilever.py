"""A Dragon Skin 10 beam dropped under its own weight and hung masses: what do the authors' models lack?

Dubied et al. (RA-L 2022, arXiv 2201.12560; github.com/srl-ethz/diffPD_sim2real, MIT): a beam of 100 x 30
x 30 mm, clamped at one end, held level and let go; alone, with 52 g and with 101 g at the tip; motion
capture at 100 Hz, each twice. Base model: their static COMSOL solution, tip drop over tip load (3/8 of
the beam's weight counts as tip load); in the records the load over the cross section is the `pressure`.
The first of each pair trains, the second is held out. Once all loads together, once each by itself.

Their dynamic simulation hangs the load as a force without mass. What the fitted frequencies say of that
follows.
"""

from __future__ import annotations

import csv
import gzip
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from studies.loop_records import data_folder, diagnose, errors, said, write_curve, write_record

SUMMARY = "a dropped silicone cantilever (ETH) against its authors' static solution; what hung masses add"
LOADS = {"gravity": 0.0, "load52": 0.51012, "load101": 1.00062}
"""Name in the files -> hung weight, N."""
AREA, LENGTH, DENSITY, GRAVITY = 9e-4, 0.1, 1070.0, 9.81
BEAM = AREA * LENGTH * DENSITY
"""kg, the beam's mass."""
SECONDS = 4.0


def run(out: Path) -> int:
    """Records, base model and four reports in `out`; prints what was found."""
    source = data_folder("eth_ds10_cantilever")
    drops = static_drops(source / "comsol_static_tip_points.csv")
    loads = np.array([0.0, *(kilopascal(load) for load in LOADS.values())])
    model = write_curve(out, loads, np.array([0.0, *drops]), "displacement [mm]")
    files: dict[str, list[Path]] = {"a": [], "b": []}
    for name, load in LOADS.items():
        for trial, found in files.items():
            path = source / "csv" / f"beam_{name}_V2_{trial}.csv.gz"
            found.append(record(path, load, out / "records" / f"{name}_{trial}.csv"))
    together = diagnose(model, files["a"], out / "together", files["b"])
    print(f"All loads together\n  {errors(together)}\n  {said(together)}")
    reports = {}
    for k, name in enumerate(LOADS):
        reports[name] = diagnose(model, [files["a"][k]], out / name, [files["b"][k]])
        print(f"{name} alone\n  {errors(reports[name])}\n  {said(reports[name])}")
    print(mass_words(reports, drops))
    return 0


def kilopascal(load: float) -> float:
    """Tip load that bends as the hung weight (N) and the beam's own do, over the cross section, kPa."""
    return (load + 3 / 8 * BEAM * GRAVITY) / AREA / 1e3


def static_drops(path: Path) -> list[float]:
    """Mean drop (mm) of the three tip points in the authors' static solution, load by load."""
    found: dict[str, list[float]] = {}
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            drop = float(row["undeformed_z_mm"]) - float(row["z_mm"])
            found.setdefault(row["tip_edge_load_N"], []).append(drop)
    return [float(np.mean(found[key])) for key in sorted(found, key=float)]


def record(source: Path, load: float, target: Path) -> Path:
    """One drop as a record that begins half a second before the beam is let go; mean of the tip markers."""
    with gzip.open(source, "rt", encoding="utf-8") as file:
        data = np.genfromtxt(file, delimiter=",", names=True)
    time, tip = data["time_s"], np.mean([data[f"Tip{k}_x_m"] for k in (1, 2, 3)], axis=0)
    drop = 1e3 * (np.mean(tip[:20]) - tip)
    go = int(np.argmax(drop > 0.3)) - 1
    kept = (time >= time[go] - 0.3) & (time <= time[go] + SECONDS)
    on = np.where(time > time[go] - 0.005, kilopascal(load), 0.0)
    columns = {
        "time [s]": time[kept] - time[kept][0],
        "pressure [kPa]": on[kept],
        "displacement [mm]": drop[kept],
    }
    return write_record(target, {"orientation": "90 deg", "history": "cycled"}, columns)


def frequency(report: dict[str, Any]) -> float | None:
    """Natural frequency (Hz) of an `inertia` in the report."""
    for effect in report["effects"]:
        for name, part in effect["parameters"].items():
            if effect["name"] == "inertia" and part["unit"] == "Hz":
                return float(part["value"])
            if effect["name"] == "inertia" and part["unit"] == "s" and "period" in name:
                return 1 / float(part["value"])
    return None


def mass_words(reports: dict[str, dict[str, Any]], drops: list[float]) -> str:
    """Moving mass from the frequencies and the static stiffness, beside the masses that were hung."""
    loads = np.array([3 / 8 * BEAM * GRAVITY + load for load in LOADS.values()])
    slope = np.gradient(np.array(drops) * 1e-3, loads)
    alone = 33 / 140 * BEAM
    lines = ["load      frequency [Hz]   moving mass [g]   of the beam alone [g]   hung [g]"]
    for (name, load), compliance in zip(LOADS.items(), slope, strict=True):
        f = frequency(reports[name])
        if f is None:
            lines.append(f"{name:<8} inertia was not named, so there is no frequency to read a mass from")
            continue
        mass = 1e3 / compliance / (2 * np.pi * f) ** 2
        lines.append(f"{name:<8} {f:15.2f} {mass:17.0f} {1e3 * alone:23.0f} {1e3 * load / GRAVITY:10.0f}")
    found = [frequency(r) for r in reports.values()]
    if None in found:
        lines.append("Without the frequencies nothing is said of the payload's inertia.")
    elif all(a > b for a, b in pairwise(f for f in found if f is not None)):
        lines.append(
            "A load that is a force without mass would leave the first frequency about as it is. It falls,\n"
            "and the moving mass grows by about what was hung: consistent with the payload's inertia,\n"
            "which the authors' dynamic model lacks."
        )
    else:
        lines.append("The frequency does not fall with the load: nothing speaks for the payload's inertia.")
    return "\n".join(lines)
