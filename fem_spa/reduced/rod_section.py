"""The arm's cross-section, (33)-(34), and what the kernels need of a rod, in SI."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fem_spa.errors import InputError
from fem_spa.reduced.rod_kernel import CLAMP
from fem_spa.reduced.rod_law import RodLaw


@dataclass(frozen=True)
class Section:
    """Cross-section of chambers, disks ignored as in the paper.

    Attributes
    ----------
    wall : area of one chamber's wall a, m^2;  bore : area of its inside A_i, m^2
    area : A = N a, m^2
    second : I_1, I_2, I_3 about d1, d2, d3, m^4
    place : (N, 2) centres of the chambers along d1, d2, m
    """

    wall: float
    bore: float
    area: float
    second: tuple[float, float, float]
    place: np.ndarray


def section(value: Mapping[str, float]) -> Section:
    """The section of parameter values in SI; InputError where the radii leave no wall."""
    outer, inner = value["outer_radius"], value["inner_radius"]
    if inner >= outer:
        raise InputError(
            f"given inner_radius {1e3 * inner:g} mm, outer_radius {1e3 * outer:g} mm: no wall is left; "
            "the inner radius must be the smaller one"
        )
    angle = np.array([value[f"chamber_angle_{i}"] for i in (1, 2, 3)])
    place = value["chamber_distance"] * np.column_stack([np.cos(angle), np.sin(angle)])
    wall = math.pi * (outer**2 - inner**2)
    own = math.pi / 4 * (outer**4 - inner**4)
    first = float(np.sum(own + wall * place[:, 1] ** 2))
    other = float(np.sum(own + wall * place[:, 0] ** 2))
    return Section(wall, math.pi * inner**2, len(angle) * wall, (first, other, first + other), place)


DAMPER_STEP = 2e-4
"""s; (31) after a kick makes a slow motion creep as under a rate (exp(lambda dt) - 1)/dt, not lambda: with
the dt of Table 1, 874 and not 806 1/s. lambda was fitted with it, so this rate is kept at other steps."""


@dataclass(frozen=True)
class Discrete:
    """A straight rod of n equal elements between n + 1 nodes.

    Attributes
    ----------
    n : elements;  length : of one at rest, m
    mass : (n + 1,) of the nodes, ends half, kg
    inertia : (3,) rotational, of an element about d1, d2, d3, kg m^2
    axial : (3,) GA, GA, EA, N;  bending : (3,) EI_1, EI_2, GI_3, N m^2
    slow : (3,) rotational damping rate at rest length, 1/s
    viscous : translational damping, 1/s, that (31) has with the paper's step, see `DAMPER_STEP`
    """

    n: int
    length: float
    mass: np.ndarray
    inertia: np.ndarray
    axial: np.ndarray
    bending: np.ndarray
    slow: np.ndarray
    viscous: float


def discrete(value: Mapping[str, float], law: RodLaw | None = None) -> Discrete:
    """The rod of parameter values in SI; a law from FE brings its own stiffness where it has one."""
    s = section(value)
    n = round(value["elements"])
    length = value["length"] / n
    mass = np.full(n + 1, value["mass"] / n)
    mass[[0, -1]] *= 0.5
    second = np.array(s.second)
    E = value["modulus"]
    G = E / (2 * (1 + value["poisson"]))
    axial = np.array([G, G, E]) * s.area
    bending = np.array([E, E, G]) * second
    if law is not None and law.axial_stiffness is not None:
        axial *= law.axial_stiffness / axial[2]
    if law is not None and law.bending_stiffness is not None:
        bending *= law.bending_stiffness / bending[0]
    inertia = value["density"] * second * length
    slow = value["rotational_damping"] * s.area / second  # (32): lambda_r rho A / J, J = rho I
    viscous = math.expm1(value["translational_damping"] * DAMPER_STEP) / DAMPER_STEP
    return Discrete(n, length, mass, inertia, axial, bending, slow, viscous)


def straight(rod: Discrete) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n + 1, 3) and directors (n, 9) at rest: from the origin down, {d1, d2, d3} = {-x, y, -z}."""
    r = np.zeros((rod.n + 1, 3))
    r[:, 2] = -rod.length * np.arange(rod.n + 1)
    return r, np.tile(CLAMP, (rod.n, 1))


def largest_step(rod: Discrete, value: Mapping[str, float]) -> float:
    """The explicit step at which the stiffest wave of the unstretched rod would grow, s."""
    spin = (4 * rod.bending[0] / rod.length + rod.axial[0] * rod.length) / rod.inertia[0]
    shift = 4 * rod.axial[2] / (rod.length * rod.mass[1])
    return float(2.0 / math.sqrt(max(spin, shift)))
