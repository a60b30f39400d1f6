"""Where a test truly begins: a toe (slack, grips that settle) or a pre-load moves its rest length."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from materials.specimen import Specimen


@dataclass(frozen=True)
class Toe:
    """A slack beginning: the stretch at which the specimen is truly at rest, and where its toe ends."""

    rest: float
    end: float
    rise: float


def find_toe(s: Specimen, bins: int = 24) -> Toe | None:
    """The toe of a tensile test, or None.

    A rubber is steepest at rest and softens; grips that settle, slack and a pre-load that was zeroed
    make the first slopes too low. The slope in bins over the first third of the strain (at most a
    stretch of 1.6) is compared with its greatest value there: a toe is a first slope below 0.7 of it.
    The tangent at the steepest place meets zero stress at the true rest (ASTM D638, annex A1).
    """
    reach = float(s.stretch.max()) - 1.0
    if reach < 0.1 or s.kind != "pull":
        return None
    top = 1.0 + min(0.6, reach / 3.0)
    index = np.flatnonzero(s.stretch <= top)
    if index.size < 9:
        return None
    l, p = s.stretch[index], s.stress[index]
    edges = np.linspace(l.min(), l.max(), min(bins, index.size // 3) + 1)
    slopes, centres = [], []
    for a, b in pairwise(edges):
        inside = (l >= a) & (l <= b)
        if inside.sum() >= 3 and np.ptp(l[inside]) > 0:
            slopes.append(float(np.polyfit(l[inside], p[inside], 1)[0]))
            centres.append(float(l[inside].mean()))
    if len(slopes) < 3:
        return None
    k = int(np.argmax(slopes))
    if k == 0 or slopes[0] > 0.7 * slopes[k] or slopes[k] <= 0:
        return None
    at = float(np.interp(centres[k], l, p))
    rest = centres[k] - at / slopes[k]
    if not l.min() - 0.05 < rest < centres[k]:
        return None
    return Toe(rest, centres[k], slopes[k] / max(slopes[0], 0.01 * slopes[k]))


def without_toe(s: Specimen, toe: Toe) -> Specimen:
    """The rows past the toe, strains counted from the true rest (ASTM D638: the origin is moved)."""
    keep = s.stretch >= toe.end
    note = f"{s.name}: toe up to stretch {toe.end:.3f} left out, rest moved by {100 * (toe.rest - 1):+.1f} %"
    picked = s.pick(keep, note)
    return replace(picked, stretch=picked.stretch - (toe.rest - 1.0))


def find_preload(s: Specimen) -> float | None:
    """The stretch that the specimen already has where its test says 1, or None.

    A specimen that was clamped under load shows a stress at stretch 1. The line through its first rows
    (an eighth of the strain, at most 0.05) is followed down to zero stress; the share of the length that it
    takes is the stretch at the start. None below 2 % of the largest stress, or beyond a stretch of 1.15.
    """
    strain = s.stretch - 1.0
    reach = float(strain.max())
    if s.kind not in ("pull", "cyclic") or reach < 0.05:
        return None
    near = np.flatnonzero((strain >= -1e-3) & (strain <= min(0.05, reach / 8.0)))
    if near.size < 3 or float(strain[near].min()) > 0.01:
        return None
    slope, at_rest = np.polyfit(strain[near], s.stress[near], 1)
    if slope <= 0 or at_rest < 0.02 * float(np.max(np.abs(s.stress))):
        return None
    stretch = 1.0 / (1.0 - min(at_rest / slope, 0.5))
    return float(stretch) if stretch < 1.15 else None


def without_preload(s: Specimen, stretch: float) -> Specimen:
    """Stretches counted from the unloaded length: all are `stretch` times larger."""
    note = f"{s.name}: pre-load: already stretched by {100 * (stretch - 1):.1f} % at its start; put right"
    return replace(s, stretch=s.stretch * stretch, notes=(*s.notes, note))
