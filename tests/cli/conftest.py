"""A hollow block of 162 tetrahedra as a user's mesh, whole or broken in one way, and a deck that uses it."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from geometry.files import write_mesh
from geometry.tagged import TaggedMesh

DECK = """
[geometry]
file = "block.msh"
unit = "mm"
[materials.body]
law = "neo-hooke"
C10 = "0.1 MPa"
[loads]
pressure = "2 kPa"
path = ["1 kPa"]
"""
LONG = DECK.replace('"2 kPa"', '"6 kPa"').replace('"1 kPa"', '"2 kPa"')
LONG += "contact = false\n[solver]\nimposed_steps = 4\n"


def hollow_block(edge: float = 0.01, cells: int = 3) -> TaggedMesh:
    """A cube of `edge` m, cells^3 small cubes of six tets, the middle one empty: `cavity main`."""
    n = cells + 1
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, edge, n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    tets = []
    for i, j, k in itertools.product(range(cells), repeat=3):
        if (i, j, k) == (cells // 2,) * 3:
            continue
        for order in itertools.permutations(range(3)):
            corner, path = np.array([i, j, k]), []
            path.append(corner.copy())
            for axis in order:
                corner[axis] += 1
                path.append(corner.copy())
            tet = [int((p[0] * n + p[1]) * n + p[2]) for p in path]
            a, b, c, d = grid[tet]
            tets.append(tet if np.dot(np.cross(b - a, c - a), d - a) > 0 else [tet[1], tet[0], *tet[2:]])
    array = np.array(tets)
    faces = array[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    shell = faces[first[count == 1]]
    x = grid[shell][:, :, 0]
    inside = np.all((grid[shell] > 1e-9) & (grid[shell] < edge - 1e-9), axis=(1, 2))
    base, tip = np.all(x < 1e-9, axis=1), np.all(x > edge - 1e-9, axis=1)
    surfaces = {
        "cavity main": shell[inside],
        "base": shell[base],
        "tip": shell[tip],
        "outer": shell[~inside & ~base & ~tip],
    }
    return TaggedMesh(grid, array, {"body": np.arange(len(array))}, surfaces, "hollow block")


@pytest.fixture
def block() -> TaggedMesh:
    return hollow_block()


@pytest.fixture
def deck(tmp_path: Path, block: TaggedMesh, monkeypatch: pytest.MonkeyPatch) -> Callable[..., str]:
    """Writes deck.toml and block.msh in a folder of its own, which becomes the current one."""
    folder = tmp_path / "work"
    folder.mkdir()
    monkeypatch.chdir(folder)

    def write(text: str = DECK, unit: str = "mm", **changes: object) -> str:
        write_mesh(replace(block, **changes), folder / "block.msh", unit)  # type: ignore[arg-type]
        (folder / "deck.toml").write_text(text)
        return "deck.toml"

    return write


@pytest.fixture
def long_deck(deck: Callable[..., str]) -> Callable[..., str]:
    """The same with four steps to each of two load points, for what happens on the way."""
    return partial(deck, LONG)
