"""The page: every case, printed."""

from __future__ import annotations

import datetime
import importlib.metadata
import math
import os
import platform
import sys
import time

from fem_spa.solid.linear import make_solver
from fem_spa.solid.problem import Loads, Problem
from fem_spa.solid.space import build_space
from fem_spa.solid.system import System
from verification.blocks import box, even
from verification.closed_forms import closed_forms
from verification.equilibrium import material
from verification.evidence import evidence_mesh, fast_module
from verification.manufactured import MODULUS, SIDE, rates


def line(*cells: object) -> str:
    return "| " + " | ".join(str(c) for c in cells) + " |"


def main() -> None:
    started = time.perf_counter()
    versions = ", ".join(
        f"{p} {importlib.metadata.version(p)}" for p in ("numpy", "scipy", "scikit-fem", "numba")
    )
    print("# Verification of the solver\n")
    print("What `python benchmarks/verification` prints; tests/solid holds the same")
    print("cases to the bounds given here.\n")
    print(
        f"{datetime.date.today()}, {platform.system()} {platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, {versions}, linear solver {backend()}.\n"
    )
    print("## Closed forms\n")
    print("Errors are relative. Incompressible; Taylor-Hood tets (P2 displacement, P1 pressure).\n")
    print(line("case", "error of", "tets", "error", "bound"))
    print(line("---", "---", "---:", "---:", "---:"))
    for check in closed_forms():
        print(line(check.case, check.measure, check.elements, f"{check.error:.1e}", f"{check.bound:g}"))
        sys.stdout.flush()
    print("\nThe tube lies between two parallel planes of symmetry; the bar is held to the")
    print("one-dimensional solution, exact for a slender bar. Block and tube: curved where the shape is.\n")
    print("## Manufactured solutions\n")
    print(
        "Two successive smooth shears (det F = 1) and a smooth pressure, Yeoh's law; with finite bulk modulus"
    )
    print("(20 mu) a dilation after them and p = K (J - 1). Relative L2 errors; orders 3 and 2 are ideal.\n")
    for title, bulk, curved, cells in (
        ("Incompressible, straight tets, one side under traction", math.inf, False, (3, 6, 9, 12)),
        ("Incompressible, curved tets, one side under traction", math.inf, True, (3, 6, 9, 12)),
        (
            "Bulk modulus 20 mu, straight tets, displacement given on all sides",
            20 * MODULUS,
            False,
            (3, 6, 9, 12),
        ),
    ):
        print(f"{title}:\n")
        print(line("cells a side", "error of u", "order", "error of p", "order"))
        print(line("---:", "---:", "---:", "---:", "---:"))
        for n, u, ru, p, rp in rates(cells, bulk, curved):
            order = ("", "") if math.isnan(ru) else (f"{ru:.2f}", f"{rp:.2f}")
            print(line(n, f"{u:.2e}", order[0], f"{p:.2e}", order[1]))
        print()
        sys.stdout.flush()
    print("## Another code on the same mesh\n")
    if evidence_mesh().exists():
        print("Six-chamber fast module, half, h = 3 mm, straight tets, no contact; body Yeoh 0.11/0.02 MPa,")
        print("lowest millimetre neo-Hooke 2.2 MPa. Angle of the tip in degrees: the other code's; ours with")
        print(
            "the tip's corner nodes weighing the same, as there; the product's `angle`: each by its area.\n"
        )
        print(line("kPa", "other code", "ours", "difference", "`angle`"))
        print(line("---:", "---:", "---:", "---:", "---:"))
        for pressure, other, same, own in fast_module():
            print(
                line(
                    f"{pressure / 1e3:g}",
                    f"{other:g}",
                    f"{same:.3f}",
                    f"{100 * (same / other - 1):+.3f} %",
                    f"{own:.3f}",
                )
            )
    else:
        print(f"Left out: {evidence_mesh().name} is not here (FEM_SPA_SHARED names its folder's parent).")
    print(f"\nAll of this took {time.perf_counter() - started:.0f} s.")


def backend() -> str:
    """Name of the linear solver in use."""
    mesh = box([even(0, SIDE, 1)] * 3)
    system = System(Problem(mesh, {"body": material("yeoh")}, Loads([]), fixed=("x0",)), build_space(mesh))
    return make_solver(system.pattern).name
