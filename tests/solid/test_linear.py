"""Linear solvers: factors in memory and on disk, what is chosen, what is refused, what stays behind."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
from dataclasses import replace

import numpy as np
import pytest

from fem_spa.errors import InputError
from fem_spa.solid import linear, resources
from fem_spa.solid.linear import make_solver
from fem_spa.solid.observe import KeepStates
from fem_spa.solid.path import ON_DISK, solve
from fem_spa.solid.problem import Loads, StepControl
from fem_spa.solid.space import build_space
from fem_spa.solid.system import System

GIGABYTE = 1e9


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """The folder for temporary files, empty."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


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
    x, on_disk = solver.solve(b), solver.on_disk
    solver.free()
    return x, on_disk


def test_factors_on_disk_give_the_same_solution(matrix, temporary):
    """Catches a mode of PARDISO that pivots otherwise, and files that stay behind."""
    pytest.importorskip("pypardiso")
    here, none = solved(matrix, "memory")
    there, some = solved(matrix, "disk")
    assert none == 0 and some > 0
    np.testing.assert_allclose(there, here, rtol=0, atol=1e-10 * np.abs(here).max())
    assert not any(temporary.iterdir())


@pytest.mark.parametrize("free, on_disk", [(math.inf, False), (64 * GIGABYTE, False), (1e5, True)])
def test_auto_goes_to_disk_where_memory_is_short(matrix, temporary, monkeypatch, free, on_disk):
    """Catches a unit mistaken in what the analysis foretells (KB)."""
    pytest.importorskip("pypardiso")
    pattern, data, _ = matrix
    probe = make_solver(pattern, "pardiso", "memory")
    probe.factorize(data)
    assert 1e5 < probe._needed_bytes < 0.1 * GIGABYTE  # of a body of some thousand unknowns
    asked: list[float] = []  # first short of memory, then not: PARDISO itself needs some

    def told() -> float:
        asked.append(free)
        return free if len(asked) == 1 else math.inf

    monkeypatch.setattr(linear, "free_memory", told)
    assert bool(solved(matrix, "auto")[1]) == on_disk
    probe.free()


def test_memory_that_ends_during_the_factorization(matrix, temporary, monkeypatch):
    """Catches a traceback where the foretold size was too small."""
    pytest.importorskip("pypardiso")
    call = linear.Pardiso._call

    def short(self, phase, b=None, x=None):
        if phase == 22:
            raise MemoryError
        call(self, phase, b, x)

    monkeypatch.setattr(linear.Pardiso, "_call", short)
    with pytest.raises(InputError, match="their factors need"):
        solved(matrix, "disk")


@pytest.mark.parametrize("what", ["memory", "disk"])
def test_neither_memory_nor_disk(matrix, temporary, monkeypatch, what):
    """One line that names both, and nothing left behind."""
    pytest.importorskip("pypardiso")
    monkeypatch.setattr(linear, "free_memory", lambda: 1e3)
    if what == "disk":
        monkeypatch.setattr(linear, "free_memory", lambda: GIGABYTE)
        monkeypatch.setattr(linear, "free_disk", lambda: 1e3)
    with pytest.raises(InputError, match=r"unknowns: their factors need .* TMPDIR") as raised:
        solved(matrix, "auto" if what == "memory" else "disk")
    assert "\n" not in str(raised.value)
    del raised
    assert not any(temporary.iterdir())


def test_disk_is_refused_without_mkl(matrix, monkeypatch):
    monkeypatch.setattr(linear, "Pardiso", lambda *_: (_ for _ in ()).throw(ImportError()))
    with pytest.raises(InputError, match="only MKL's PARDISO"):
        make_solver(matrix[0], factors="disk")
    assert make_solver(matrix[0]).name == "superlu"


@pytest.mark.parametrize("control", ["pressure", "volume", "contact"])
def test_the_same_curve(finger_problem, temporary, control):
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
    for factors in ("memory", "disk"):
        keep = KeepStates()
        result = solve(problem, StepControl(imposed_steps=2, factors=factors), [keep])
        assert result.status == "done"
        assert any(ON_DISK in line for line in result.warnings) == (factors == "disk")
        states[factors] = keep.states
    assert len(states["disk"]) == len(states["memory"])
    for a, b in zip(states["memory"], states["disk"], strict=True):
        size = np.abs(states["memory"][-1].displacement).max()
        np.testing.assert_allclose(b.displacement, a.displacement, rtol=0, atol=1e-8 * size)
    assert not any(temporary.iterdir())


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


def test_what_a_killed_process_left_is_removed(temporary):
    """And what a living one uses is not."""
    if sys.platform == "win32":
        pytest.skip("not done there")
    code = (
        "import os, sys, tempfile; tempfile.tempdir = sys.argv[1]\n"
        "from fem_spa.solid.resources import Scratch; s = Scratch(); print(s.path); os._exit(1)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(temporary)], capture_output=True, text=True, check=False
    )
    left = done.stdout.strip()
    assert os.path.isdir(left), done.stderr
    first = resources.Scratch()
    assert not os.path.isdir(left)
    second = resources.Scratch()
    assert first.path.is_dir() and second.path.is_dir()
    first.remove()
    second.remove()
    assert not any(temporary.iterdir())
