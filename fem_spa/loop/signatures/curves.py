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
SIZE = 0.02
"""Share of a clamp's compliance of size one whose answer is taken for linear."""
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
    r, beside, record = _size(seen), powers(seen, 2), seen.record
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


def _peak(seen: Seen, pattern: np.ndarray) -> np.ndarray | None:
    """A pattern whose largest row is one; None where it moves nothing."""
    size = np.abs(pattern[seen.rows]).max()
    return pattern / size if size > 1e-6 * seen.scale.max() else None


def _through(seen: Seen, made: list[tuple[np.ndarray, str]]) -> tuple[Contrast, ...]:
    """What other pressures do through the base, smooth curves put aside."""
    beside, record = powers(seen, 3), seen.record
    found = [(_peak(seen, seen.respond(pressure) - seen.response), place) for pressure, place in made]
    return tuple(Contrast(p, beside, record, place) for p, place in found if p is not None)


def plateau(seen: Seen) -> tuple[Contrast, ...] | str:
    """Motion missing at the largest pressures."""
    pressure, top = seen.context.data.pressure, seen.context.p_max
    made = [
        (np.clip(pressure, -share * top, share * top), f"above {100 * share:.0f} % of the pressure")
        for share in HIGH
    ]
    return _through(seen, made) or "no pressure is high"


def threshold(seen: Seen) -> tuple[Contrast, ...]:
    """Motion missing beyond a threshold, or below it only, or after each reversal."""
    pressure, top = seen.context.data.pressure, seen.context.p_max
    made = []
    for share in LOW:
        beyond = np.sign(pressure) * np.maximum(np.abs(pressure) - share * top, 0.0)
        above = np.where(np.abs(pressure) < share * top, 0.0, pressure)
        place = f"{100 * share:.0f} % of the pressure"
        made += [(beyond, f"up to {place}"), (above, f"below {place} only")]
    turned = [Contrast(c.pattern, c.beside, c.groups, "after each reversal") for c in gap(seen)]
    return (*_through(seen, made), *turned)


def proportion(seen: Seen) -> tuple[Contrast, ...] | str:
    """A turn in proportion to the pressure, or of the clamp that the base carries itself."""
    name = "base-compliance"
    if name in seen.context.physical:
        pattern = _peak(seen, seen.loaded(name, np.array([SIZE])) - seen.response)
        return "the model does not answer to it" if pattern is None else (Contrast(pattern, none(seen)),)
    return (Contrast(seen.context.drive[:, None] * weight(seen), none(seen), seen.record),)


def axis(seen: Seen) -> tuple[Contrast, ...]:
    """Share by which the pressure acts as if larger: another shape of the curve."""
    more = (seen.respond(1.02 * seen.context.data.pressure) - seen.response) / 0.02
    return (Contrast(0.01 * more, none(seen), seen.record),)


BEND = Statistic("middle of the curve above the line between its ends", 1, bend)
BENDS = Statistic("bend of the reading against the motion", 0, bends)
HINGE = Statistic("motion gained or lost beyond one place, at full motion", 0, hinge)
PLATEAU = Statistic("motion missing at the largest pressures, at most", 1, plateau)
THRESHOLD = Statistic("motion missing at low pressure, or after reversals, at most", 1, threshold)
PROPORTION = Statistic("turn in proportion to what drives it, at most", 1, proportion)
AXIS = Statistic("pressure that acts as if larger (or smaller)", 0, axis, "%")
