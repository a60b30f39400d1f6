"""Laws: energy of the isochoric invariants and its derivatives. One law a file; `LAWS` lists them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class Law:
    """A hyperelastic law W(I1, I2) per unit volume, I1 and I2 of the isochoric C (det = 1).

    Parameters
    ----------
    name : as decks and cards name it
    parameters : name -> unit ("Pa" or "1"), in order
    energy : (I1, I2, **parameters) -> W, Pa; vectorized over arrays
    derivatives : (I1, I2, **parameters) -> (W1, W2, W11, W12, W22), Pa, same shapes as I1
    shear_modulus : (**parameters) -> small-strain mu = 2 (W1 + W2) at rest, Pa
    optional : name -> value that a parameter takes when it is not given
    bulk : (**parameters) -> bulk modulus in Pa where the parameters themselves give it
        (`linear`: E and nu); None where it is stated apart
    limits : name -> (low, high) a parameter must lie in, ends included; SI

    What follows serves the fit only; a law without it is fitted all the same, more slowly.

    principal : (stretch (3, n), **parameters) -> tau (3, n), Pa, tau_i = l_i dW/dl_i, where there is
        a shorter way than by the invariants
    by_parameter : (I1, I2, **parameters) -> name -> (dW1, dW2), derivatives to that parameter
    principal_by_parameter : the same of `principal`: name -> array (3, n)
    variants : name -> parameters that are free in that variant (`yeoh-2`); default all
    linear : whether the stress is linear in the free parameters
    data_limits : (greatest I1 - 3 of the tests) -> name -> (low, high), tighter than `limits`
    starts : (mu in Pa, greatest I1 - 3) -> parameter sets from which a search begins
    file : of a user's law, the .py file that it came from
    """

    name: str
    parameters: dict[str, str]
    energy: Callable[..., Array]
    derivatives: Callable[..., tuple[Array, Array, Array, Array, Array]]
    shear_modulus: Callable[..., float]
    optional: Mapping[str, float] = field(default_factory=dict)
    bulk: Callable[..., float] | None = None
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    principal: Callable[..., Array] | None = None
    by_parameter: Callable[..., dict[str, tuple[Array, Array]]] | None = None
    principal_by_parameter: Callable[..., dict[str, Array]] | None = None
    variants: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    linear: bool = False
    data_limits: Callable[[float], dict[str, tuple[float, float]]] | None = None
    starts: Callable[[float, float], list[dict[str, float]]] | None = None
    file: str = ""

    def __reduce__(self) -> Any:
        """Laws travel between processes by their name or file: formulas do not pickle."""
        if self.file:
            from materials.user_law import load_law

            return load_law, (self.file,)
        if LAWS.get(self.name) is self:
            return _built_in, (self.name,)
        return super().__reduce__()


# The laws' own modules import `Law` from here, so they come after it.
from materials.laws.arruda_boyce import ARRUDA_BOYCE  # noqa: E402
from materials.laws.extended_tube import EXTENDED_TUBE  # noqa: E402
from materials.laws.gent import GENT  # noqa: E402
from materials.laws.linear import LINEAR  # noqa: E402
from materials.laws.mooney_rivlin import MOONEY_RIVLIN  # noqa: E402
from materials.laws.neo_hooke import NEO_HOOKE  # noqa: E402
from materials.laws.ogden import OGDEN  # noqa: E402
from materials.laws.yeoh import YEOH  # noqa: E402

LAWS: dict[str, Law] = {
    law.name: law
    for law in (NEO_HOOKE, MOONEY_RIVLIN, YEOH, OGDEN, GENT, ARRUDA_BOYCE, EXTENDED_TUBE, LINEAR)
}


def _built_in(name: str) -> Law:
    return LAWS[name]


__all__ = ["LAWS", "Law"]
