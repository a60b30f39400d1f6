"""Laws: energy of the isochoric invariants and its derivatives. One law a file; `LAWS` lists them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

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
    """

    name: str
    parameters: dict[str, str]
    energy: Callable[..., Array]
    derivatives: Callable[..., tuple[Array, Array, Array, Array, Array]]
    shear_modulus: Callable[..., float]
    optional: Mapping[str, float] = field(default_factory=dict)
    bulk: Callable[..., float] | None = None
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)


# The laws' own modules import `Law` from here, so they come after it.
from materials.laws.linear import LINEAR  # noqa: E402
from materials.laws.mooney_rivlin import MOONEY_RIVLIN  # noqa: E402
from materials.laws.neo_hooke import NEO_HOOKE  # noqa: E402
from materials.laws.yeoh import YEOH  # noqa: E402

LAWS: dict[str, Law] = {law.name: law for law in (NEO_HOOKE, MOONEY_RIVLIN, YEOH, LINEAR)}

__all__ = ["LAWS", "Law"]
