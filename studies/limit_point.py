"""A thick rubber ball through the limit point of its pressure, beside the closed form."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from fem_spa.run import run_deck

SUMMARY = "a rubber ball blown up by volume through its limit point, the closed form beside it"
DECK = Path(__file__).with_suffix(".toml")


def sphere_pressure(volume: float, inner: float, outer: float, C10: float) -> float:
    """Pressure (Pa) in an incompressible neo-Hookean thick sphere that encloses `volume` (m^3).

    P = integral of W'(l) / (l^3 - 1) from the outer to the inner hoop stretch, W = C10 (2 l^2 + l^-4 - 3),
    which gives P = 2 C10 [ 2/l + 1/(2 l^4) ] between the two (Ogden, Non-linear Elastic Deformations, 5.3.2).

    Parameters
    ----------
    volume : enclosed, m^3, at least that at rest
    inner, outer : rest radii, m
    C10 : Pa, half the shear modulus
    """
    inside = (3 * volume / (4 * math.pi)) ** (1 / 3) / inner
    outside = (1 + (inner / outer) ** 3 * (inside**3 - 1)) ** (1 / 3)

    def primitive(stretch: float) -> float:
        return 2 / stretch + 0.5 / stretch**4

    return 2 * C10 * (primitive(outside) - primitive(inside))


def run(out: Path) -> int:
    """Solve the deck beside this file into `out`; prints the curve, the closed form and the errors."""
    outcome = run_deck(DECK, out)
    rows = outcome.result.rows
    geometry = outcome.setup.problem.mesh.points
    radii = np.linalg.norm(geometry, axis=1)
    inner, outer = float(radii.min()), float(radii.max())
    C10 = outcome.setup.problem.materials["body"].parameters["C10"]
    print("volume / rest   pressure [kPa]   closed form [kPa]   error [%]")
    worst = 0.0
    for row in rows[1:]:
        exact = sphere_pressure(row.volume, inner, outer, C10)
        error = 100 * (row.pressure["main"] / exact - 1)
        worst = max(worst, abs(error))
        ratio = row.volume / rows[0].volume
        print(f"{ratio:13.2f} {1e-3 * row.pressure['main']:16.3f} {1e-3 * exact:19.3f} {error:11.3f}")
    peak = max(row.pressure["main"] for row in rows)
    print(f"largest error {worst:.3f} %; peak {1e-3 * peak:.2f} kPa, behind it the pressure falls")
    return outcome.exit_status
