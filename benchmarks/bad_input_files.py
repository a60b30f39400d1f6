"""The good inputs that bad_input.py changes: decks, a card, models, tables, a mesh."""

from __future__ import annotations

import tempfile
from itertools import pairwise
from pathlib import Path

import numpy as np

DECK = """[geometry]
file = "block.msh"
unit = "mm"
[materials.body]
law = "neo-hooke"
C10 = "0.1 MPa"
density = "1080 kg/m^3"
[supports]
fixed = ["base"]
[loads]
pressure = "2 kPa"
path = ["1 kPa"]
gravity = [0, 0, -9.81]
contact = true
obstacles = [ { plane = { point = [0, 0, "-9 mm"], normal = [0, 0, 1] } } ]
[observe]
angle = "tip-face"
blocked = false
[solver]
tolerance = 1e-8
max_iterations = 15
imposed_steps = 2
"""
SHAPES = {
    name: f'[geometry]\nshape = "{name}"\nsize = "{size}"\n{more}'
    for name, size, more in (
        ("tube", "6 mm", "share = 4\n"),
        ("ball", "6 mm", ""),
        ("pneunet", "9 mm", 'slow_chambers = 1\nfast_chambers = 0\nslow_pitch = "18 mm"\n'),
        ("bellow", "8 mm", ""),
    )
}
CARD = """name = "mine"
law = "neo-hooke"
density = "1080 kg/m^3"
bulk = "inf"
source = "a test"
[parameters]
C10 = { value = 0.1, unit = "MPa", low = 0.09, high = 0.11 }
"""
MODEL = '[model]\nkind = "curve"\nfile = "line.csv"\n'
VISCOUS = """[model]
kind = "kelvin-voigt"
k1 = "82.85 kPa/mm"
k2 = "31.5 kPa/mm"
eta1 = "600 kPa*s/mm"
eta2 = "20 kPa*s/mm"
"""
LINE = "pressure [kPa],angle [deg]\n0,0\n20,15\n50,40\n"


def record() -> str:
    """A record of 20 s."""
    t = 0.1 * np.arange(200)
    p = 25.0 * (1.0 - np.cos(2.0 * np.pi * t / 5.0))
    y = 0.8 * p + 0.05 * np.sin(37.0 * t)
    rows = [f"{a:.1f},{b:.5g},{c:.5g}" for a, b, c in zip(t, p, y, strict=True)]
    return "\n".join(["# orientation: 0 deg", "time [s],pressure [kPa],angle [deg]", *rows]) + "\n"


def test_file() -> str:
    """A uniaxial test of a neo-Hookean rubber."""
    stretch = np.linspace(1.0, 2.5, 25)
    stress = 0.2 * (stretch - stretch**-2)
    rows = [f"{a:.4f},{b:.5f}" for a, b in zip(stretch, stress, strict=True)]
    return "\n".join(["# mode: uniaxial", "stretch,nominal stress [MPa]", *rows]) + "\n"


def block() -> bytes:
    """A hollow block of 156 tets as a .msh file, as the tests have it."""
    from geometry.files import write_mesh
    from geometry.tagged import TaggedMesh

    n = 4
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, 0.01, n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    corner = np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1], [0, 0, 1], [0, 1, 1], [0, 1, 0]]
    )
    loop = (1, 2, 7, 6, 5, 4, 1)  # around the diagonal 0-3
    tets = []
    for i in range(27):
        at = np.array([i // 9, i // 3 % 3, i % 3])
        if tuple(at) == (1, 1, 1):
            continue
        number = [(int(a) * n + int(b)) * n + int(c) for a, b, c in at + corner]
        for a, b in pairwise(loop):
            tet = [number[0], number[3], number[a], number[b]]
            x = grid[tet]
            if np.linalg.det(x[1:] - x[0]) < 0:
                tet[2:] = tet[:1:-1]
            tets.append(tet)
    array = np.array(tets)
    faces = array[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    shell = faces[first[count == 1]]
    x = grid[shell]
    inside = np.all((x > 1e-9) & (x < 0.01 - 1e-9), axis=(1, 2))
    base, tip = np.all(x[:, :, 0] < 1e-9, axis=1), np.all(x[:, :, 0] > 0.01 - 1e-9, axis=1)
    groups = {"cavity main": inside, "base": base, "tip": tip, "outer": ~inside & ~base & ~tip}
    mesh = TaggedMesh(
        grid, array, {"body": np.arange(len(array))}, {k: shell[v] for k, v in groups.items()}, "block"
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "block.msh"
        write_mesh(mesh, path, "mm")
        return path.read_bytes()
