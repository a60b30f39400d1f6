"""One law fitted to any number of tests: weighted least squares on the nominal stress.

Derivatives to the parameters are analytic. A law that is linear in its parameters is solved at
once; others by scipy's trust-region least squares from several starts. Bounds keep the small-strain
shear modulus positive: Mooney-Rivlin is fitted in (C10 + C01, C01), Ogden in (mu_p alpha_p, alpha_p),
both >= 0 in their first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares

from materials.errors import MaterialError
from materials.laws import LAWS, Array, Law
from materials.names import allowed
from materials.ogden_starts import ogden_starts
from materials.response import kirchhoff, kirchhoff_by_parameter, principal_stretches
from materials.specimen import Specimen, noise
from materials.variables import Variables, variables_of

WEIGHTS = ("absolute", "relative", "noise")
RELATIVE_FLOOR = 0.05
"""Relative weights count a stress below this share of its test's largest as that share."""


@dataclass(frozen=True)
class Variant:
    """A law with those of its parameters that are fitted; `name` is "yeoh-2", "ogden-3", or the law's."""

    name: str
    law: Law
    free: tuple[str, ...]

    def full(self, values: Array) -> dict[str, float]:
        """Every parameter of the law from the free ones (n_free,)."""
        given = dict(zip(self.free, map(float, values), strict=True))
        return {name: given.get(name, self.law.optional.get(name, math.nan)) for name in self.law.parameters}


def variants(names: Sequence[str] | None = None, laws: dict[str, Law] | None = None) -> list[Variant]:
    """The variants called `names`: a variant ("ogden-2"), or a law, which means all of its variants.

    None: every variant of every law except `linear`, which is for comparison only.
    Raises MaterialError with the nearest name.
    """
    laws = LAWS if laws is None else laws
    every = [
        Variant(name, law, free)
        for law in laws.values()
        for name, free in (law.variants or {law.name: tuple(law.parameters)}).items()
    ]
    if names is None:
        return [v for v in every if v.law.name != "linear"]
    out: list[Variant] = []
    for name in names:
        found = [v for v in every if name in (v.name, v.law.name)]
        if not found:
            known = dict.fromkeys([*laws, *(v.name for v in every)])
            raise MaterialError(f'law "{name}" is not known; {allowed(name, known)}')
        out += [v for v in found if v not in out]
    return out


@dataclass(frozen=True)
class Data:
    """All rows of all tests, ready for a fit.

    Parameters
    ----------
    stretches : isochoric principal stretches, (3, n)
    stress : nominal stress, Pa, (n,)
    weight : what a residual is multiplied with, 1/Pa, (n,)
    specimen : index of the specimen of each row, (n,)
    mode : its mode, (n,)
    """

    stretches: Array
    stress: Array
    weight: Array
    specimen: Array
    mode: Array

    def pick(self, mask: Array) -> Data:
        """The rows of a mask (n,)."""
        return Data(
            self.stretches[:, mask],
            self.stress[mask],
            self.weight[mask],
            self.specimen[mask],
            self.mode[mask],
        )

    @property
    def reach(self) -> float:
        """Greatest I1 - 3."""
        return float(np.max(np.sum(self.stretches**2, axis=0)) - 3.0)

    @property
    def modulus(self) -> float:
        """Rough shear modulus, Pa: neo-Hooke through the rows strained less than the median."""
        slope = self.stretches[0] - self.stretches[2] ** 2 / self.stretches[0]
        near = np.abs(np.log(self.stretches[0])) <= np.median(np.abs(np.log(self.stretches[0])))
        value = float(np.sum(slope[near] * self.stress[near]) / max(float(np.sum(slope[near] ** 2)), 1e-300))
        return value if value > 0 else float(np.max(np.abs(self.stress)))


def collect(specimens: Sequence[Specimen], weights: str = "absolute") -> Data:
    """The rows of the specimens.

    weights : "absolute": every row's error counts the same (ordinary least squares); "relative": it
        counts as a share of the row's stress; "noise": in units of the noise of its test, measured
        from neighbouring rows
    """
    if weights not in WEIGHTS:
        raise MaterialError(f'weights "{weights}" are not known; {allowed(weights, WEIGHTS)}')
    largest = max(float(np.max(np.abs(s.stress))) for s in specimens)
    w = []
    for s in specimens:
        top = float(np.max(np.abs(s.stress)))
        if weights == "absolute":
            w.append(np.full(s.stress.size, 1.0 / largest))
        elif weights == "relative":
            w.append(1.0 / np.maximum(np.abs(s.stress), RELATIVE_FLOOR * top))
        else:
            sigma = noise(s)
            sigma = sigma if math.isfinite(sigma) and sigma > 1e-9 * top else 1e-3 * top
            w.append(np.full(s.stress.size, 1.0 / sigma))
    return Data(
        np.concatenate([principal_stretches(s.mode, s.stretch) for s in specimens], axis=1),
        np.concatenate([s.stress for s in specimens]),
        np.concatenate(w),
        np.concatenate([np.full(s.stress.size, i) for i, s in enumerate(specimens)]),
        np.concatenate([np.full(s.stress.size, s.mode) for s in specimens]),
    )


def predict(law: Law, parameters: dict[str, float], stretches: Array) -> Array:
    """Nominal stress, Pa, (n,); nan where the law ends."""
    with np.errstate(all="ignore"):
        tau = kirchhoff(law, parameters, stretches)
        return (tau[0] - tau[2]) / stretches[0]


def predict_by_parameter(variant: Variant, parameters: dict[str, float], stretches: Array) -> Array:
    """d(nominal stress)/d(free parameter), (n, n_free)."""
    with np.errstate(all="ignore"):
        tau = kirchhoff_by_parameter(variant.law, parameters, stretches)
        return np.stack([(tau[name][0] - tau[name][2]) / stretches[0] for name in variant.free], axis=1)


@dataclass(frozen=True)
class Fit:
    """The outcome of one fit.

    Parameters
    ----------
    variant : what was fitted
    parameters : every parameter of the law, SI
    values : the free ones, (n_free,)
    cost : sum of squared weighted residuals
    rmse : root mean square of the residual stress, Pa
    r2 : coefficient of determination of the stress
    rmse_share : rmse over the largest stress
    at_bound : free parameters that lie on a bound
    jacobian : weighted, (n, n_free), to the free parameters
    residual : weighted, (n,)
    """

    variant: Variant
    parameters: dict[str, float]
    values: Array
    cost: float
    rmse: float
    r2: float
    rmse_share: float
    at_bound: tuple[str, ...] = ()
    jacobian: Array = field(default_factory=lambda: np.zeros((0, 0)))
    residual: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def name(self) -> str:
        """Name of the variant."""
        return self.variant.name

    @property
    def law(self) -> Law:
        """The law."""
        return self.variant.law


def fit(
    variant: Variant,
    data: Data,
    start: Sequence[Array] | None = None,
    reach: float | None = None,
    thorough: bool = True,
) -> Fit:
    """`variant` fitted to `data`.

    Parameters
    ----------
    start : free parameters to start from (a cross-validation fold starts from the whole fit)
    reach : greatest I1 - 3 that the law must bear; default that of `data`
    thorough : many starts for laws with several minima, and to the last digit

    Raises
    ------
    MaterialError : fewer rows than parameters, or no start leads anywhere
    """
    n = data.stress.size
    if n < len(variant.free):
        raise MaterialError(
            f"{variant.name} has {len(variant.free)} parameters and the tests have {n} rows; "
            "give more rows or a law with fewer parameters"
        )
    variables = variables_of(variant.law, variant.free, data.modulus, data.reach if reach is None else reach)
    best = None
    if variant.law.linear:
        best = _solve_linear(variant, data, variables)
    if best is None:
        best = _search(variant, data, variables, start, thorough)
    return finish(variant, data, best, variables)


def finish(variant: Variant, data: Data, values: Array, variables: Variables | None = None) -> Fit:
    """The `Fit` of given free parameters (n_free,)."""
    parameters = variant.full(values)
    model = predict(variant.law, parameters, data.stretches)
    error = model - data.stress
    total = float(np.sum((data.stress - data.stress.mean()) ** 2))
    rmse = math.sqrt(float(np.mean(error**2)))
    return Fit(
        variant=variant,
        parameters=parameters,
        values=np.asarray(values, float),
        cost=float(np.sum((data.weight * error) ** 2)),
        rmse=rmse,
        r2=1.0 - float(np.sum(error**2)) / total if total > 0 else math.nan,
        rmse_share=rmse / float(np.max(np.abs(data.stress))),
        at_bound=() if variables is None else variables.at_bound(values),
        jacobian=predict_by_parameter(variant, parameters, data.stretches) * data.weight[:, None],
        residual=data.weight * error,
    )


def _solve_linear(variant: Variant, data: Data, variables: Variables) -> Array | None:
    """Ordinary least squares; None where its answer lies outside the bounds."""
    anywhere = variant.full(np.ones(len(variant.free)))
    A = predict_by_parameter(variant, anywhere, data.stretches) * data.weight[:, None]
    scale = np.linalg.norm(A, axis=0)
    if not np.all(scale > 0):
        return None
    values = np.linalg.lstsq(A / scale, data.weight * data.stress, rcond=None)[0] / scale
    return values if variables.inside(values) else None


def _search(
    variant: Variant, data: Data, variables: Variables, start: Sequence[Array] | None, thorough: bool
) -> Array:
    law = variant.law
    if start is not None:
        starts = [np.asarray(s, float) for s in start]
    else:
        starts = []
        if law.name == "ogden":
            starts = ogden_starts(len(variant.free) // 2, data.stretches, data.stress, data.weight, thorough)
        elif law.starts is not None:
            rows = law.starts(data.modulus, max(data.reach, 1e-3))
            starts = [np.array([row[name] for name in variant.free]) for row in rows]
        if not starts:
            unit = [data.modulus / 2 if law.parameters[k] == "Pa" else 1.0 for k in variant.free]
            starts = [np.array(unit) * f for f in (1.0, 0.1, 0.01)]

    def residual(v: Array) -> Array:
        values = variables.values(v)
        r = data.weight * (predict(law, variant.full(values), data.stretches) - data.stress)
        return np.where(np.isfinite(r), r, 1e6)

    def jacobian(v: Array) -> Array:
        values = variables.values(v)
        J = predict_by_parameter(variant, variant.full(values), data.stretches) * data.weight[:, None]
        return np.where(np.isfinite(J), J, 0.0) @ variables.jacobian(v)

    def run(v: Array, tolerance: float, evaluations: int) -> tuple[float, Array]:
        out = least_squares(
            residual,
            variables.clip(v),
            jac=jacobian,
            bounds=(variables.low, variables.high),
            x_scale="jac",
            ftol=tolerance,
            xtol=tolerance,
            gtol=1e-15,
            max_nfev=evaluations,
        )
        return float(2.0 * out.cost), out.x

    rough = []
    for s in starts:
        try:
            rough.append(run(variables.variables(s), *((1e-6, 30) if len(starts) > 1 else (1e-9, 150))))
        except (ValueError, np.linalg.LinAlgError):
            continue
    if not rough:
        raise MaterialError(
            f"{variant.name}: no fit found from {len(starts)} starts; is the law right for these tests?"
        )
    rough.sort(key=lambda pair: pair[0])
    if not thorough:
        return variables.values(rough[0][1])
    ends = [run(v, 1e-13, 300) for _, v in rough[: 2 if start is None else 1]]
    values = variables.values(min(ends, key=lambda pair: pair[0])[1])
    return _in_order(values) if law.name == "ogden" and start is None else values


def _in_order(values: Array) -> Array:
    """Ogden's terms by their part of the shear modulus, largest first: any order is the same law."""
    terms = values.reshape(-1, 2)
    return terms[np.argsort(-terms[:, 0] * terms[:, 1])].ravel()
