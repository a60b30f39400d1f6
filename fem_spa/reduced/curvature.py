r"""Kinematics of a finger as a chain of circular arcs, one a chamber: (21)-(28) of Yu et al. (2022).

Frames: the base's at the root, x along the finger at rest, y towards the side it bends to, z the axis of
bending; each joint's x is the tangent there. A chamber that turns by theta over the arc length L on the
paper takes one frame to the next by (26),

    T = R_x(-alpha) R_z(theta/2) T_x(chord) R_z(theta/2) R_x(alpha),     chord = L sin(theta/2) / (theta/2),

alpha the direction of bending about x, zero for this finger (27). It is exact for arcs of constant
curvature. Slips of the print: (25) lacks a cosine in its second row; (28) has the arc lengths l1, l3 as
chords (0.1 % of the tip's way at 100 deg, where (23) has it right) and leaves out the gaps l2.

Everything takes arrays of shapes (..., n) for n chambers, so that many postures are one call.
"""

from __future__ import annotations

import numpy as np


def arc(turn: np.ndarray, length: np.ndarray, direction: np.ndarray | float = 0.0) -> np.ndarray:
    """(..., 4, 4): T of (26) for turns (rad), arc lengths (m) and directions alpha (rad)."""
    t, L, a = np.broadcast_arrays(*(np.asarray(v, float) for v in (turn, length, direction)))
    chord = L * np.sinc(t / (2.0 * np.pi))
    # the two half turns about z with the shift between, written out, then conjugated with R_x(alpha)
    c, s, h = np.cos(t), np.sin(t), 0.5 * t
    ca, sa = np.cos(a), np.sin(a)
    T = np.zeros((*t.shape, 4, 4))
    T[..., 0, 0], T[..., 0, 1], T[..., 0, 2] = c, -s * ca, s * sa
    T[..., 1, 0], T[..., 1, 1], T[..., 1, 2] = s * ca, c * ca**2 + sa**2, (1.0 - c) * sa * ca
    T[..., 2, 0], T[..., 2, 1], T[..., 2, 2] = -s * sa, (1.0 - c) * sa * ca, c * sa**2 + ca**2
    T[..., 0, 3] = chord * np.cos(h)
    T[..., 1, 3], T[..., 2, 3] = chord * np.sin(h) * ca, -chord * np.sin(h) * sa
    T[..., 3, 3] = 1.0
    return T


def joints(turns: np.ndarray, lengths: np.ndarray, directions: np.ndarray | float = 0.0) -> np.ndarray:
    """(..., n + 1, 4, 4): pose of the root and of every joint in the base's frame; the last is the tip.

    turns, directions : (..., n) rad;  lengths : (..., n) m
    """
    steps = arc(turns, lengths, directions)
    poses = [np.broadcast_to(np.eye(4), (*steps.shape[:-3], 4, 4))]
    for k in range(steps.shape[-3]):
        poses.append(poses[-1] @ steps[..., k, :, :])
    return np.stack(poses, axis=-3)


def tip(turns: np.ndarray, lengths: np.ndarray, directions: np.ndarray | float = 0.0) -> np.ndarray:
    """(..., 3) m: where the chain ends."""
    return joints(turns, lengths, directions)[..., -1, :3, 3]


def pose(
    turns: np.ndarray, lengths: np.ndarray, place: float, directions: np.ndarray | float = 0.0
) -> np.ndarray:
    """(..., 4, 4): pose at `place` in chambers from the root: 7 the end of the seventh, 6.5 its middle.

    Raises
    ------
    ValueError : place outside 0 to n
    """
    turns, lengths = np.asarray(turns, float), np.asarray(lengths, float)
    n = turns.shape[-1]
    if not 0.0 <= place <= n:
        raise ValueError(f"place {place} of a chain of {n} chambers")
    share = np.clip(place - np.arange(n), 0.0, 1.0)
    return np.asarray(joints(turns * share, lengths * share, directions)[..., -1, :, :])


def along(
    turns: np.ndarray, lengths: np.ndarray, parts: int, directions: np.ndarray | float = 0.0
) -> np.ndarray:
    """(..., parts n + 1, 4, 4): poses along the chain, each chamber cut in `parts` of equal length."""
    t, a = np.broadcast_arrays(np.asarray(turns, float), np.asarray(directions, float))
    cut = [np.repeat(v, parts, axis=-1) for v in (t / parts, np.asarray(lengths, float) / parts, a)]
    return joints(*cut)


def jacobian(
    turns: np.ndarray, lengths: np.ndarray, directions: np.ndarray | float = 0.0, place: float | None = None
) -> np.ndarray:
    """(..., 6, n): derivative by each chamber's turn of a point's place (m a rad) and rotation (rad a rad).

    The upper three rows are the velocity of the point, the lower three the axis about which it turns, both in
    the base's frame.

    Parameters
    ----------
    place : the point, in chambers from the root as in `pose`; None is the tip
    """
    turns, lengths = np.asarray(turns, float), np.asarray(lengths, float)
    n = turns.shape[-1]
    share = np.ones(n) if place is None else np.clip(place - np.arange(n), 0.0, 1.0)
    t, L = turns * share, lengths * share
    a = np.broadcast_to(np.asarray(directions, float), t.shape)
    poses = joints(t, L, a)
    end = poses[..., -1, :3, 3]
    ca, sa = np.cos(a), np.sin(a)
    axis_here = np.stack([np.zeros_like(a), sa, ca], axis=-1)  # R_x(-alpha) z
    # the arc's end L (sin t / t, (1 - cos t) / t): its derivative by t
    dx, dy = _arc_slope(t)
    own = np.stack([L * dx, L * dy * ca, -L * dy * sa], axis=-1)
    rotation = poses[..., :-1, :3, :3]
    axis = np.einsum("...kij,...kj->...ki", rotation, axis_here)
    carried = np.cross(axis, end[..., None, :] - poses[..., 1:, :3, 3])
    velocity = np.einsum("...kij,...kj->...ki", rotation, own) + carried
    columns = np.concatenate([velocity, axis], axis=-1) * share[:, None]
    return np.swapaxes(columns, -1, -2)


def _arc_slope(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of sin t / t and (1 - cos t) / t."""
    small = np.abs(t) < 1e-2
    safe = np.where(small, 1.0, t)
    dx = np.where(small, -t / 3.0 * (1.0 - t**2 / 10.0), (np.cos(safe) - np.sin(safe) / safe) / safe)
    whole = (np.sin(safe) - (1.0 - np.cos(safe)) / safe) / safe
    dy = np.where(small, 0.5 - t**2 / 8.0 * (1.0 - t**2 / 18.0), whole)
    return dx, dy
