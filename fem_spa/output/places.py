"""Where words stand in a plot, so that they cover no curve."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

Place = tuple[tuple[float, float], tuple[float, float], str, str]
"""Point, offset from it (points), horizontal and vertical alignment of the words."""


def clear(axes: Any, words: Any, places: Sequence[Place], curves: Sequence[tuple[Any, Any]]) -> None:
    """Move an annotation to the first of some places where it covers no curve, else where it covers least.

    Parameters
    ----------
    axes : its limits must be final;  words : the annotation
    places : in the order in which they are liked; points in the annotation's own coordinates
    curves : (x, y) each, in data coordinates
    """
    axes.get_xlim(), axes.get_ylim()  # brings the limits up to date
    drawn = np.vstack([_dense(axes.transData.transform(np.column_stack(curve))) for curve in curves])

    def covered(place: Place) -> int:
        put(words, place)
        box = words.get_window_extent().padded(3.0)
        inside = (drawn > (box.x0, box.y0)) & (drawn < (box.x1, box.y1))
        beyond = not axes.bbox.padded(3.0).count_contains(((box.x0, box.y0), (box.x1, box.y1))) == 2
        return int(np.all(inside, axis=1).sum()) + 10_000 * beyond

    put(words, min(places, key=covered))


def put(words: Any, place: Place) -> None:
    """Set an annotation's place."""
    words.xy, offset, horizontal, vertical = place
    words.set_position(offset)
    words.set_ha(horizontal)
    words.set_va(vertical)


def _dense(points: np.ndarray) -> np.ndarray:
    """(m, 2) points of a polyline, 40 a stretch; those that are not finite left out."""
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) < 2:
        return points
    part = np.linspace(0.0, 1.0, 40)[:, None, None]
    return (points[:-1] + part * (points[1:] - points[:-1])).reshape(-1, 2)
