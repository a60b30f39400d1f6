"""The rod's equilibrium against closed forms, its order in 1/n, its behaviour far from rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from fem_spa.errors import InputError
from fem_spa.reduced.rod import arm
from fem_spa.reduced.rod_static import equilibria

LENGTH, EI = 0.5, 0.02
RIGID = np.full(3, 1e9)


def slender(n: int, weight: np.ndarray, tip_force: np.ndarray, hinge: bool = True) -> np.ndarray:
    """Tip (3,) of a rod that neither shears nor stretches, clamped along -z; weight (3,) N in all."""
    nodes = np.full(n + 1, 1.0 / n)
    nodes[[0, -1]] *= 0.5
    Q, r = np.empty((n, 9)), np.empty((n + 1, 3))
    loads = nodes[:, None] * weight
    bending = np.array([EI, EI, 2 * EI / 3])
    return equilibria(np.zeros((1, 3)), Q, r, loads, tip_force, hinge, LENGTH / n, RIGID, bending)[0]


def elastica(force: float) -> tuple[float, float]:
    """Tip along and across the clamp's axis (m) of a cantilever under a dead force across it (N).

    Bisshopp and Drucker, Quart. Appl. Math. 3 (1945): L sqrt(P/EI) = K(k) - F(phi, k), 2 k^2 = 1 + sin(tip
    angle).
    """
    scale = np.sqrt(force / EI)

    def left(m: float) -> float:
        return float(ellipk(m) - ellipkinc(np.arcsin(np.sqrt(0.5 / m)), m) - LENGTH * scale)

    m = brentq(left, 0.5 + 1e-12, 1 - 1e-12, xtol=1e-15)
    phi = np.arcsin(np.sqrt(0.5 / m))
    across = LENGTH - 2 / scale * (ellipe(m) - ellipeinc(phi, m))
    return float(np.sqrt(2 * (2 * m - 1)) / scale), float(across)


@pytest.mark.parametrize("load", [0.5, 3.0, 10.0])
def test_elastica(load: float) -> None:
    """P L^2 / EI of up to 10, where the tip has turned by 80 degrees: within 0.1 % at 80 elements."""
    force = load * EI / LENGTH**2
    along, across = elastica(force)
    tip = slender(80, np.zeros(3), np.array([0, force, 0.0]))
    assert tip[1] == pytest.approx(across, rel=1e-3)
    assert -tip[2] == pytest.approx(along, rel=1e-3)
    assert abs(tip[0]) < 1e-12


def test_heavy_cantilever() -> None:
    """w L^4 / (8 EI) of a level beam under its weight, small enough to be linear: within 0.1 %."""
    weight = 0.02 * EI / LENGTH**2
    tip = slender(80, np.array([weight, 0, 0.0]), np.zeros(3))
    assert tip[0] == pytest.approx(weight * LENGTH**3 / (8 * EI), rel=1e-3)


def test_heavy_column_softens_towards_its_buckling_load() -> None:
    """w L^3 / EI = 7.837 (Greenhill 1881): load over sway falls straight to zero (Southwell)."""
    nudge = np.array([1e-5 * EI / LENGTH**2, 0, 0])
    loads = np.array([6.5, 7.2])
    stiffness = [nudge[0] / slender(80, np.array([0, 0, w * EI / LENGTH**2]), nudge)[0] for w in loads]
    critical = loads[1] + stiffness[1] * (loads[1] - loads[0]) / (stiffness[0] - stiffness[1])
    assert critical == pytest.approx(7.837, rel=5e-3)


def test_orders_of_the_two_clamps() -> None:
    """PyElastica's clamp is of first order in 1/n, the frame's of second, and both go to one limit."""
    p = np.array([[2e5, 1e5, 0.0]])
    tips = {
        clamp: np.array(
            [replace(arm(), clamp=clamp).with_values(elements=n).settled(p)[0] for n in (20, 40, 80)]
        )
        for clamp in ("element", "base")
    }
    steps = {clamp: np.linalg.norm(np.diff(tip, axis=0), axis=1) for clamp, tip in tips.items()}
    assert steps["element"][0] / steps["element"][1] == pytest.approx(2, rel=0.05)
    assert steps["base"][0] / steps["base"][1] == pytest.approx(4, rel=0.05)
    limit = 2 * tips["element"][2] - tips["element"][1]
    assert np.linalg.norm(limit - tips["base"][2]) < 0.05e-3


def test_pure_curvature_is_an_arc() -> None:
    """One chamber, no gravity: constant curvature and stretch, so the chord of the arc of e L."""
    model = replace(arm(), clamp="base").with_values(elements=200).switched(gravity=False)
    p = np.array([[2e5, 0.0, 0.0]])
    sigma, kappa, other = model.strains(p)[0]
    assert other == pytest.approx(0, abs=1e-12)
    angle, radius = 0.19 * kappa, (1 + sigma) / kappa
    tip = model.settled(p)[0]
    assert tip[1] == pytest.approx(-radius * (1 - np.cos(angle)), rel=1e-4)
    assert tip[2] == pytest.approx(-radius * np.sin(angle), rel=1e-4)


def test_a_record_gives_what_single_states_give() -> None:
    """Warm starts along a record must not lead elsewhere."""
    rng = np.random.default_rng(3)
    p = rng.uniform(0, 3.5e5, (25, 3))
    model = arm()
    whole = model.settled(p, orientation=2.0, payload=0.02)
    single = np.vstack([model.settled(row, orientation=2.0, payload=0.02) for row in p])
    assert whole == pytest.approx(single, abs=1e-9)


def test_no_equilibrium_is_one_line() -> None:
    """A pull at which the thinning rod gives way without bound: force over E A above one."""
    with pytest.raises(InputError, match="no equilibrium"):
        arm().rest(np.zeros((1, 3)), tip_force=(0.0, 0.0, -400.0))
