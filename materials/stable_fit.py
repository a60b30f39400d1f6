"""A fit under the constraint of stability: Drucker's margin >= 0 on a grid of stretches."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.optimize import minimize

from materials.errors import MaterialError
from materials.fitting import Data, Fit, finish, predict, predict_by_parameter
from materials.laws import Array
from materials.response import MODES, principal_stretches
from materials.stability import margin, scan
from materials.variables import variables_of

LEAST_MARGIN = 1e-3
"""In units of the shear modulus: stays a hair inside, so that the scan agrees."""


def fit_stable(unstable: Fit, data: Data, asked: Mapping[str, tuple[float, float]], points: int = 24) -> Fit:
    """The best fit of the same variant that is stable over `asked`, by SLSQP.

    Raises MaterialError where none is found (the law cannot be stable so far out).
    """
    variant, law = unstable.variant, unstable.variant.law
    variables = variables_of(law, variant.free, data.modulus, data.reach)
    grid = np.concatenate(
        [principal_stretches(m, np.geomspace(*asked[m], points)) for m in MODES],
        axis=1,
    )

    def cost(v: Array) -> float:
        r = data.weight * (predict(law, variant.full(variables.values(v)), data.stretches) - data.stress)
        return float(np.sum(r**2)) if np.all(np.isfinite(r)) else 1e12

    def slope(v: Array) -> Array:
        values = variables.values(v)
        r = data.weight * (predict(law, variant.full(values), data.stretches) - data.stress)
        J = predict_by_parameter(variant, variant.full(values), data.stretches) * data.weight[:, None]
        return 2.0 * (r @ np.where(np.isfinite(J), J, 0.0)) @ variables.jacobian(v)

    def inside(v: Array) -> Array:
        with np.errstate(all="ignore"):
            m = margin(law, variant.full(variables.values(v)), grid)
        return np.where(np.isfinite(m), np.clip(m, -1e3, 1e3), -1e3) - LEAST_MARGIN

    scale = max(unstable.cost, 1e-12)
    tries = [variables.variables(unstable.values)]
    if law.starts is not None:
        row = law.starts(data.modulus, max(data.reach, 1e-3))[0]
        tries.append(variables.variables(np.array([row[name] for name in variant.free])))
    best: tuple[float, Array] | None = None
    for v in tries:
        out = minimize(
            lambda x: cost(x) / scale,
            variables.clip(v),
            jac=lambda x: slope(x) / scale,
            method="SLSQP",
            bounds=[
                (a if np.isfinite(a) else None, b if np.isfinite(b) else None)
                for a, b in zip(variables.low, variables.high, strict=True)
            ],
            constraints=[{"type": "ineq", "fun": inside}],
            options={"maxiter": 300, "ftol": 1e-12},
        )
        values = variables.values(out.x)
        if np.all(np.isfinite(out.x)) and scan(law, variant.full(values), asked)[0]:
            found = cost(out.x)
            if best is None or found < best[0]:
                best = found, values
    if best is None:
        raise MaterialError(
            f"{variant.name}: no stable fit over the range asked; ask for a smaller one or another law"
        )
    return finish(variant, data, best[1], variables)
