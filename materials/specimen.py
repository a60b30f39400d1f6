"""One specimen's test, in SI, whatever file it came from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from materials.laws import Array

KINDS = ("pull", "cyclic", "relaxation", "creep")


@dataclass(frozen=True)
class Specimen:
    """Stretch and nominal stress of one specimen.

    Parameters
    ----------
    name : the file's name, with the specimen where a file holds several
    mode : "uniaxial", "equibiaxial" or "planar"
    kind : "pull" (stretch rises or falls all the way), "cyclic", "relaxation" (stretch held) or
        "creep" (load held)
    stretch : length/rest length, (n,), positive
    stress : nominal stress, Pa, (n,)
    time : s, (n,), or None
    rows : line of each point in its file, (n,)
    file, sha256 : where it came from
    notes : what was found or done, one sentence each
    from_force : whether the file had force and displacement
    """

    name: str
    mode: str
    kind: str
    stretch: Array
    stress: Array
    time: Array | None = None
    rows: Array | None = None
    file: str = ""
    sha256: str = ""
    notes: tuple[str, ...] = ()
    from_force: bool = False

    def pick(self, index: Array, *notes: str) -> Specimen:
        """The points `index` (integers or a mask), with `notes` added."""
        return replace(
            self,
            stretch=self.stretch[index],
            stress=self.stress[index],
            time=None if self.time is None else self.time[index],
            rows=None if self.rows is None else self.rows[index],
            notes=self.notes + notes,
        )


@dataclass(frozen=True)
class Mean:
    """Mean curve and spread of several specimens of one mode on a common stretch grid."""

    mode: str
    stretch: Array
    stress: Array
    spread: Array
    count: int


def mean_curve(specimens: Sequence[Specimen], points: int = 60) -> Mean | None:
    """Mean nominal stress and standard deviation between specimens, over the stretches that all reached.

    None where there are fewer than two specimens or their ranges do not overlap. All must be of one mode.
    """
    if len(specimens) < 2:
        return None
    low = max(float(s.stretch.min()) for s in specimens)
    high = min(float(s.stretch.max()) for s in specimens)
    if not high > low:
        return None
    grid = np.linspace(low, high, points)
    curves = []
    for s in specimens:
        order = np.argsort(s.stretch, kind="stable")
        curves.append(np.interp(grid, s.stretch[order], s.stress[order]))
    stack = np.array(curves)
    return Mean(specimens[0].mode, grid, stack.mean(axis=0), stack.std(axis=0, ddof=1), len(specimens))


def first_loading(s: Specimen) -> Specimen:
    """The points of a cyclic test at which the rubber is strained further than ever before.

    Both in tension and in compression, each on its own side of the rest length.
    """
    up = s.stretch >= 1.0
    keep = np.zeros(s.stretch.size, bool)
    for side in (up, ~up):
        index = np.flatnonzero(side)
        if index.size:
            strain = np.abs(np.log(s.stretch[index]))
            before = np.concatenate([[-np.inf], np.maximum.accumulate(strain)[:-1]])
            keep[index] = strain > before
    dropped = int((~keep).sum())
    if not dropped:
        return s
    note = f"{s.name}: cyclic; its first loading ({int(keep.sum())} rows) is fitted, {dropped} others are not"
    return s.pick(keep, note)


def thin(s: Specimen, points: int = 200) -> Specimen:
    """At most `points` rows, evenly spread over the stretch (dense logging says nothing more)."""
    if s.stretch.size <= points:
        return s
    order = np.argsort(s.stretch, kind="stable")
    wanted = np.linspace(s.stretch[order[0]], s.stretch[order[-1]], points)
    picked = np.unique(np.clip(np.searchsorted(s.stretch[order], wanted), 0, order.size - 1))
    return s.pick(np.sort(order[picked]))


def in_range(s: Specimen, low: float, high: float) -> Specimen:
    """The rows with stretch in [low, high]."""
    keep = (s.stretch >= low) & (s.stretch <= high)
    return s if keep.all() else s.pick(keep)


def noise(s: Specimen) -> float:
    """Standard deviation of the stress noise, Pa, from what a parabola through neighbours leaves.

    Third differences of rows in order of stretch: they remove any locally quadratic curve. nan below
    8 rows.
    """
    if s.stretch.size < 8:
        return math.nan
    order = np.argsort(s.stretch, kind="stable")
    third = np.diff(s.stress[order], 3)
    return float(np.median(np.abs(third)) / 0.6744898 / math.sqrt(20.0))


def outliers(s: Specimen, width: int = 4, strength: float = 8.0) -> Array:
    """Indices of rows that stand out of the local curve: residual against the line through the median
    of neighbours on both sides, more than `strength` robust standard deviations, 2 % of the range, and
    0.6 of the way from one neighbour to the other (coarse points on a steep curve are no outliers)."""
    n = s.stretch.size
    if n < 2 * width + 3:
        return np.zeros(0, int)
    order = np.argsort(s.stretch, kind="stable")
    l, p = s.stretch[order], s.stress[order]
    near = np.abs(p - np.convolve(np.pad(p, 2, mode="reflect"), np.array([-1, 4, 0, 4, -1]) / 6.0, "valid"))
    suspect = np.convolve(near > 0.005 * float(np.ptp(p)), np.ones(2 * width + 1), "same") > 0
    suspect[:2] = suspect[-2:] = True
    if not suspect[2:-2].any() and near[2:-2].size:
        suspect[:] = False
        suspect[[0, 1, -2, -1]] = True
    residual = np.zeros(n)
    for i in np.flatnonzero(suspect).tolist():
        index = np.array([j for j in range(max(0, i - width), min(n, i + width + 1)) if j != i])
        degree = 2 if 0 < i < n - 1 else 1
        residual[i] = p[i] - _robust_poly(l[index] - l[i], p[index], degree)
    scale = 1.4826 * np.median(near)
    step = np.empty(n)
    step[1:-1] = 0.6 * np.abs(p[2:] - p[:-2])
    step[0], step[-1] = 1.2 * abs(p[2] - p[1]), 1.2 * abs(p[-2] - p[-3])
    limit = np.maximum(max(strength * scale, 0.02 * float(np.ptp(p))), step)
    return np.sort(order[np.abs(residual) > limit])


def _robust_poly(x: Array, y: Array, degree: int) -> float:
    """Value at 0 of a polynomial through (x, y) by a few reweighted least squares (Geman-McClure weights)."""
    span = float(np.max(np.abs(x))) or 1.0
    A = np.vander(x / span, degree + 1)
    w = np.ones_like(y)
    c = np.zeros(degree + 1)
    for _ in range(10):
        c = np.linalg.lstsq(A * w[:, None], y * w, rcond=None)[0]
        r = np.abs(y - A @ c)
        scale = 2.0 * float(np.median(r)) + 1e-12 * (float(np.max(np.abs(y))) or 1.0)
        w = 1.0 / (1.0 + (r / scale) ** 2)
    return float(c[-1])


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
