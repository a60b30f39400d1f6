"""The modulus of the bellow's soft layer from its one printed figure: 22 mm under 2 N.

    python benchmarks/soft_layer.py

Solves a quarter of the layer, 30 x 30 x 1 mm, its rim held, a square as large as the bellow's top moved
along z, for a neo-Hookean rubber of shear modulus 20 kPa; forces go with the modulus.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import verification as v

from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, Material, Problem, StepControl
from materials.laws import LAWS

MM = 1e-3
MOVED, FORCE = 22 * MM, 2.0
SHEAR_MODULUS = 20e3
HALF_SIDE = 0.5 * np.sqrt(np.pi) * 5 * MM


def layer(fine: int) -> object:
    """A quarter of the layer, `fine` elements from the middle to the edge of what is moved."""
    line = np.concatenate(
        [np.linspace(0.0, HALF_SIDE, fine + 1), np.linspace(HALF_SIDE, 15 * MM, 2 * fine + 1)[1:]]
    )
    names = {"x0": "symmetry x", "y0": "symmetry y", "x1": "rim x", "y1": "rim y", "z1": "top"}
    mesh = v.box([line, line, np.array([0.0, MM])], names=names)
    surfaces = dict(mesh.surfaces)
    top = surfaces.pop("top")
    moved = np.all(mesh.points[top[:, :3]].mean(axis=1)[:, :2] < HALF_SIDE, axis=1)
    surfaces["tip"] = top[moved]
    return replace(mesh, surfaces=surfaces)


def force(fine: int) -> float:
    """N on the whole layer."""
    problem = Problem(
        layer(fine),
        {"body": Material(LAWS["neo-hooke"], {"C10": SHEAR_MODULUS / 2})},
        Loads([], tip_displacement=(0.0, 0.0, MOVED)),
        fixed=("rim x", "rim y"),
        symmetry={"symmetry x": "x", "symmetry y": "y"},
    )
    result = solve(problem, StepControl(imposed_steps=6))
    if result.status != "done":
        raise SystemExit(result.message)
    return float(result.rows[-1].force or 0.0)


if __name__ == "__main__":
    print("elements   force at 22 mm [N]   shear modulus for 2 N [kPa]   C10 [kPa]")
    for fine in (2, 3, 4):
        found = force(fine)
        modulus = SHEAR_MODULUS * FORCE / found
        print(f"{fine:8d} {found:20.3f} {modulus / 1e3:29.1f} {modulus / 2e3:11.2f}")
