"""Zig-zag joints: (4) and (5) of the paper with their inverses, what statics says instead, torque from
extension.

A segment of length d leans by theta (half the fold angle) from the cross direction; in extension every
segment turns by d_theta, so that it is d [sin(theta + d_theta) - sin(theta)] longer along the axis (4), n
of them together F / k_l.

(5) as printed: k_theta = F d / (2 d_theta). Statics: an axial force F that pulls through the middle of the
segments has at each fold the lever (d/2) cos(theta + d_theta), and a fold opens by 2 d_theta, being
between two segments:

    k_theta = F d cos(theta + d_theta) / (4 d_theta)

So (5) as printed is 2 / cos(theta + d_theta) times the stiffness of a joint; `printed=True` keeps it, for
the paper's own numbers. Both are inverted exactly: (5) in closed form, the other by Newton's method.
"""

from __future__ import annotations

import math

import numpy as np

from fem_spa.errors import InputError

WEIGHT = 0.050 * 9.80665
"""N; the paper hangs 50 g on the actuator."""


def opening(extension: np.ndarray | float, length: float, fold: float, segments: int) -> np.ndarray:
    """(4) solved: d_theta (...), rad, of an extension (...), m, of `segments` segments.

    Parameters
    ----------
    length : d, m;  fold : theta, rad

    Raises
    ------
    InputError : longer than the chain stretched straight, or shorter than folded flat
    """
    sine = np.asarray(extension, float) / (segments * length) + math.sin(fold)
    if np.any(sine > 1) or np.any(sine < 0):
        low, high = (1e3 * segments * length * (s - math.sin(fold)) for s in (0.0, 1.0))
        worst = float(np.max(extension) if np.any(sine > 1) else np.min(extension))
        raise InputError(
            f"given an extension of {1e3 * worst:.4g} mm: {segments} segments of {1e3 * length:.4g} mm allow "
            f"{low:.4g} to {high:.4g} mm; give other segments, length or fold"
        )
    return np.asarray(np.arcsin(sine) - fold)


def elongation(turn: np.ndarray | float, length: float, fold: float) -> np.ndarray:
    """(4): extension (...), m, of one segment that has turned by `turn` (...), rad."""
    return np.asarray(length * (np.sin(fold + np.asarray(turn)) - math.sin(fold)))


def joint_stiffness(
    force: float, length: float, fold: float, segments: int, linear: float, printed: bool = True
) -> float:
    """(5): N m/rad of a joint from the linear stiffness of the actuator.

    Parameters
    ----------
    force : N, > 0;  length : d, m;  fold : theta, rad;  linear : k_l, N/m;  printed : see the module

    Raises
    ------
    InputError : the force stretches the chain beyond straight
    """
    turn = float(opening(force / linear, length, fold, segments))
    if printed:
        return force * length / (2 * turn)
    return force * length * math.cos(fold + turn) / (4 * turn)


def linear_stiffness(
    force: float, length: float, fold: float, segments: int, joint: float, printed: bool = True
) -> float:
    """(5) the other way: k_l, N/m, that gives the joint stiffness `joint`, N m/rad; to the last digits.

    Raises
    ------
    InputError : the force turns the segments beyond straight
    """
    turn = force * length / (2 * joint)
    if not printed:
        turn *= 0.5 * math.cos(fold)
        for _ in range(50):  # 4 k turn = F d cos(fold + turn)
            wrong = 4 * joint * turn - force * length * math.cos(fold + turn)
            step = wrong / (4 * joint + force * length * math.sin(fold + turn))
            turn -= step
            if abs(step) < 1e-15:
                break
    if fold + turn > math.pi / 2:
        raise InputError(
            f"given {joint:g} N m/rad: {force:g} N would turn the segments beyond straight; give less force"
        )
    return force / (segments * float(elongation(turn, length, fold)))


def torque_of_extension(
    extension: np.ndarray, length: float, fold: float, segments: int, joint: float
) -> np.ndarray:
    """Torque (...) N m on every fold that holds an extension (...) m: k_theta 2 d_theta, no other load.

    The paper searches it by `fmincon`; for equal torques of alternating sign (2) it is this closed form.
    """
    return 2 * joint * opening(extension, length, fold, segments)
