"""A two-segment arm of four chambers a segment (ASU RISE lab): from the commanded pressure to the tip.

github.com/ASU-RISE-Lab/4-chamber-softarm-control (MIT): commanded and measured pressures, motion
capture, steps of 10 s. Four runs step one chamber a segment together (1 to 10 and 15 psi): Jan10-4,
three times, and Jan10-6. The output is the tip's way sideways against the base. No model of the authors
covers it, so the base model is the straight line through the settled levels of the first run: no time in
it at all.

Asked twice: with the command as the pressure (what lies between command and tip?), and with the measured
pressure in its place (what is left behind the valve?). Two runs train, one more of the day and the other
day's are held out.
"""

from __future__ import annotations

import csv
import gzip
from pathlib import Path

import numpy as np

from studies.loop_records import data_folder, diagnose, errors, said, write_curve, write_record

SUMMARY = "steps of a two-segment arm (ASU): pressure lag, creep and cross-talk between command and tip"
RUNS = (
    "Jan10-4_data_collect_1",
    "Jan10-4_data_collect_2",
    "Jan10-4_data_collect_3",
    "Jan10-6_data_collect_1",
)
HELD = 2
PSI = 6.894757
"""kPa a psi."""
REST = 1.0
"""psi, the baseline that the authors keep in every chamber."""
Run = dict[str, np.ndarray]


def run(out: Path) -> int:
    """Records, base models and two reports in `out`; prints what was found."""
    source = data_folder("asu_4chamber_arm")
    runs = {name: read_run(source / f"{name}.csv.gz") for name in RUNS}
    for drive in ("commanded", "measured"):
        first = runs[RUNS[0]]
        low, high = settled(first)
        p = [float(np.median(first[drive][rows])) for rows in (low, high)]
        y = [float(np.median(first["tip"][rows])) for rows in (low, high)]
        slope = (y[1] - y[0]) / (p[1] - p[0])
        model = write_curve(out / drive, np.array([0.0, 2 * p[1]]), np.array([0.0, 2 * p[1] * slope]), CELL)
        files = [write(out / drive / "records" / f"{name}.csv", r, drive) for name, r in runs.items()]
        report = diagnose(model, files[:-HELD], out / drive / "diagnose", files[-HELD:])
        print(f"With the {drive} pressure as the drive\n  {errors(report)}\n  {said(report)}")
    print(talk_words(runs))
    return 0


CELL = "displacement [mm]"


def read_run(path: Path) -> Run:
    """Time (s), lower segment's commanded and measured pressure (kPa over the baseline), tip (mm)."""
    with gzip.open(path, "rt", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    raw = {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}
    tip = 1e3 * (raw["rb3_x_m"] - raw["rb1_x_m"])
    found = {
        "time": raw["time_s"] - raw["time_s"][0],
        "commanded": PSI * (raw["pd4_psi"] - REST),
        "measured": PSI * (raw["pm4_psi"] - REST),
        "tip": tip,
        "idle": raw["pm6_psi"] - np.median(raw["pm6_psi"]),
    }
    fresh = np.concatenate([[True], np.diff(found["time"]) > 0])
    return {key: values[fresh] for key, values in found.items()}


def settled(r: Run) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the last two seconds of the low and of the high holds."""
    t, p = r["time"], r["commanded"]
    changes = t[1:][np.abs(np.diff(p)) > 1.0]
    late = np.zeros(len(t), bool)
    for change in [*changes, t[-1]]:
        late |= (t > change - 2.0) & (t < change - 0.1)
    high = p > 0.5 * p.max()
    return late & ~high, late & high


def write(path: Path, r: Run, drive: str) -> Path:
    """One run as a record."""
    columns = {"time [s]": r["time"], "pressure [kPa]": r[drive]}
    if drive == "commanded":
        columns["measured pressure [kPa]"] = r["measured"]
    metadata = {"history": "cycled", "session": "2" if "Jan10-6" in path.name else "1"}
    return write_record(path, metadata, columns | {CELL: r["tip"]})


def talk_words(runs: dict[str, Run]) -> str:
    """How far the measured pressure of a chamber that is kept at its baseline follows its neighbour's."""
    lines = ["Cross-talk: pressure of the idle third chamber of the segment against the driven one"]
    for name, r in runs.items():
        slope = np.polyfit(r["measured"], PSI * r["idle"], 1)[0]
        lines.append(f"  {name}: {100 * slope:+.1f} % of the driven pressure")
    return "\n".join(lines)
