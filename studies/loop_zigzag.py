"""102 measured zig-zag actuators against their authors' FE: what does the FE miss?

Gunawardane et al. (IJRR 2025, doi 10.1177/02783649251364287; MIT): tip angle over 0 to 340 kPa of
actuators with chosen strain-limiting layers; 14 configurations were both measured and computed. How far
the FE misses is told configuration by configuration. What the loop is asked is the shape of the curves:
each record is one actuator, in percent of its own angle at 340 kPa, and the base model is the mean of
the FE curves, in percent of theirs. Nothing is claimed of end values. There is no time in the data: the
points stand one second apart, and each actuator is another specimen, so what is bound to a session's
history means nothing here.

All 102 then tell whether the missing effect follows the pressure or the angle, which one shape cannot.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

from studies.loop_records import data_folder, diagnose, errors, said, write_curve, write_record

SUMMARY = "102 measured zig-zag actuators against their authors' FE, configurations held out"
HELD = 5
TOP = 340.0
LEAST = 10.0
"""deg: an actuator that bends less tells nothing of the shape of its curve."""
Curves = dict[str, np.ndarray]


def run(out: Path) -> int:
    """Records, base model and report in `out`; prints what was found, and draws the curves."""
    source = data_folder("zigzag_spa_ubc")
    measured = read_curves(source / "measured_102configs.csv")
    computed = read_curves(source / "authors_fe_39configs.csv")
    shared = sorted(set(measured) & set(computed))
    fe = {name: dimensionless(computed[name], end(computed[name])) for name in shared}
    pressure = measured[shared[0]][:, 0]
    mean = np.mean([np.interp(pressure, *fe[name].T) for name in shared], axis=0)
    model = write_curve(out, pressure, mean, "angle [deg]")
    files = []
    for name in shared:
        record = dimensionless(measured[name], end(measured[name]))
        time = np.arange(len(record), dtype=float)
        columns = {"time [s]": time, "pressure [kPa]": record[:, 0], "angle [deg]": record[:, 1]}
        files.append(write_record(out / "records" / f"{name}.csv", {"specimen": name}, columns))
    held = [files[k] for k in np.linspace(1, len(files) - 2, HELD).round().astype(int)]
    report = diagnose(model, [f for f in files if f not in held], out / "diagnose", held)
    print(raw_words(measured, computed, shared))
    print(f"Shape, percent of the own end; {len(files) - HELD} configurations train, {HELD} are held out:")
    print(f"  (deg stands for percent) {errors(report)}\n  {said(report)}")
    print(knee_words(measured))
    draw(measured, fe, out / "curves.png")
    return 0


def read_curves(path: Path) -> Curves:
    """Configuration -> (n, 2), pressure (kPa) and tip angle since rest (deg)."""
    found: dict[str, list[tuple[float, float]]] = {}
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            pair = (float(row["Pressure"]), float(row["Theta6"]))
            found.setdefault(row["Configuration"], []).append(pair)
    curves = {name: np.array(sorted(rows)) for name, rows in found.items()}
    return {name: np.column_stack([c[:, 0], c[:, 1] - c[0, 1]]) for name, c in curves.items()}


def end(curve: np.ndarray) -> float:
    """Angle at 340 kPa, deg."""
    return float(np.interp(TOP, curve[:, 0], curve[:, 1]))


def dimensionless(curve: np.ndarray, scale: float) -> np.ndarray:
    """Angle in percent of `scale`, up to 340 kPa."""
    kept = curve[curve[:, 0] <= TOP + 1e-9]
    return np.column_stack([kept[:, 0], 100 * kept[:, 1] / scale])


def knee(curve: np.ndarray) -> float:
    """Pressure (kPa) from which the slope over seven points is below half of that over 60 to 140 kPa."""
    p, a = curve[:, 0], curve[:, 1] * np.sign(end(curve))
    early = (p >= 60) & (p <= 140)
    usual = np.polyfit(p[early], a[early], 1)[0]
    slope = np.array([np.polyfit(p[i - 3 : i + 4], a[i - 3 : i + 4], 1)[0] for i in range(3, len(p) - 3)])
    flat = np.nonzero((p[3:-3] > 140) & (slope < 0.5 * usual))[0]
    return float(p[3:-3][flat[0]]) if len(flat) and usual > 0 else float("nan")


def raw_words(measured: Curves, computed: Curves, shared: list[str]) -> str:
    """The FE as it is, configuration by configuration."""
    lines = ["configuration   FE end [deg]   measured end [deg]   RMSE of the FE [deg]"]
    for name in shared:
        p, a = measured[name].T
        miss = np.interp(p, *computed[name].T) - a
        rmse = np.sqrt(np.mean(miss**2))
        lines.append(f"{name:<15} {end(computed[name]):12.1f} {end(measured[name]):20.1f} {rmse:22.1f}")
    return "\n".join(lines)


def knee_words(measured: Curves) -> str:
    """Whether the flattening follows the pressure or the angle, over all that bend enough."""
    bent = [curve for curve in measured.values() if abs(end(curve)) >= LEAST]
    rows = np.array([[knee(c), abs(np.interp(knee(c), c[:, 0], c[:, 1]))] for c in bent])
    rows = rows[np.isfinite(rows[:, 0])]
    quartiles = np.percentile(rows, [25, 50, 75], axis=0)
    spread = (quartiles[2] - quartiles[0]) / quartiles[1]
    q = quartiles
    return f"""{len(rows)} of the {len(bent)} that bend by {LEAST:g} deg or more flatten, at {q[1, 0]:.0f} kPa
(quartiles {q[0, 0]:.0f} to {q[2, 0]:.0f}) and {q[1, 1]:.0f} deg (quartiles {q[0, 1]:.0f} to {q[2, 1]:.0f}):
relative quartile range {spread[0]:.2f} in pressure, {spread[1]:.2f} in angle.
A wall or a stiffening layer would act at an angle; what acts at one pressure whatever the angle is
consistent with the supply (its limit, or the pressure axis) or with the zig-zag's own walls meeting.
Pressure measured in the chamber would decide."""


def draw(measured: Curves, fe: dict[str, np.ndarray], path: Path) -> None:
    """Measured curves in percent of their own end, the FE's beside them."""
    from fem_spa.output.style import ACCENT, SECOND, figure, tidy

    picture = figure(7.0, 4.4)
    axes: Any = picture.subplots()
    for k, curve in enumerate(c for c in measured.values() if abs(end(c)) >= LEAST):
        own = dimensionless(curve, end(curve))
        axes.plot(*own.T, color=ACCENT, lw=0.7, alpha=0.35, label="measured" if k == 0 else None)
    for k, curve in enumerate(fe.values()):
        axes.plot(*curve.T, color=SECOND, lw=1.2, label="authors' FE" if k == 0 else None)
    axes.set(xlabel="pressure [kPa]", ylabel="angle / end angle [%]", title="Zig-zag actuators")
    tidy(axes)
    axes.legend(frameon=False)
    picture.savefig(path, dpi=120)
