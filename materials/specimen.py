"""One specimen's test, in SI, whatever file it came from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

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
