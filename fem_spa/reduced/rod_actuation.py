"""Pressures to the rod's spontaneous strains, (14)-(27) of the arm paper, or by a law from FE.

Chamber i at (x_i, y_i) along d1, d2 pushes with F_i = p_i A_i. The strain of its own is eps_i = N A_i p_i /
(E A), (24), times its gain (27); the rod takes their mean as spontaneous stretch (25), and as spontaneous
curvature (26)

    kappa_1 = 1/I_1 sum eps_i a y_i,     kappa_2 = -1/I_2 sum eps_i a x_i.

The base frame is d1 = -x, d2 = y, d3 = -z (section III.F), so chamber 1 (90 deg) sits on +y, chamber 2 (210
deg) at (+x, -y), chamber 3 at (-x, -y), and the arm bends away from a chamber that is pressurised.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fem_spa.reduced.rod_law import RodLaw
from fem_spa.reduced.rod_section import section


def spontaneous(
    pressure: np.ndarray, value: Mapping[str, float], gains: bool, law: RodLaw | None
) -> np.ndarray:
    """Spontaneous strains (m, 3): axial strain sigma_3, curvatures kappa_1 and kappa_2 in 1/m.

    Parameters
    ----------
    pressure : (m, 3) Pa inside the chambers
    value : the rod's parameters in SI
    gains : whether the strain gains (27) act
    law : actuation of one chamber in place of (24)-(26), or None
    """
    coupling = value["cross_coupling"]
    if coupling:
        pressure = (1 - coupling) * pressure + coupling * pressure.sum(axis=1, keepdims=True)
    gamma = np.array([value[f"strain_gain_{i}"] for i in (1, 2, 3)]) if gains else np.ones(3)
    s = section(value)
    x, y = s.place.T
    if law is not None:
        curvature, stretch = law.at(pressure)
        bend = gamma * curvature / np.hypot(x, y)
        return np.column_stack([(gamma * stretch).sum(axis=1), bend @ y, -(bend @ x)])
    eps = gamma * (len(x) * s.bore / (value["modulus"] * s.area)) * pressure
    first, other, _ = s.second
    return np.column_stack([eps.mean(axis=1), eps @ y * (s.wall / first), -(eps @ x) * (s.wall / other)])
