"""Prony series and Mullins softening: known ones come back, with the right intervals."""

from __future__ import annotations

import numpy as np
import pytest

from materials.errors import MaterialError
from materials.laws import LAWS
from materials.mullins import fit_mullins, softening
from materials.prony import Prony, branch, fit_creep, fit_prony, from_creep
from materials.response import invariants, nominal_stress, principal_stretches
from materials.specimen import Specimen

TIME = np.concatenate([[0.0], np.geomspace(0.05, 2000, 250)])
G, TAU = np.array([0.2, 0.12]), np.array([2.0, 150.0])


def fading(time: np.ndarray) -> np.ndarray:
    return 1 - np.sum(G * (1 - np.exp(-time[:, None] / TAU)), axis=1)


def test_relaxation_comes_back() -> None:
    series = fit_prony(TIME, 3e4 * fading(TIME))
    assert series.g == pytest.approx(G, rel=1e-6)
    assert series.tau == pytest.approx(TAU, rel=1e-6)
    assert np.allclose(series.relaxation(TIME), fading(TIME))


def test_relaxation_with_noise_is_within_its_intervals() -> None:
    hits, draws = np.zeros(4), 100
    for draw in range(draws):
        rng = np.random.default_rng(draw)
        series = fit_prony(TIME, 3e4 * fading(TIME) * (1 + 2e-3 * rng.standard_normal(TIME.size)))
        assert series.g.size == 2
        hits[:2] += (series.g_low <= G) & (series.g_high >= G)
        hits[2:] += (series.tau_low <= TAU) & (series.tau_high >= TAU)
    assert np.all(hits / draws >= 0.88)


def test_a_ramp_is_accounted_for() -> None:
    """Stretch put on over 5 s and held: with the law's stress as input the series is that of a step."""
    time = np.concatenate([np.linspace(0, 5, 60), 5 + np.geomspace(0.05, 1000, 200)])
    l = 1 + 0.5 * np.minimum(time / 5, 1)
    e = nominal_stress(LAWS["neo-hooke"], {"C10": 1e5}, "uniaxial", l)
    stress = e * (1 - G.sum()) + sum(g * branch(e, time, t) for g, t in zip(G, TAU, strict=True))
    with_ramp = fit_prony(time, stress, e)
    assert with_ramp.g == pytest.approx(G, rel=1e-5)
    assert with_ramp.tau == pytest.approx(TAU, rel=1e-5)
    as_step = fit_prony(time[60:], stress[60:])
    assert abs(as_step.g[0] - G[0]) > 0.02  # what ignoring the ramp would cost


def test_branch_solves_its_equation() -> None:
    """tau dh/dt + h = tau de/dt for e = t: h = tau (1 - exp(-t/tau))."""
    time = np.linspace(0, 10, 37)
    assert np.allclose(branch(time, time, 3.0), 3.0 * (1 - np.exp(-time / 3.0)))


def test_creep_and_relaxation_are_each_others_inverse() -> None:
    j, l = np.array([0.2, 0.15]), np.array([2.0, 150.0])
    g, tau = from_creep(Prony(j, l, j, j, l, l, 1.0, 0.0))
    s = np.geomspace(1e-4, 1e2, 30)[:, None]
    product = (1 + np.sum(j / (1 + s * l), axis=1)) * (1 - np.sum(g / (1 + s * tau), axis=1))
    assert np.allclose(product, 1.0, atol=1e-12)
    strain = 0.1 * (1 + np.sum(j * (1 - np.exp(-TIME[:, None] / l)), axis=1))
    got = fit_creep(TIME, strain)
    got_g, got_tau = got.g, got.tau
    assert got_g == pytest.approx(g, rel=1e-4)
    assert got_tau == pytest.approx(tau, rel=1e-4)


@pytest.mark.parametrize(
    "stress, words", [(np.ones(TIME.size), "does not relax"), (np.zeros(TIME.size), "zero all along")]
)
def test_what_cannot_be_a_relaxation_is_refused(stress: np.ndarray, words: str) -> None:
    with pytest.raises(MaterialError, match=words):
        fit_prony(TIME, stress)
    with pytest.raises(MaterialError, match="at least 12"):
        fit_prony(TIME[:5], stress[:5])


def cyclic(r: float, m: float, beta: float, noise: float = 0.0) -> Specimen:
    legs = [
        np.linspace(1, 1.5, 40),
        np.linspace(1.5, 1.0, 40),
        np.linspace(1, 2.2, 60),
        np.linspace(2.2, 1, 60),
    ]
    l = np.concatenate(legs)
    law, p = LAWS["yeoh"], {"C10": 1e5, "C20": 1e4, "C30": 0.0}
    W = law.energy(*invariants(principal_stretches("uniaxial", l)), **p)
    eta = softening(W, np.maximum.accumulate(W), r, m, beta)
    stress = nominal_stress(law, p, "uniaxial", l) * eta + noise * np.random.default_rng(1).standard_normal(
        l.size
    )
    return Specimen("cyclic", "uniaxial", "cyclic", l, stress, np.arange(l.size, dtype=float))


def test_mullins_comes_back() -> None:
    p = {"C10": 1e5, "C20": 1e4, "C30": 0.0}
    got = fit_mullins(cyclic(1.8, 3e4, 0.2), LAWS["yeoh"], p)
    assert (got.r, got.m, got.beta) == pytest.approx((1.8, 3e4, 0.2), rel=1e-5)
    assert got.rmse < 1e-3 * got.rmse_without
    noisy = fit_mullins(cyclic(1.8, 3e4, 0.2, noise=1e3), LAWS["yeoh"], p)
    for value, low, high in zip((1.8, 3e4, 0.2), noisy.low, noisy.high, strict=True):
        assert low < value < high


def test_softening_is_one_on_the_virgin_path() -> None:
    W = np.linspace(0, 1e5, 20)
    assert np.allclose(softening(W, W, 1.5, 1e4, 0.1), 1.0)
    assert np.all(softening(W[:-1], np.full(19, 1e5), 1.5, 1e4, 0.1) < 1.0)


def test_mullins_needs_unloading() -> None:
    l = np.linspace(1, 2, 30)
    p = {"C10": 1e5, "C20": 0.0, "C30": 0.0}
    s = Specimen("pull", "uniaxial", "pull", l, nominal_stress(LAWS["yeoh"], p, "uniaxial", l))
    with pytest.raises(MaterialError, match="never unloads"):
        fit_mullins(s, LAWS["yeoh"], p)


def test_creep_intervals_hold_the_truth():
    # catches intervals of the wrong sign, of the creep series instead of the relaxation's, or far too narrow
    rng = np.random.default_rng(5)
    time = np.geomspace(0.1, 300.0, 80) - 0.1
    creep = Prony(np.array([0.2]), np.array([5.0]), *[np.zeros(1)] * 4, 1.0, 0.0)
    true_g, true_tau = from_creep(creep)
    clean = 0.1 * (1.0 + 0.2 * (1.0 - np.exp(-time / 5.0)))
    inside, wide = 0, []
    for _ in range(20):
        got = fit_creep(time, clean + 1e-4 * rng.standard_normal(time.size))
        assert got.g.size == 1
        inside += got.g_low[0] < true_g[0] < got.g_high[0]
        inside += got.tau_low[0] < true_tau[0] < got.tau_high[0]
        wide.append((got.g_high[0] - got.g_low[0]) / true_g[0])
    # 40 trials at 95 %: fewer than 33 happens once in some thousand times
    assert inside >= 33
    assert 1e-3 < np.median(wide) < 0.2
