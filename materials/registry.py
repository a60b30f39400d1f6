"""Laws by name, and whether numbers make a believable rubber of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from materials.errors import MaterialError
from materials.laws import LAWS, Law
from materials.names import allowed

SOFTEST = 100.0
"""Pa. Softer than any gel that holds its shape: a shear modulus below it is a slip of unit."""

STIFFEST = 1e11
"""Pa. Stiffer than steel: a shear modulus above it is a slip of unit."""


def law(name: str) -> Law:
    """The law called `name`, or in the file `name` (ends in .py, see materials.user_law).

    MaterialError with the nearest right name otherwise.
    """
    if name.endswith(".py"):
        from materials.user_law import load_law

        return load_law(name)
    if name not in LAWS:
        raise MaterialError(f'law "{name}" is not known; {allowed(name, LAWS)}')
    return LAWS[name]


def resolve(law: Law, parameters: Mapping[str, float], where: str = "") -> dict[str, float]:
    """Every parameter of `law`, optional ones filled in, checked.

    Parameters
    ----------
    law : the law
    parameters : name -> SI value
    where : words for the error, such as 'card "dragon-skin-30"'

    Raises
    ------
    MaterialError : a parameter is unknown, missing, not finite or out of its limits; the small-strain
        shear modulus is not positive, or is below 100 Pa or above 100 GPa
    """
    prefix = f"{where}: " if where else ""
    for name in parameters:
        if name not in law.parameters:
            raise MaterialError(
                f'{prefix}law "{law.name}" has no parameter "{name}"; {allowed(name, law.parameters)}'
            )
    full = {name: law.optional[name] for name in law.parameters if name in law.optional}
    full.update(parameters)
    missing = [name for name in law.parameters if name not in full]
    if missing:
        raise MaterialError(f'{prefix}law "{law.name}" needs {", ".join(missing)}, not given')
    full = {name: float(full[name]) for name in law.parameters}
    for name, value in full.items():
        low, high = law.limits.get(name, (-math.inf, math.inf))
        if not math.isfinite(value):
            raise MaterialError(f"{prefix}{name} is {value}; a finite number is needed")
        if not low <= value <= high:
            raise MaterialError(f"{prefix}{name} is {value:g}; law {law.name} allows {low:g} to {high:g}")
    mu = law.shear_modulus(**full)
    if not mu > 0:
        raise MaterialError(
            f"{prefix}the small-strain shear modulus comes out as {mu:g} Pa; it must be positive, or the "
            f"material collapses at rest (law {law.name}, {_listing(full)})"
        )
    if not SOFTEST <= mu <= STIFFEST:
        end = "softer than any gel" if mu < SOFTEST else "stiffer than steel"
        raise MaterialError(
            f"{prefix}a shear modulus of {mu:.3g} Pa is {end}; 100 Pa to 100 GPa is allowed: "
            f"is a parameter's unit wrong (Pa for MPa, or the reverse)?"
        )
    return full


def _listing(parameters: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:g}" for name, value in parameters.items())


@dataclass(frozen=True)
class SmallStrain:
    """Linear constants at rest: mu, K (bulk) and E (Young) in Pa, Poisson's ratio nu."""

    mu: float
    K: float
    nu: float
    E: float


def small_strain(law: Law, parameters: Mapping[str, float], bulk: float = math.inf) -> SmallStrain:
    """mu, K, nu and E of `law` at rest.

    Parameters
    ----------
    law, parameters : as for `resolve`
    bulk : bulk modulus in Pa, positive or inf; a law that gives its own (`linear`) overrides inf

    Raises
    ------
    MaterialError : as `resolve`; or the bulk modulus is below 2/3 mu (negative Poisson's ratio)
    """
    full = resolve(law, parameters)
    mu = law.shear_modulus(**full)
    K = law.bulk(**full) if law.bulk is not None and math.isinf(bulk) else float(bulk)
    if not K > 0:
        raise MaterialError(f'bulk modulus is {K:g} Pa; a positive one or "inf" (incompressible) is needed')
    if math.isinf(K):
        return SmallStrain(mu, K, 0.5, 3.0 * mu)
    nu = (3.0 * K - 2.0 * mu) / (2.0 * (3.0 * K + mu))
    if nu < 0 and law.bulk is None:
        raise MaterialError(
            f"bulk modulus {K:.3g} Pa with shear modulus {mu:.3g} Pa makes Poisson's ratio {nu:.2f}; at "
            f"least 2/3 of the shear modulus is needed, and rubbers have 1 to 2 GPa: is its unit right?"
        )
    return SmallStrain(mu, K, nu, 9.0 * K * mu / (3.0 * K + mu))
