"""Bouc-Wen: no area without the modulus, no dependence on rate or sampling, limits and energy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fem_spa.errors import InputError
from fem_spa.reduced.hysteresis import BoucWen, displacement

LAW = BoucWen(A=0.5, beta=4.0, alpha=1.0, n=1.0)


def cycles(periods: int = 3, samples: int = 2000, period: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    time = np.linspace(0, periods * period, periods * samples + 1)
    return time, np.sin(2 * np.pi * time / period)


def area(x: np.ndarray, y: np.ndarray) -> float:
    """Integral of x dy over a closed line: of F du, the work over a cycle."""
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


@pytest.mark.parametrize("n", [1.0, 2.0])
def test_it_solves_its_equations(n: float) -> None:
    """u + z = F/k and (6) with the modulus, by another integrator in the force, branch by branch."""
    law = BoucWen(0.5, 4.0, 1.0, n)
    time, force = cycles(1, 400)
    u, z = displacement(time, force, 1.0, 0.0, law)
    state, begin = np.zeros(2), 0.0
    for end, last in ((1.0, 100), (-1.0, 300), (0.0, 400)):
        sign = np.sign(end - begin)

        def rates(_f: float, s: np.ndarray, sign: float = float(sign)) -> list[float]:
            f = law.A - (law.beta * sign * np.sign(s[1]) + law.alpha) * abs(s[1]) ** n
            return [1 / (1 + f), f / (1 + f)]

        done = solve_ivp(rates, (begin, end), state, rtol=1e-9, atol=1e-12, max_step=0.002)
        state, begin = done.y[:, -1], end
        assert [u[last], z[last]] == pytest.approx(state, abs=2e-5)


def test_the_law_as_printed_has_no_area() -> None:
    """Without the modulus z is a function of u: a force cycle comes back on itself."""
    grid = np.linspace(0, 1, 4001)
    up = np.zeros(grid.size)
    for i in range(1, grid.size):  # dz/du = A - beta |z| z^(n-1) - alpha z^n, n = 1
        up[i] = up[i - 1] + (0.5 - 5.0 * up[i - 1]) * (grid[i] - grid[i - 1])
    down = np.zeros(grid.size)
    down[-1] = up[-1]
    for i in range(grid.size - 1, 0, -1):
        down[i - 1] = down[i] - (0.5 - 5.0 * down[i]) * (grid[i] - grid[i - 1])
    assert down == pytest.approx(up, abs=1e-3)
    time, force = cycles()
    u, _ = displacement(time, force, 1.0, 0.0, LAW)
    assert area(force[-2000:], u[-2000:]) > 0.05  # the law that is used has


def test_rate_and_sampling_do_not_matter_without_damping() -> None:
    time, force = cycles(2, 400)
    u, _ = displacement(time, force, 2.0, 0.0, LAW)
    assert displacement(100 * time, force, 2.0, 0.0, LAW)[0] == pytest.approx(u, abs=1e-15)
    coarse = displacement(time[::100], force[::100], 2.0, 0.0, LAW)[0]  # corners of the sine only
    assert coarse == pytest.approx(u[::100], abs=1e-3)
    with_rests = np.repeat(force, 2)
    assert displacement(np.arange(with_rests.size), with_rests, 2.0, 0.0, LAW)[0][1::2] == pytest.approx(u)


def test_energy_is_lost_in_every_closed_cycle() -> None:
    rng = np.random.default_rng(0)
    for _ in range(10):
        beta = rng.uniform(0.5, 20)
        law = BoucWen(rng.uniform(0.1, 2), beta, rng.uniform(-beta, beta), rng.choice([1.0, 1.5, 3.0]))
        time, force = cycles(6, 1000)
        u, _ = displacement(time, force, 1.0, 0.0, law)
        assert area(force[-1000:], u[-1000:]) > 1e-4


def test_limits() -> None:
    """z ends at its limit; u then follows with the bare stiffness; a small force meets (1 + A) k."""
    time = np.linspace(0, 1, 5001)
    u, z = displacement(time, 40 * time, 2.0, 0.0, LAW)
    assert z[-1] == pytest.approx(LAW.limit, rel=1e-6) and LAW.limit == pytest.approx(0.1)
    assert np.diff(u)[-1] / np.diff(40 * time)[-1] == pytest.approx(1 / 2.0, rel=1e-6)
    assert u[1] / (40 * time[1]) == pytest.approx(1 / (2.0 * 1.5), rel=0.02)
    none = BoucWen(0.0, 1.0, 0.0)
    assert displacement(time, time, 2.0, 0.0, none)[0] == pytest.approx(time / 2.0, abs=1e-15)


def test_damping_gives_an_overdamped_step() -> None:
    """c u' + k u = F without hysteresis has a closed form; with it the end is that of the slow response."""
    time = np.linspace(0, 2, 201)
    force = np.ones(201)
    none = BoucWen(0.0, 0.0, 0.0)
    u, _ = displacement(time, force, 2.0, 0.5, none)
    assert u == pytest.approx(0.5 * (1 - np.exp(-time / 0.25)), abs=1e-12)
    u, _ = displacement(10 * time, force, 2.0, 0.5, LAW)
    slow, _ = displacement(time, np.minimum(time, 1.0), 2.0, 0.0, LAW)
    assert u[-1] == pytest.approx(slow[-1], abs=1e-4)
    assert np.all(np.diff(u) >= -1e-12)


def test_the_damped_law_by_another_integrator() -> None:
    law = BoucWen(0.4, 6.0, 2.0, 1.5)
    time = np.linspace(0, 4, 801)
    force = 0.5 * (1 - np.cos(2 * np.pi * time))

    def rates(t: float, s: np.ndarray) -> list[float]:
        drive = (np.interp(t, time, force) - s[0] - s[1]) / 0.1
        f = law.A - (law.beta * np.sign(drive) * np.sign(s[1]) + law.alpha) * abs(s[1]) ** law.n
        return [drive, f * drive]

    done = solve_ivp(rates, (0, 4), [0, 0], t_eval=time, rtol=1e-8, atol=1e-10, max_step=0.005)
    u, z = displacement(time, force, 1.0, 0.1, law)
    assert u == pytest.approx(done.y[0], abs=1e-3)
    assert z == pytest.approx(done.y[1], abs=1e-3)


def test_rough_input_does_not_blow_up() -> None:
    """A staircase with steps far beyond the limit, sampled at its corners: naive Euler overflows on it."""
    rng = np.random.default_rng(0)
    force = np.repeat(rng.uniform(-50, 50, 60), 2)
    for damping in (0.0, 0.01):
        u, z = displacement(np.arange(120.0), force, 1.0, damping, BoucWen(1.0, 400.0, 100.0, 2.0))
        assert np.all(np.isfinite(u)) and np.max(np.abs(z)) < 1.02 * math.sqrt(1 / 300)


@pytest.mark.parametrize(
    "given", [(-0.1, 1, 0, 1), (0.1, -1, 0, 1), (0.1, 1, 2, 1), (0.1, 1, 0, 0.5), (math.nan, 1, 0, 1)]
)
def test_laws_that_make_energy_are_refused(given: tuple[float, ...]) -> None:
    with pytest.raises(InputError):
        BoucWen(*given)
