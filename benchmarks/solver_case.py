"""The case that solver_speed.py times: mesh, law, load points, and what is read off. Knows no solver.

mm, MPa and N inside, since the peers have no units; fem_spa's own worker converts.
"""

from __future__ import annotations

import json
import resource
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

C10 = {"body": 0.11, "stiff": 2.2}
C20 = {"body": 0.02, "stiff": 0.0}
"""MPa: Yeoh of the card dragon-skin-30; neo-Hooke of the stiff base layer."""

CURVE = [float(p) for p in range(1, 21)]
"""kPa: the timed curve."""
EVIDENCE = [0.5, 1.25, 2.375, 3.2, 4.0625]
"""kPa: where other codes' angles are known (3.2 is a stepping stone)."""
KNOWN = {0.5: 1.996, 1.25: 4.724, 2.375: 8.394, 4.0625: 13.403}
"""kPa -> deg: the trial's angles on the evidence mesh, by the measure of `tip_angle`."""
TOLERANCE = 1e-8
"""|residual| / |internal forces|, and |volume residual| / |volumes of the corner nodes|."""
FLOOR = 4e-4
"""N: internal forces below this are rounding errors (as in fem_spa)."""


@dataclass(frozen=True)
class Case:
    """Straight tets and named surfaces.

    points : (n, 3) mm;  tets : (k, 4);  region : (k,) index into names;  surfaces : name -> (f, 3) corner
    nodes, oriented out of the body
    """

    points: np.ndarray
    tets: np.ndarray
    region: np.ndarray
    names: tuple[str, ...]
    surfaces: dict[str, np.ndarray]

    def save(self, path: Path) -> None:
        """As .npz."""
        surfaces = {f"surface:{name}": faces for name, faces in self.surfaces.items()}
        np.savez(
            path, points=self.points, tets=self.tets, region=self.region, names=list(self.names), **surfaces
        )

    @classmethod
    def load(cls, path: str | Path) -> Case:
        """What `save` wrote."""
        with np.load(path) as data:
            surfaces = {key.partition(":")[2]: data[key] for key in data.files if key.startswith("surface:")}
            names = tuple(str(name) for name in data["names"])
            return cls(data["points"], data["tets"], data["region"], names, surfaces)

    def edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Middle nodes of second-order tets: (m, 2) corner nodes, (k, 6) number of each tet's edges.

        Edges of a tet in the order 01, 12, 02, 03, 13, 23.
        """
        pairs = np.sort(self.tets[:, [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]], axis=2)
        found, number = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
        return found, number.reshape(-1, 6)


def tip_angle(rest: np.ndarray, moved: np.ndarray) -> float:
    """deg: best-fitting rotation in x-z of the tip's corner nodes (n, 3), all of one weight."""
    a = rest - rest.mean(axis=0)
    b = moved - moved.mean(axis=0)
    sine = float(np.sum(a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]))
    cosine = float(np.sum(a[:, 0] * b[:, 0] + a[:, 2] * b[:, 2]))
    return float(np.degrees(np.arctan2(sine, cosine)))


def extrapolate(known: Sequence[tuple[float, np.ndarray]], at: float, order: int) -> np.ndarray:
    """The polynomial of at most `order` through the last states (load, unknowns), at another load."""
    last = known[-(order + 1) :]
    guess = np.zeros_like(last[0][1])
    for i, (ti, x) in enumerate(last):
        weight = 1.0
        for j, (tj, _) in enumerate(last):
            if j != i:
                weight *= (at - tj) / (ti - tj)
        guess += weight * x
    return guess


def walk(
    points: Sequence[float],
    rest: np.ndarray,
    order: int,
    equilibrium: Callable[[float, np.ndarray], tuple[np.ndarray | None, int]],
    reached: Callable[[], None],
) -> list[int]:
    """Through all points (kPa), a step halved where it fails; Newton iterations of each point.

    Parameters
    ----------
    rest : the unknowns at no load
    order : of the predictor
    equilibrium : (load, guess) -> unknowns, None where Newton's method failed, and iterations
    reached : called at each point
    """
    known = [(0.0, rest.copy())]
    spent = []
    for point in points:
        iterations, target, use = 0, point, order
        while known[-1][0] < point:
            x, used = equilibrium(target, extrapolate(known, target, use))
            iterations += used
            if x is None:
                use, target = max(1, use - 1), 0.5 * (known[-1][0] + target)
                if target - known[-1][0] < 1e-3:
                    raise ArithmeticError(f"no equilibrium beyond {known[-1][0]} kPa")
                continue
            known = [*known[-5:], (target, x.copy())]
            use, target = order, point
        spent.append(iterations)
        reached()
    return spent


def peak_mb() -> float:
    """Largest resident memory of this process so far, MB."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 1e6 if sys.platform == "darwin" else peak / 1024


def report(path: str | Path, result: dict[str, Any]) -> None:
    """Leave a worker's result for the caller."""
    Path(path).write_text(json.dumps(result), encoding="utf-8")
