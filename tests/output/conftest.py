"""A solved run without a solver: the hollow block of tests/cli, its space, and made-up rows."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fem_spa.solid.problem import Loads, Material, Problem, Result, Row, State
from fem_spa.solid.space import build_space
from geometry.tagged import TaggedMesh
from materials.laws import LAWS


def hollow_block() -> TaggedMesh:
    """The mesh that tests/cli uses as a user's file."""
    spec = importlib.util.spec_from_file_location(
        "cli_conftest", Path(__file__).parents[1] / "cli" / "conftest.py"
    )
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.hollow_block()


@pytest.fixture(scope="session")
def block() -> TaggedMesh:
    return hollow_block()


@pytest.fixture(scope="session")
def space(block: TaggedMesh) -> Any:
    return build_space(block)


@pytest.fixture
def make_problem(block: TaggedMesh) -> Callable[..., Problem]:
    """A problem on the block; `cavities` renames and repeats its cavity."""

    def make(cavities: tuple[str, ...] = ("main",), control: str = "pressure", **more: Any) -> Problem:
        faces = block.surfaces["cavity main"]
        rest = {name: found for name, found in block.surfaces.items() if not name.startswith("cavity")}
        surfaces = {**rest, **{f"cavity {name}": faces for name in cavities}}
        mesh = TaggedMesh(block.points, block.tets, block.volumes, surfaces, "hollow block")
        end = {name: 1e4 * (i + 1) for i, name in enumerate(cavities)}
        material = Material(LAWS["neo-hooke"], {"C10": 1e5})
        loads = more.pop("loads", Loads([end], control))
        return Problem(mesh, {"body": material}, loads, **more)

    return make


@pytest.fixture
def make_rows() -> Callable[..., list[Row]]:
    """Rows to 10 kPa (the second cavity to 20 kPa), 40 deg."""

    def make(
        count: int = 5, cavities: tuple[str, ...] = ("main",), force: bool = False, angle: float = 40.0
    ) -> list[Row]:
        rows = []
        for i in range(count):
            part = i / max(1, count - 1)
            rows.append(
                Row(
                    step=i,
                    pressure={name: 1e4 * (k + 1) * part for k, name in enumerate(cavities)},
                    angle=np.radians(angle) * part,
                    tip=np.array([0.04, 0.0, -0.01 * part]),
                    volume=4.75e-6 * (1 + part),
                    max_stretch=1.0 + part,
                    force=2.0 * part if force else None,
                    iterations=4,
                    is_point=i == count - 1,
                )
            )
        return rows

    return make


@pytest.fixture
def make_state(space: Any) -> Callable[[Row], State]:
    """The block stretched along x by a tenth times the step."""

    def make(row: Row) -> State:
        displacement = 0.1 * row.step * space.points * np.array([1.0, 0.0, 0.0])
        return State(row.step, displacement, np.zeros(space.n_vertices), row.pressure, {})

    return make


@pytest.fixture
def make_result() -> Callable[..., Result]:
    def make(rows: list[Row], status: str = "done", message: str = "", **more: Any) -> Result:
        return Result(status, message, rows, [], 1000, 156, 20, 10, {"assembly": 1.0, "linear": 2.0}, **more)

    return make
