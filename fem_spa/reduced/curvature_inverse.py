"""From a point back to the modules' angles and the pressures; an unreachable point gets the nearest one.

A finger has two unknowns, beta and alpha, and the tip two coordinates in the plane of bending. The search
starts from every local minimum of the distance on a grid over all postures, so that no solution between its
ends is left out, and ends with Newton's or, where the point is out of reach or at an end of a range, with
least squares within the bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from fem_spa.errors import InputError
from fem_spa.reduced.curvature import jacobian, pose
from fem_spa.reduced.finger import LIMITS, Finger
from fem_spa.units import show

TOLERANCE = 1e-6
"""m: nearer than this, a point counts as reached."""
_GRID = 61


@dataclass(frozen=True)
class Reach:
    """What a search came to.

    Attributes
    ----------
    reached : whether the point is reached
    angles : (2,) rad, beta and alpha
    pressures : (chambers,) Pa
    point : (3,) m, where the finger gets: the point, or the nearest one to it
    distance : m, between the two
    others : further solutions (angles), at larger pressures, where there are
    """

    reached: bool
    angles: np.ndarray
    pressures: np.ndarray
    point: np.ndarray
    distance: float
    others: tuple[np.ndarray, ...] = ()

    @property
    def message(self) -> str:
        """One sentence."""
        at = ", ".join(f"{1e3 * x:.2f}" for x in self.point + 0.0)
        pressures = ", ".join(f"{max(p, 0.0) / 1e3:.2f} kPa" for p in self.pressures)
        if self.reached:
            return f"reached at ({at}) mm with {pressures}"
        away = show(float(f"{self.distance:.3g}"), "m")
        return f"out of reach: the nearest the finger gets is ({at}) mm, {away} away, with {pressures}"


def inverse(
    finger: Finger,
    point: np.ndarray,
    place: float | None = None,
    limits: tuple[float, ...] | None = None,
    offset: float = 0.0,
) -> Reach:
    """Angles and pressures that bring a place of the finger to a point.

    Parameters
    ----------
    point : (3,) or (2,) m in the base's frame (x along the finger, y to the bending side)
    place : in chambers from the root, 7 the end of the seventh, 6.5 its middle; None is the tip
    limits : Pa, the largest pressure of each network; None is the paper's, 80 (slow) and 40 kPa (fast)
    offset : m, of the place from the paper along the local y: t2 is the outer face on the bending side

    Returns
    -------
    Reach; of several solutions the one with the smallest sum of pressures

    Raises
    ------
    InputError : a point that is none, a place outside the finger, limits that are not positive
    """
    goal = np.zeros(3)
    given = np.asarray(point, float)
    if given.shape not in ((2,), (3,)) or not np.all(np.isfinite(given)):
        raise InputError(f"given point {point}: two or three finite coordinates in m are needed")
    goal[: given.size] = given
    n = finger.slow_chambers + finger.fast_chambers
    place = float(n) if place is None else float(place)
    if not 0.0 < place <= n:
        raise InputError(f"given place {place:g}: the finger has {n} chambers; give one above 0 up to {n}")
    largest = _largest(finger, limits)
    # a module beyond the place does not matter: it stays straight
    counts = (finger.slow_chambers, finger.fast_chambers)
    free = [bool(counts[0]), bool(counts[1]) and place > counts[0]]
    chosen = np.flatnonzero(free)

    def whole(q: np.ndarray) -> np.ndarray:
        angles = np.zeros((*q.shape[:-1], 2))
        angles[..., chosen] = q
        return angles

    def reach(q: np.ndarray) -> np.ndarray:
        turns, lengths = finger.chain(np.atleast_2d(whole(q)))
        poses = pose(turns, lengths, place)
        return np.asarray(poses[:, :3, 3] + offset * poses[:, :3, 1])

    def slope(q: np.ndarray) -> np.ndarray:
        turns, lengths = finger.chain(whole(q))
        at = pose(turns, lengths, place)[0, :3, 1]
        J = jacobian(turns, lengths, place=place)[0]
        J = J[:3] + offset * np.cross(J[3:], at, axis=0)
        modules = [J[:, : counts[0]].sum(axis=1), J[:, counts[0] :].sum(axis=1)]
        return np.column_stack([modules[j] / counts[j] for j in chosen])

    solutions = []
    for start in _starts(reach, goal, largest[chosen]):
        fit = least_squares(
            lambda q: 1e3 * (reach(q)[0] - goal),
            start,
            lambda q: 1e3 * slope(q),
            bounds=(np.zeros(len(chosen)), largest[chosen]),
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
            x_scale=largest[chosen],
            max_nfev=200,
        )
        q = _newton(reach, slope, goal, fit.x, largest[chosen])
        solutions.append((float(np.linalg.norm(reach(q)[0] - goal)), q))
    return _best(finger, solutions, whole, reach)


def _largest(finger: Finger, limits: tuple[float, ...] | None) -> np.ndarray:
    """(2,) rad: the angles of the modules at the largest pressures; zero for one that is not there."""
    if limits is None:
        limits = tuple(LIMITS[("slow", "fast").index(name)] for name in finger.networks)
    if len(limits) != finger.chambers or not all(0.0 < p < 1e8 for p in limits):
        raise InputError(
            f"given limits {limits}: {finger.chambers} positive pressures in Pa are needed, "
            f"those of {', '.join(finger.networks)}"
        )
    return finger.module_angles(np.array([limits]))[0]


def _starts(reach, goal: np.ndarray, largest: np.ndarray) -> list[np.ndarray]:
    """Postures on a grid that are nearer to the goal than all their neighbours, the nearest eight."""
    axes = [np.linspace(0.0, top, _GRID) for top in largest]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    distance = np.linalg.norm(reach(grid.reshape(-1, len(axes))) - goal, axis=1).reshape(grid.shape[:-1])
    padded = np.pad(distance, 1, constant_values=np.inf)
    least = np.ones(distance.shape, bool)
    for shift in np.ndindex(*(3,) * len(axes)):
        part = tuple(slice(s, s + _GRID) for s in shift)
        least &= distance <= padded[part]
    found = grid[least]
    order = np.argsort(distance[least], kind="stable")[:8]
    return [np.clip(q, 1e-9 * largest, (1 - 1e-9) * largest) for q in found[order]]


def _newton(reach, slope, goal: np.ndarray, q: np.ndarray, largest: np.ndarray) -> np.ndarray:
    """The last digits, which least squares leaves open; the old place where it does not help."""
    for _ in range(4):
        step = np.linalg.lstsq(slope(q), goal - reach(q)[0], rcond=1e-12)[0]
        new = np.clip(q + step, 0.0, largest)
        if np.linalg.norm(reach(new)[0] - goal) >= np.linalg.norm(reach(q)[0] - goal):
            break
        q = new
    return q


def _best(finger: Finger, solutions, whole, reach) -> Reach:
    """The solution with the smallest pressures among those that reach the point, else the nearest posture."""
    reached = [(d, q) for d, q in solutions if d <= TOLERANCE]
    if not reached:
        distance, q = min(solutions, key=lambda pair: pair[0])
        angles = whole(q)
        return Reach(False, angles, finger.pressures(angles)[0], reach(q)[0], distance)
    different: list[tuple[float, np.ndarray]] = []
    for distance, q in reached:
        if all(np.max(np.abs(q - other)) > 1e-5 for _, other in different):
            different.append((distance, q))
    different.sort(key=lambda pair: float(finger.pressures(whole(pair[1])).sum()))
    distance, q = different[0]
    angles = whole(q)
    others = tuple(whole(other) for _, other in different[1:])
    return Reach(True, angles, finger.pressures(angles)[0], reach(q)[0], distance, others)
