"""A user's own law, from a Python file: two formulas, checked before use.

The file defines

    name = "my-law"
    parameters = {"C10": "Pa", "k": "1"}              # in order, unit "Pa" or "1"
    example = {"C10": 1e5, "k": 0.5}                  # a believable set, for the checks
    def energy(I1, I2, *, C10, k): ...                # W, Pa, of the isochoric invariants
    def derivatives(I1, I2, *, C10, k): ...           # W1, W2  or  W1, W2, W11, W12, W22

and, if wanted, `optional`, `limits` and `by_parameter` as in materials.laws.Law. Formulas use
numpy. Where only W1, W2 are given, they must be analytic (no abs, no where on the argument): the
second derivatives are then taken by complex step. A law of I1 and I2 is objective by construction.
"""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from materials.errors import MaterialError
from materials.laws import LAWS, Array, Law

_NEEDED = ("name", "parameters", "example", "energy", "derivatives")
TOLERANCE = 1e-5


def load_law(path: str | Path) -> Law:
    """The law in the file `path`, checked.

    Raises
    ------
    MaterialError : the file cannot be read or run, something is missing, or a check fails; says which
    """
    path = Path(path)
    where = f'law file "{path.name}"'
    if not path.is_file():
        raise MaterialError(f'law file "{path}" is not there; give a path to a .py file with the law')
    module = _run(path, where)
    missing = [name for name in _NEEDED if not hasattr(module, name)]
    if missing:
        raise MaterialError(f"{where}: {', '.join(missing)} is missing; needed are {', '.join(_NEEDED)}")
    name, parameters, example = module.name, dict(module.parameters), dict(module.example)
    if not isinstance(name, str) or not re.fullmatch(r"[a-z][a-z0-9-]*", name) or name in LAWS:
        raise MaterialError(
            f"{where}: name {name!r} must be small letters, digits and hyphens, and none of {', '.join(LAWS)}"
        )
    wrong = [f"{k}: {u!r}" for k, u in parameters.items() if u not in ("Pa", "1")]
    if wrong or not parameters:
        raise MaterialError(
            f'{where}: parameters need the unit "Pa" or "1"; given {", ".join(wrong) or "none"}'
        )
    if set(example) != set(parameters):
        raise MaterialError(
            f"{where}: example must give {', '.join(parameters)}; given {', '.join(example) or 'none'}"
        )
    law = Law(
        name=name,
        parameters=parameters,
        energy=module.energy,
        derivatives=_five(module.derivatives),
        shear_modulus=_modulus(module.derivatives),
        optional=dict(getattr(module, "optional", {})),
        limits=dict(getattr(module, "limits", {})),
        by_parameter=getattr(module, "by_parameter", None),
        file=str(path.resolve()),
        starts=_starts(parameters, example, module.derivatives),
    )
    check_law(law, example, where)
    return law


def _run(path: Path, where: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"user_law_{abs(hash(str(path.resolve())))}", path)
    if spec is None or spec.loader is None:
        raise MaterialError(f"{where}: is not a Python file; its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise MaterialError(f"{where} cannot be run: {type(error).__name__}: {_flat(error)}") from None
    return module


def _flat(error: Exception) -> str:
    return " ".join(str(error).split())


def _five(derivatives: Any) -> Any:
    """The user's derivatives with the second ones, by complex step where they are not given."""

    def full(I1: Array, I2: Array, **p: float) -> tuple[Array, ...]:
        out = derivatives(I1, I2, **p)
        zero = np.zeros_like(np.asarray(I1, float))
        if len(out) == 5:
            return tuple(v + zero for v in out)
        h = 1e-30
        d1, d2 = derivatives(I1 + 1j * h, I2, **p), derivatives(I1, I2 + 1j * h, **p)
        second = [np.imag(v) / h + zero for v in (d1[0], d2[0], d2[1])]
        return out[0] + zero, out[1] + zero, *second

    return full


def _modulus(derivatives: Any) -> Any:
    def modulus(**p: float) -> float:
        three = np.array([3.0])
        W1, W2 = derivatives(three, three, **p)[:2]
        return float(np.real((2.0 * (W1 + W2) + 0.0 * three)[0]))

    return modulus


def _starts(parameters: Mapping[str, str], example: Mapping[str, float], derivatives: Any) -> Any:
    """The example, its moduli scaled to the tests'."""
    mu0 = _modulus(derivatives)

    def starts(mu: float, reach: float) -> list[dict[str, float]]:
        k = mu / mu0(**example)
        return [{n: v * (k if parameters[n] == "Pa" else 1.0) for n, v in example.items()}]

    return starts


def check_law(law: Law, example: Mapping[str, float], where: str) -> None:
    """Energy, first and second derivatives agree; rest is stress-free, without energy, and stiff.

    Raises MaterialError naming the formula that disagrees, by how much and where.
    """
    rng = np.random.default_rng(1)
    x = np.exp(rng.uniform(-0.5, 0.5, (2, 24)))
    x = np.stack([x[0], x[1], 1.0 / (x[0] * x[1])])
    I1, I2 = x.sum(axis=0), (1.0 / x).sum(axis=0)
    p = dict(example)
    three = np.array([3.0])
    try:
        rest = float(np.asarray(law.energy(three, three, **p) + 0.0 * three)[0])
        mu = law.shear_modulus(**p)
        W = np.asarray(law.energy(I1, I2, **p))
        D = law.derivatives(I1, I2, **p)
        at_rest = law.derivatives(three, three, **p)
    except Exception as error:
        raise MaterialError(
            f"{where}: the formulas fail on arrays: {type(error).__name__}: {_flat(error)}"
        ) from None
    if (
        W.shape != I1.shape
        or not np.all(np.isfinite(W))
        or not all(np.all(np.isfinite(d)) for d in (*D, *at_rest))
    ):
        raise MaterialError(
            f"{where}: energy or derivatives are not finite or have not the shape of I1, near rest already"
        )
    if not mu > 0:
        raise MaterialError(
            f"{where}: 2 (W1 + W2) at rest is {mu:g} Pa with the example; it must be positive"
        )
    if abs(rest) > 1e-9 * mu:
        raise MaterialError(
            f"{where}: the energy at rest (I1 = I2 = 3) is {rest:g} Pa with the example; it must be 0"
        )

    def difference(k: int | None, axis: int) -> Array:
        def f(a: Array, b: Array) -> Array:
            return (
                np.asarray(law.energy(a, b, **p) if k is None else law.derivatives(a, b, **p)[k]) + 0.0 * I1
            )

        def once(h: float) -> Array:
            d = (h, 0.0) if axis == 1 else (0.0, h)
            return (f(I1 + d[0], I2 + d[1]) - f(I1 - d[0], I2 - d[1])) / (2.0 * h)

        return (4.0 * once(5e-4) - once(1e-3)) / 3.0

    for name, k, axis, i in (
        ("W1", None, 1, 0),
        ("W2", None, 2, 1),
        ("W11", 0, 1, 2),
        ("W12", 0, 2, 3),
        ("W22", 1, 2, 4),
    ):
        numeric = difference(k, axis)
        off = np.abs(D[i] - numeric) / np.maximum(np.abs(numeric), mu)
        j = int(np.argmax(off))
        if off[j] > TOLERANCE:
            source = "the energy" if k is None else f"W{k + 1}"
            raise MaterialError(
                f"{where}: {name} is {D[i][j]:.6g} at I1 = {I1[j]:.3f}, I2 = {I2[j]:.3f}, but the slope of "
                f"{source} there is {numeric[j]:.6g}; correct `derivatives` or `energy`"
            )
