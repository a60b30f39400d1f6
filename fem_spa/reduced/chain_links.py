"""A plane chain of rigid links: where its joints are, which moments its weights have, its inertia.

Points of the plane are complex numbers: x along the rest axis, y across. Joint j turns body j and all
behind it against body j - 1; turns q_j add up along the chain, psi_j = q_0 + ... + q_j.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, eq=False)
class Links:
    """Joints and bodies at rest, m of each.

    Attributes
    ----------
    start : first joint, m, complex
    vector : (m,) from joint j to joint j + 1, of the last body to the tip, at rest, m
    centre : (m,) from joint j to the centre of mass of body j, at rest, m
    mass, inertia : (m,) kg, and kg m^2 about the centre of mass
    stiffness, damping : (m,) N m/rad and N m s/rad of each joint
    part : (m,) of a fold that a joint is: 1, or 1/2 at the ends
    stiffening : (m,) or one for all, s >= 0, 1/rad^2: a spring's moment is k q (1 + s q^2)
    """

    start: complex
    vector: np.ndarray
    centre: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    part: np.ndarray
    stiffening: np.ndarray | float = 0.0

    @property
    def rest(self) -> complex:
        """Tip at rest."""
        return self.start + complex(self.vector.sum())


def places(links: Links, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Joints with the tip (..., m + 1) and centres of mass (..., m), m, at turns q (..., m) rad."""
    turn = np.exp(1j * np.cumsum(q, axis=-1))
    steps = np.cumsum(links.vector * turn, axis=-1)
    joints = links.start + np.concatenate([np.zeros((*steps.shape[:-1], 1)), steps], axis=-1)
    return joints, joints[..., :-1] + links.centre * turn


def chord_angle(links: Links, q: np.ndarray) -> np.ndarray:
    """Angle (...) rad of the line from base to tip against its rest direction, also beyond half a turn.

    Of the angles that differ by whole turns the one nearest to half the tip's turn, as on an arc.
    """
    joints, _ = places(links, q)
    angle = np.angle(joints[..., -1] / links.rest)
    half = 0.5 * np.sum(q, axis=-1)
    return np.asarray(angle + 2 * np.pi * np.round((half - angle) / (2 * np.pi)))


def loaded(links: Links, payload: float) -> Links:
    """The chain with a point mass (kg) at its tip."""
    if payload == 0.0:
        return links
    mass, inertia, centre = links.mass.copy(), links.inertia.copy(), links.centre.copy()
    whole = mass[-1] + payload
    apart = abs(links.vector[-1] - centre[-1])
    inertia[-1] += mass[-1] * payload / whole * apart**2
    centre[-1] = (mass[-1] * centre[-1] + payload * links.vector[-1]) / whole
    mass[-1] = whole
    return replace(links, centre=centre, mass=mass, inertia=inertia)


def weight_moments(links: Links, q: np.ndarray, gravity: complex) -> tuple[np.ndarray, np.ndarray]:
    """Moments of all weights about each joint (..., m), N m, and minus their derivative as W (..., m).

    With a_ij = c_i - r_j from joint j to centre i >= j: moment_j = sum_i m_i (a_ij x g), W_j = sum_i m_i
    a_ij . g, and d moment_j / d q_l = - W_max(j, l).
    """
    joints, centres = places(links, q)

    def behind(x: np.ndarray) -> np.ndarray:
        return np.cumsum(x[..., ::-1], axis=-1)[..., ::-1]

    first = behind(links.mass * centres) - behind(np.broadcast_to(links.mass, q.shape)) * joints[..., :-1]
    product = np.conj(first) * gravity
    return np.imag(product), np.real(product)


def energy(links: Links, q: np.ndarray, gravity: complex) -> np.ndarray:
    """Potential energy (...) of springs and weights, J; zero at rest."""
    _, centres = places(links, q)
    _, at_rest = places(links, np.zeros_like(q))
    lifted = np.real(np.conj(centres - at_rest) * gravity)
    springs = 0.5 * links.stiffness * q**2 * (1.0 + 0.5 * links.stiffening * q**2)
    return np.asarray(np.sum(springs, axis=-1) - np.sum(links.mass * lifted, axis=-1))


def inertia_matrix(links: Links, q: np.ndarray) -> np.ndarray:
    """M (m, m) of (1) at turns q (m,): sum over bodies behind both joints of m_i a_ij . a_il + I_i."""
    joints, centres = places(links, q)
    behind = np.triu(np.ones((q.size, q.size)))  # body i (column) is turned by joint j (row)
    arm = (centres[None, :] - joints[:-1, None]) * behind
    return np.asarray(np.real((arm * links.mass) @ np.conj(arm).T) + (behind * links.inertia) @ behind.T)
