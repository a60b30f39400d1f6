"""The next experiment: the primitive that would tell the rivals apart, with a pressure profile to run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.pictures import foretold_picture
from fem_spa.loop.report_json import unit_size
from fem_spa.loop.rival_curves import Foretold, explanations, foretell, words
from fem_spa.output.files import write_whole

if TYPE_CHECKING:
    from fem_spa.loop.diagnose import Study

STEP = 0.05
"""s between the rows of a profile."""

WHAT: dict[str, str] = {
    "rates": "the same triangle at three rates, 16-fold apart, then minor loops at two offsets",
    "hold and recovery": "hold at two levels for a minute each, then unload and watch the recovery",
    "amplitude ladder": "amplitudes 0.4, 0.4, 0.7, 0.7, 1, 1, 0.4 of the largest pressure, rest, repeat",
    "rest": "the same five cycles, a long rest, and the same five cycles again",
    "warm-up": "log the temperature; warm the actuator without driving it, then run the same cycles",
    "zero load": "log the sensor at zero pressure for ten minutes, nothing driven",
    "steps": "steps up and down with the fastest sampling the sensor has",
    "measured pressure": "log the pressure at the actuator during steps up and down",
    "low ramp": "a slow ramp from zero to a quarter of the largest pressure, and back",
    "slow ramp": "a slow ramp up and down, ten times slower than so far",
    "overdrive": "log the pressure at the actuator on a ramp to the largest pressure",
    "closed valve": "fill, shut the valve, and watch for a minute; then the same with the valve open",
    "flip": "the same cycles with the actuator mounted upside down",
    "known masses": "the same cycles with two known masses at the tip",
    "second sensor": "the same cycles with a second sensor, or the sensor turned on a goniometer",
    "base marker": "a marker on the base, and the same cycles",
    "second specimen": "the same cycles with a second specimen of measured wall",
    "single chambers": "each chamber alone, then all together",
    "repeat first record": "the first record once more",
}


def profile(kind: str, top: float) -> np.ndarray:
    """(n, 2) time (s) and pressure (Pa) of a primitive; pressures up to `top`."""
    points: list[tuple[float, float]]
    if kind in ("hold and recovery", "closed valve"):
        points = [(0, 0), (1, 0.5), (61, 0.5), (62, 1), (122, 1), (123, 0), (183, 0)]
    elif kind == "amplitude ladder":
        points, t = [(0.0, 0.0)], 0.0
        for a in (0.4, 0.4, 0.7, 0.7, 1.0, 1.0, 0.4):
            points += [(t + 5.0, a), (t + 10.0, 0.0)]
            t += 10.0
    elif kind in ("steps", "measured pressure"):
        points, t = [(0.0, 0.0)], 1.0
        for a in (0.5, 0.0, 1.0, 0.0, 0.8, 0.3, 1.0, 0.0):
            points += [(t, points[-1][1]), (t + 0.05, a), (t + 4.0, a)]
            t += 4.05
    elif kind in ("low ramp", "slow ramp", "overdrive"):
        a = 0.25 if kind == "low ramp" else 1.0
        points = [(0, 0), (90, a), (180, 0)]
    elif kind == "rates":
        points, t = [(0.0, 0.0)], 0.0
        for period in (2.0, 2.0, 8.0, 8.0, 32.0, 32.0):
            points += [(t + 0.5 * period, 1.0), (t + period, 0.0)]
            t += period
        for offset in (0.3, 0.6):
            points += [(t + 4, offset + 0.3)]
            for _ in range(3):
                points += [(t + 8, offset), (t + 12, offset + 0.3)]
                t += 8.0
            t += 8.0
        points.append((t + 10.0, 0.0))
    elif kind == "zero load":
        points = [(0, 0), (600, 0)]
    else:
        points = [(0.0, 0.0)]
        for k in range(5):
            points += [(10.0 * k + 5.0, 1.0), (10.0 * k + 10.0, 0.0)]
    table = np.array(points, float)
    time = np.arange(0.0, table[-1, 0] + 0.5 * STEP, STEP)
    return np.column_stack([time, top * np.interp(time, table[:, 0], table[:, 1])])


MENU = ("steps", "amplitude ladder", "rates", "slow ramp", "low ramp", "hold and recovery", "flip")
"""What may be tried in place of an effect's own experiment, cheapest first."""
SURE = 5.0
"""Whitened distance at which two explanations are told apart without doubt."""


@dataclass(frozen=True)
class Plan:
    """What to do next: the kind, why, the profile (n, 2) s and Pa, and what is foretold, if anything is."""

    kind: str
    why: str
    table: np.ndarray
    told: Foretold | None = None


def plan(study: Study) -> Plan | None:
    """The experiment that tells the explanations apart; None where nothing is open.

    An effect's own experiment, where it leaves the nearest two `SURE` apart or needs another sensor; else the
    cheapest of the menu that does, else the one that does best.
    """
    d = study.decision
    if d.verdict in ("none", "insufficient"):
        return None
    top = study.after.p_max
    if d.verdict == "unexplained":
        why = "loops at three rates and two offsets tell memory, rate and static shape apart"
        return Plan("rates", why, profile("rates", top))
    rivals = list(dict.fromkeys(r for rs in d.rivals.values() for r in rs))
    if rivals:
        first = next(n for n in d.chosen if d.rivals.get(n))
        why = f"it would tell {first} from {', '.join(d.rivals[first])}"
    else:
        first = d.chosen[0]
        why = f"an intervention of its own would confirm {first}"
    chains = explanations(study)
    own = EFFECTS[first].experiment
    kinds = [own, *(k for k in MENU if k != own and not study.after.base.slow)]
    best: Foretold | None = None
    for kind in kinds if chains else ():
        told = foretell(study, kind, profile(kind, top), chains)
        if told is not None and (best is None or told.least > best.least):
            best = told
        if best is not None and best.least >= SURE:
            break
    if (
        best is None or best.least < 1.0
    ):  # the output alone would not tell: what its own experiment measures does
        told = foretell(study, own, profile(own, top), chains) if chains else None
        return Plan(own, why, profile(own, top), told)
    return Plan(best.kind, why, profile(best.kind, top), best)


def propose(study: Study, out: Path) -> dict[str, Any] | None:
    """The plan as the report has it; its profile goes to `next_experiment.csv`, the curves beside it."""
    made = plan(study)
    if made is None:
        return None
    chambers = study.case.data.pressure.shape[1]
    heads = ["pressure [kPa]"] if chambers == 1 else [f"pressure {j + 1} [kPa]" for j in range(chambers)]
    lines = [",".join(["time [s]", *heads])]
    lines += [",".join([f"{t:.4g}", *([f"{p / 1e3:.6g}"] * chambers)]) for t, p in made.table]
    write_whole(out / "next_experiment.csv", "\n".join(lines) + "\n")
    found: dict[str, Any] = {"what": WHAT[made.kind], "why": made.why, "profile": "next_experiment.csv"}
    told = made.told
    if told is None:
        return found
    name = study.after.base.names[0]
    unit = study.case.split.records[0].units[name]
    size = unit_size(unit, name)
    found["why"] += "; " + words(told, unit, size)
    columns = [
        (f"{label}: {output} [{unit}]", curve[:, j] / size)
        for label, curve in told.curves.items()
        for j, output in enumerate(study.after.base.names)
    ]
    table = np.column_stack([told.time, *(c for _, c in columns)])
    text = "\n".join(
        [
            ",".join(["time [s]", *(h for h, _ in columns)]),
            *(",".join(f"{v:.6g}" for v in row) for row in table),
        ]
    )
    write_whole(out / "next_experiment_foretold.csv", text + "\n")
    found["foretold"] = "next_experiment_foretold.csv"
    found["apart"] = [
        {"between": list(pair), "largest": largest * told.noise / size, "unit": unit, "deviations": far}
        for pair, (largest, far) in told.apart.items()
    ]
    picture = foretold_picture(told, study.after.base.names, unit, size, WHAT[made.kind])
    write_whole(out / "next_experiment.png", picture)
    return found
