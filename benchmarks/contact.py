"""What contact costs and how little its own numbers matter: the fast module to 40 kPa, 20 points.

    python benchmarks/contact.py            the curve with and without contact, one after the other
    python benchmarks/contact.py --halved   likewise to 6.6 kPa with distance and steps halved

Needs ../shared/meshes (FEM_SPA_SHARED names the folder that holds meshes/). Prints rows of
docs/verification.md.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

import numpy as np
from verification import evidence_mesh, material

from fem_spa.solid.path import solve
from fem_spa.solid.problem import Loads, Material, Problem, Result, StepControl
from fem_spa.solid.space import Space, build_space
from geometry.files import read_mesh
from geometry.tagged import TaggedMesh
from materials.registry import law


def run(
    mesh: TaggedMesh, space: Space, points: Sequence[float], contact: bool, steps: StepControl
) -> tuple[Result, float, np.ndarray]:
    """The result, its wall time (s) and the angles (deg) at the points (Pa)."""
    stiff = Material(law("neo-hooke"), {"C10": 2.2e6})
    problem = Problem(
        mesh,
        {"body": material("yeoh"), "stiff": stiff},
        Loads([{"main": p} for p in points]),
        symmetry={"symmetry": "y"},
        contact=contact,
    )
    begun = time.perf_counter()
    result = solve(problem, steps, space=space)
    wall = time.perf_counter() - begun
    angles = np.degrees([row.angle for row in result.rows if row.is_point][1:])
    return result, wall, angles


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--halved", action="store_true")
    halved = parser.parse_args().halved
    mesh = read_mesh(evidence_mesh(), "mm")
    space = build_space(mesh)
    usual = StepControl()
    run(mesh, space, [200.0], True, usual)  # compiles
    half = StepControl(contact_distance=0.5 * usual.contact_distance)
    if halved:
        points = [4e3, 6.6e3]
        cases = [("as it is", True, usual), ("half the distance", True, half)]
        cases += [(f"{n} equal steps a stretch", True, StepControl(imposed_steps=n)) for n in (20, 40)]
    else:
        points = [2e3 * (k + 1) for k in range(20)]
        cases = [("without contact", False, usual), ("with contact", True, usual)]
    print("| | status | steps | Newton iterations | factorizations | s | of it contact | angles, deg |")
    print("|---|---|---|---|---|---|---|---|")
    for name, contact, steps in cases:
        result, wall, angles = run(mesh, space, points, contact, steps)
        shown = angles if halved else angles[[1, 4, 9, 14, -1]] if len(angles) == 20 else angles[-1:]
        cells = [name, result.status, len(result.rows) - 1, result.newton_iterations, result.factorizations]
        cells += [f"{wall:.1f}", f"{result.seconds['contact']:.1f}", ", ".join(f"{a:.2f}" for a in shown)]
        print("| " + " | ".join(str(c) for c in cells) + " |", flush=True)


if __name__ == "__main__":
    main()
