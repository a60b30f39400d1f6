"""The static curve: bends, hinges, plateaus, the same up and down and at every rate."""

from __future__ import annotations

import numpy as np

from fem_spa.loop.signatures.loops import gap
from fem_spa.loop.signatures.shapes import none, powers, weight
from fem_spa.loop.signatures.statistic import Contrast, Seen, Statistic

PLACES = (0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85)
"""Shares of the motion at which a hinge is looked for."""
LOW = (0.02, 0.05, 0.08, 0.12, 0.18, 0.26)
"""Shares of the pressure at which a threshold is looked for."""
HIGH = (0.55, 0.65, 0.75, 0.85, 0.92)
"""Shares of the pressure at which a plateau is looked for."""


def _size(seen: Seen) -> np.ndarray:
    """(n, 1) how far the actuator is bent, as a share."""
    s = seen.share
    return np.abs(s) if s.shape[1] == 1 else np.sqrt(np.mean(s**2, axis=1, keepdims=True))


def bend(seen: Seen) -> tuple[Contrast, ...]:
    """The middle of the range above the line that joins its ends."""
    s = seen.share
    return (Contrast(4.0 * (s - s * np.abs(s)) * weight(seen), none(seen), seen.record),)


def bends(seen: Seen) -> tuple[Contrast, ...]:
    """The same, or an S besides."""
    s, record = seen.share, seen.record
    middle = 4.0 * (s - s * np.abs(s)) * weight(seen)
    wave = 10.4 * s * (1.0 - np.abs(s)) * (1.0 - 2.0 * np.abs(s)) * weight(seen)
    return (
        Contrast(middle, none(seen), record, "in the middle"),
        Contrast(wave, middle[:, :, None], record, "below and above the middle, unlike"),
    )


def hinge(seen: Seen) -> tuple[Contrast, ...]:
    """Motion gained or lost beyond one place; smooth bends do not count."""
    r, beside, record = _size(seen), powers(seen, 3), seen.record
    way = seen.share / np.maximum(r, 1e-9) * weight(seen)
    top = float(r[seen.rows].max())
    return tuple(
        Contrast(
            np.maximum(r - p * top, 0.0) / ((1.0 - p) * top) * way,
            beside,
            record,
            f"at {100 * p:.0f} % of the motion",
        )
        for p in PLACES
    )


def _way(seen: Seen) -> np.ndarray:
    """(n, d) which way outputs go under the pressure, by how far they go."""
    return np.asarray(np.sign(seen.context.drive)[:, None] * seen.way * weight(seen))


def plateau(seen: Seen) -> tuple[Contrast, ...]:
    """Motion missing at the largest pressures."""
    u, beside, record = np.abs(seen.context.drive)[:, None], powers(seen, 3), seen.record
    return tuple(
        Contrast(
            -np.maximum(u - p, 0.0) / (1.0 - p) * _way(seen),
            beside,
            record,
            f"above {100 * p:.0f} % of the pressure",
        )
        for p in HIGH
    )


def threshold(seen: Seen) -> tuple[Contrast, ...]:
    """Motion missing at low pressure and beyond, or below a threshold only, or after each reversal."""
    u, beside, record = np.abs(seen.context.drive)[:, None], powers(seen, 3), seen.record
    found = []
    for p in LOW:
        lost = np.minimum(u, p) / p * _way(seen)
        only = lost * (u < p)
        place = f"{100 * p:.0f} % of the pressure"
        found.append(Contrast(-lost, beside, record, f"up to {place}"))
        found.append(Contrast(-only, beside, record, f"below {place} only"))
    turned = [Contrast(c.pattern, c.beside, c.groups, "after each reversal") for c in gap(seen)]
    return (*found, *turned)


def proportion(seen: Seen) -> tuple[Contrast, ...]:
    """Motion in proportion to the pressure, beside the base's curve."""
    return (Contrast(seen.context.drive[:, None] * seen.way * weight(seen), none(seen), seen.record),)


def axis(seen: Seen) -> tuple[Contrast, ...]:
    """Share by which the pressure acts as if larger: another shape of the curve."""
    more = (seen.respond(1.02 * seen.context.data.pressure) - seen.response) / 0.02
    return (Contrast(0.01 * more, none(seen), seen.record),)


BEND = Statistic("middle of the curve above the line between its ends", 1, bend)
BENDS = Statistic("bend of the reading against the motion", 0, bends)
HINGE = Statistic("motion gained or lost beyond one place, at full motion", 0, hinge)
PLATEAU = Statistic("motion missing at the largest pressures", 1, plateau)
THRESHOLD = Statistic("motion missing at low pressure, or after reversals", 1, threshold)
PROPORTION = Statistic("motion in proportion to the pressure, at full pressure", 1, proportion)
AXIS = Statistic("pressure that acts as if larger (or smaller)", 0, axis, "%")
