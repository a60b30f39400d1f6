"""Whether a test can be what it says it is. What cannot be fitted is refused; what is odd is noted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from materials.errors import MaterialError
from materials.laws import Array
from materials.registry import SOFTEST, STIFFEST
from materials.specimen import Specimen

LARGEST_STRAIN = 20.0
"""2000 %: no silicone goes further, so a bare strain above it is one in per cent."""

ODD_STRAIN = 2.0
"""A bare strain above it may be one of a few per cent: then its curve is nearly straight and very soft."""

ODD_STIFFNESS, NO_STIFFNESS = 1e5, 1e4
"""Pa: such a curve softer than the first is told of, softer than the second is refused."""


def sort_out_kind(s: Specimen, stated_kind: bool, ignore_time: bool) -> Specimen:
    """`s` with its kind (a pull that turns back is cyclic), after a look at its time column.

    Raises MaterialError where the times go back so that the order of events is not known.
    """
    turns = _turned_back(s.stretch)
    if not stated_kind and turns > 0.05:
        s = replace(s, kind="cyclic")
    if s.time is not None and not ignore_time:
        back = np.flatnonzero(np.diff(s.time) < 0) + 1
        if back.size and (s.kind != "pull" or turns > 0 or back.size > 0.01 * s.time.size):
            line = "" if s.rows is None else f" at line {int(s.rows[back[0]])}"
            raise MaterialError(
                f"{s.name}: time goes back{line} ({back.size} times in {s.time.size} rows); sort the rows, "
                "or say --ignore-time where they already stand in the order of loading"
            )
        if back.size:
            note = (
                f"{s.name}: time goes back {back.size} times, stretch never does: the order of stretch counts"
            )
            s = replace(s, time=None, notes=(*s.notes, note))
    if ignore_time and s.time is not None and np.any(np.diff(s.time) < 0):
        s = replace(s, time=None)
    if s.kind in ("relaxation", "creep") and s.time is None:
        raise MaterialError(f"{s.name}: a {s.kind} test needs a column `time [s]`")
    return s


def _turned_back(stretch: Array) -> float:
    """Largest way back against the test's own direction, as a share of its range."""
    reach = float(np.ptp(stretch))
    if reach == 0.0:
        return 0.0
    l = stretch if abs(stretch.max() - stretch[0]) >= abs(stretch.min() - stretch[0]) else -stretch
    return float(np.max(np.maximum.accumulate(l) - l)) / reach


def check(s: Specimen, said_stretch: bool, bare_strain: bool) -> Specimen:
    """`s`, without the rows after its rupture and with notes; MaterialError where it cannot be right."""
    l, p = s.stretch, s.stress
    if bare_strain and (np.max(np.abs(l - 1.0)) > LARGEST_STRAIN or np.any(l <= 0)):
        raise MaterialError(
            f"{s.name}: strain goes from {l.min() - 1:g} to {l.max() - 1:g}, which no rubber bears: "
            "is it in per cent? Then write `strain [%]`; if not, `strain [1]`"
        )
    if np.any(l <= 0):
        what = "stretch" if said_stretch else "stretch that follows from the strain"
        hint = "; if the column is a strain, call it `strain`" if said_stretch else ""
        raise MaterialError(f"{s.name}: the {what} is {l.min():g}; it must be above 0{hint}")
    if np.max(l) > 1.0 + LARGEST_STRAIN:
        raise MaterialError(
            f"{s.name}: the stretch goes up to {l.max():g}, more than a rubber bears: wrong unit or length?"
        )
    if s.kind in ("relaxation", "creep"):
        return s
    if np.ptp(l) < 1e-3:
        raise MaterialError(
            f"{s.name}: the stretch stays at {l.mean():.4g}; at least 0.1 % of change is needed"
        )
    different = np.unique(np.round(l, 9)).size
    if different < 4:
        raise MaterialError(
            f"{s.name}: only {different} different stretches in {l.size} rows; at least 4 are needed"
        )
    if np.ptp(p) == 0:
        raise MaterialError(f"{s.name}: the stress is {p[0]:g} Pa all along: is it in another column?")
    _check_origin(s, said_stretch)
    _check_steps(s)
    _check_signs(s)
    _check_modulus(s)
    s = _cut_rupture(s)
    return _check_per_cent(s) if bare_strain else s


def _check_per_cent(s: Specimen) -> Specimen:
    """A few per cent read as a few times: a rubber that goes so far bends its curve, or is far stiffer."""
    strain = s.stretch - 1.0
    top = float(strain.max())
    near, far = (strain > 0.1 * top) & (strain < 0.4 * top), strain > 0.8 * top
    if top <= ODD_STRAIN or not (near.any() and far.any()):
        return s
    secant = [float(np.median(s.stress[m] / strain[m])) for m in (near, far)]
    if not (0.85 * secant[0] < secant[1] < 1.15 * secant[0] and secant[1] < ODD_STIFFNESS):
        return s
    words = (
        f"{s.name}: strain without a unit up to {top:g}, with a stress over strain of only "
        f"{secant[1]:.2g} Pa all along: is it in per cent? Then write `strain [%]`; if not, `strain [1]`"
    )
    if secant[1] < NO_STIFFNESS:
        raise MaterialError(words)
    return replace(s, notes=(*s.notes, words))


def _check_steps(s: Specimen) -> None:
    """A measured stress does not rise by the same amount from row to row; a time or a set strain does."""
    steps = np.diff(s.stress)
    if s.stress.size >= 8 and np.std(steps) < 1e-4 * abs(float(np.mean(steps))):
        raise MaterialError(
            f"{s.name}: the stress changes by exactly {float(np.mean(steps)):g} Pa from row to row: "
            "is that column a time or a strain, and the stress in another one?"
        )


def _check_origin(s: Specimen, said_stretch: bool) -> None:
    """Near zero stress the rubber is near its rest length."""
    i = int(np.argmin(np.abs(s.stress)))
    share = abs(s.stress[i]) / float(np.max(np.abs(s.stress)))
    at, reach = float(s.stretch[i]), max(float(np.ptp(s.stretch)), 0.05)
    if share < 0.05 and s.kind == "pull" and abs(at - 1.0) > max(0.35 * reach, 0.15):
        words = "are the columns of stretch and stress in each other's place, or is it a strain?"
        if not said_stretch:
            words = "is the strain a stretch, or are the columns of strain and stress in each other's place?"
        raise MaterialError(f"{s.name}: without stress the stretch is {at:.3g} and not about 1: {words}")


def _check_signs(s: Specimen) -> None:
    """Pulled is positive, pressed is negative, in stress as in strain."""
    strain = s.stretch - 1.0
    far = (np.abs(strain) > 0.05 * np.max(np.abs(strain))) & (
        np.abs(s.stress) > 0.05 * np.max(np.abs(s.stress))
    )
    wrong = far & (strain * s.stress < 0)
    limit = 0.05 if s.kind == "pull" else 0.25
    many = wrong.sum() >= 3 or wrong.sum() > 0.25 * far.sum()
    if far.any() and many and wrong.sum() > limit * far.sum():
        i = int(np.flatnonzero(wrong)[0])
        line = "" if s.rows is None else f" (first at line {int(s.rows[i])})"
        side = (
            "tensile stress at a compressive strain"
            if s.stress[i] > 0
            else "compressive stress at a tensile strain"
        )
        raise MaterialError(
            f"{s.name}: {side} in {int(wrong.sum())} of {far.sum()} rows{line}: are compression and tension "
            "mixed, or columns wrong? Tension is positive and compression negative, in strain and in stress"
        )


def _check_modulus(s: Specimen) -> None:
    """The slope of stress over strain is that of a solid that exists, and rises."""
    strain = np.log(s.stretch)
    far = np.abs(strain) > 0.3 * np.max(np.abs(strain))
    secant = float(np.median(s.stress[far] * s.stretch[far] / strain[far]))
    if secant <= 0 or (s.kind == "pull" and np.corrcoef(s.stretch, s.stress)[0, 1] < 0.3):
        raise MaterialError(f"{s.name}: the stress does not rise with the stretch: is it in another column?")
    if not SOFTEST <= secant <= STIFFEST:
        raise MaterialError(
            f"{s.name}: stress over strain is {secant:.3g} Pa; 100 Pa to 100 GPa is allowed: "
            "is the unit of stress, the area or the gauge length wrong?"
        )


def _cut_rupture(s: Specimen) -> Specimen:
    """Without what follows a sudden loss of more than a fifth of the largest stress, for good: a row that
    stands out while the curve goes on is an outlier and ends nothing."""
    if s.kind != "pull":
        return s
    index = _without_spikes(np.abs(s.stress))
    p = np.abs(s.stress[index])
    k = int(np.argmax(p))
    top = int(index[k])
    if top >= 4 and k + 1 < p.size and p[k:].min() < 0.8 * p[k]:
        left = s.stress.size - 1 - top
        note = f"{s.name}: ruptured at stretch {s.stretch[top]:.3g}; {left} rows after it left out"
        return s.pick(np.arange(top + 1), note)
    return s


def _without_spikes(p: Array) -> Array:
    """Indices of `p` less those maxima before and after which the curve is alike."""
    index = np.arange(p.size)
    for _ in range(max(3, p.size // 20)):
        k = int(np.argmax(p[index]))
        before, after = p[index[max(0, k - 3) : k]], p[index[k + 1 : k + 4]]
        if before.size < 2 or after.size < 2:
            break
        was, goes_on = float(np.median(before)), float(np.median(after))
        if not (goes_on >= 0.9 * was and p[index[k]] > 1.1 * max(was, goes_on)):
            break
        index = np.delete(index, k)
    return index
