"""Linear solvers: factors in double and single precision, what is chosen, what is refused."""

from __future__ import annotations

import math
import sys
from dataclasses import replace

import numpy as np
import pytest

from fem_spa.errors import InputError
from fem_spa.solid import linear, resources
from fem_spa.solid.linear import make_solver
from fem_spa.solid.observe import KeepStates
from fem_spa.solid.path import SINGLE, solve
from fem_spa.solid.problem import Loads, StepControl
from fem_spa.solid.space import build_space
from fem_spa.solid.system import System

GIGABYTE = 1e9


@pytest.fixture
def matrix(finger_problem):
    """Pattern, numbers and a right-hand side of the finger at rest under pressure."""
    system = System(finger_problem(Loads([])), build_space(finger_problem(Loads([])).mesh))
    x, pressure = system.rest(), np.array([1e4, 2e4])
    residual = system.evaluate(x, pressure, 1.0).residual
    return system.pattern, system.tangent(x, pressure), residual


def solved(matrix, factors):
    pattern, data, b = matrix
    solver = make_solver(pattern, "pardiso", factors)
    solver.factorize(data)
    x, single = solver.solve(b), solver.single
    solver.free()
    return x, single


def test_factors_single_give_the_same_solution(matrix):
    """Catches an iteration that ends early."""
    pytest.importorskip("pypardiso")
    here, none = solved(matrix, "double")
    there, some = solved(matrix, "single")
    assert some and not none
    np.testing.assert_allclose(there, here, rtol=0, atol=1e-10 * np.abs(here).max())


def needs(matrix):
    """Bytes that the factors need in double and in single precision."""
    sizes = []
    for factors in ("double", "single"):
        probe = make_solver(matrix[0], "pardiso", factors)
        probe.factorize(matrix[1])
        sizes.append(probe._needed_bytes)
        probe.free()
    return sizes


@pytest.mark.parametrize("free, single", [(math.inf, False), (64 * GIGABYTE, False), (None, True)])
def test_auto_is_single_where_memory_is_short(matrix, monkeypatch, free, single):
    """Catches a unit mistaken in what the analysis foretells (KB)."""
    pytest.importorskip("pypardiso")
    sizes = needs(matrix)
    assert 1e5 < sizes[1] < sizes[0] < 0.1 * GIGABYTE  # of a body of some thousand unknowns
    between = 0.5 * (sizes[0] + sizes[1]) / 0.8
    monkeypatch.setattr(linear, "free_memory", lambda: free or between)
    assert solved(matrix, "auto")[1] == single


def test_too_little_memory(matrix, monkeypatch):
    """One line."""
    pytest.importorskip("pypardiso")
    monkeypatch.setattr(linear, "free_memory", lambda: 1e3)
    with pytest.raises(InputError, match=r"unknowns: their factors need .* single") as raised:
        solved(matrix, "auto")
    assert "\n" not in str(raised.value)


def test_single_is_refused_without_mkl(matrix, monkeypatch):
    monkeypatch.setattr(linear, "Pardiso", lambda *_: (_ for _ in ()).throw(ImportError()))
    with pytest.raises(InputError, match="only MKL's PARDISO"):
        make_solver(matrix[0], factors="single")
    assert make_solver(matrix[0]).name == "superlu"


@pytest.mark.parametrize("control", ["pressure", "volume", "contact"])
def test_the_same_curve(finger_problem, control):
    """Stiff layer, two cavities, volumes prescribed (bordered rows), contact (a pattern that grows)."""
    pytest.importorskip("pypardiso")
    points = [{"near": 2e4, "far": 1e4}]
    if control == "volume":
        rest = System(finger_problem(Loads([])), build_space(finger_problem(Loads([])).mesh))
        volume = rest.evaluate(rest.rest(), np.zeros(2), 0.0).volume * rest.multiplicity
        points = [dict(zip(rest.cavities, 1.03 * volume, strict=True))]
    loads = Loads(points, control="volume" if control == "volume" else "pressure")
    problem = replace(finger_problem(loads), contact=control == "contact")
    states = {}
    for factors in ("double", "single"):
        keep = KeepStates()
        result = solve(problem, StepControl(imposed_steps=2, factors=factors), [keep])
        assert result.status == "done"
        assert any(SINGLE in line for line in result.warnings) == (factors == "single")
        states[factors] = keep.states
    assert len(states["single"]) == len(states["double"])
    for a, b in zip(states["double"], states["single"], strict=True):
        size = np.abs(states["double"][-1].displacement).max()
        np.testing.assert_allclose(b.displacement, a.displacement, rtol=0, atol=1e-8 * size)


def test_another_pattern_has_the_same_precision(matrix, monkeypatch):
    """Room that comes later, while contact makes the pattern grow, does not change the run's digits."""
    pytest.importorskip("pypardiso")
    short = 0.99 * needs(matrix)[0] / 0.8
    monkeypatch.setattr(linear, "free_memory", lambda: short)
    solver = make_solver(matrix[0], "pardiso")
    solver.factorize(matrix[1])
    assert solver.single
    monkeypatch.setattr(linear, "free_memory", lambda: math.inf)
    solver = solver.on(matrix[0])
    solver.factorize(matrix[1])
    assert solver.single
    monkeypatch.setattr(linear, "free_memory", lambda: 1e3)
    solver = solver.on(matrix[0])
    with pytest.raises(InputError, match="even in single"):
        solver.factorize(matrix[1])


@pytest.mark.parametrize("contact", [False, True])
def test_a_walk_goes_on_with_the_factors_that_it_had(matrix, finger_problem, monkeypatch, contact):
    """Memory is short in the first run and not in the second: the same to the last bit."""
    pytest.importorskip("pypardiso")
    loads = Loads([{"near": 9e3, "far": 9e3}])
    problem = replace(finger_problem(loads), contact=contact)
    short, memories = 0.99 * needs(matrix)[0] / 0.8, []
    monkeypatch.setattr(linear, "free_memory", lambda: short)
    whole = solve(problem, StepControl(), keep=memories.append)
    monkeypatch.setattr(linear, "free_memory", lambda: math.inf)
    again = solve(problem, StepControl(), memory=memories[len(memories) // 2])
    other = solve(problem, StepControl())
    assert [any(SINGLE in w for w in run.warnings) for run in (whole, again, other)] == [True, True, False]
    shape = whole.states[0].displacement
    assert np.array_equal(again.states[0].displacement, shape)
    assert not np.array_equal(other.states[0].displacement, shape)
    # the other way round the run goes on all the same, and says so
    memories.clear()
    solve(problem, StepControl(), keep=memories.append)
    monkeypatch.setattr(linear, "free_memory", lambda: short)
    again = solve(problem, StepControl(), memory=memories[len(memories) // 2])
    assert any(SINGLE in line for line in again.warnings)
    shown = again.states[0].displacement
    np.testing.assert_allclose(shown, shape, rtol=0, atol=1e-7 * np.abs(shape).max())


def test_free_memory_is_the_least_that_the_system_allows(tmp_path):
    """Catches a control group passed over: a container is killed where the machine has room."""
    if sys.platform == "win32":
        pytest.skip("Windows tells it otherwise")
    proc, groups = tmp_path / "proc", tmp_path / "groups"
    proc.mkdir()
    groups.mkdir()
    assert resources.free_memory(proc, groups) == math.inf
    (proc / "meminfo").write_text("MemTotal:  9000 kB\nMemAvailable:    5000 kB\n")
    assert resources.free_memory(proc, groups) == 5000 * 1024
    (groups / "memory.max").write_text("max\n")
    (groups / "memory.current").write_text("3000000\n")
    (groups / "memory.stat").write_text("anon 1\ninactive_file 500000\n")
    assert resources.free_memory(proc, groups) == 5000 * 1024
    (groups / "memory.max").write_text("4000000\n")
    assert resources.free_memory(proc, groups) == 1_500_000
    old = groups / "memory"
    old.mkdir()
    (old / "memory.limit_in_bytes").write_text("1000\n")
    (old / "memory.usage_in_bytes").write_text("900\n")
    (old / "memory.stat").write_text("total_inactive_file 100\n")
    assert resources.free_memory(proc, groups) == 200
