"""Another code on the same mesh: the six-chamber fast module of shared/meshes."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np

from fem_spa.solid.observe import KeepStates
from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, Material, Problem
from fem_spa.solid.space import build_space
from materials.registry import law
from verification.equilibrium import material, rotation

EVIDENCE = {0.5e3: 1.996, 1.25e3: 4.724, 2.375e3: 8.394, 4.0625e3: 13.403, 20e3: 53.04}
"""Pa -> deg: another code's numbers on the same mesh, with the tip's corner nodes weighing the same."""


def evidence_mesh() -> Path:
    """Where fast_module_3mm.msh would be."""
    root = Path(__file__).resolve().parents[2]
    shared = os.environ.get("FEM_SPA_SHARED")
    return (Path(shared) if shared else root.parent / "shared") / "meshes" / "fast_module_3mm.msh"


def fast_module() -> list[tuple[float, float, float, float]]:
    """A row a pressure: Pa; in deg the other code's angle, ours by its measure, ours weighted with area."""
    from geometry.files import read_mesh

    mesh = read_mesh(evidence_mesh(), "mm")
    problem = Problem(
        mesh,
        {
            "body": material("yeoh"),
            "stiff": Material(law("neo-hooke"), {"C10": 2.2e6}),
        },
        Loads([{"main": p} for p in EVIDENCE]),
        symmetry={"symmetry": "y"},
    )
    space = build_space(mesh)
    keep = KeepStates()
    result = solve(problem, observers=[keep], space=space)
    if result.status != "done":
        raise RuntimeError(result.message)
    nodes = np.unique(space.surfaces["tip"][:, :3])
    plane = [2, 0]  # positive angles turn x towards -z, which is z towards x
    out = []
    points = [
        (s, r) for s, r in zip(keep.states, result.rows, strict=True) if r.is_point and r.pressure["main"] > 0
    ]
    for (pressure, other), (state, row) in zip(EVIDENCE.items(), points, strict=True):
        assert row.pressure["main"] == pressure
        rest = space.points[nodes][:, plane]
        turned = rotation(rest, rest + state.displacement[nodes][:, plane])
        out.append((pressure, other, math.degrees(turned), math.degrees(row.angle)))
    return out
