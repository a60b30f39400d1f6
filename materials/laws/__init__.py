"""Laws: energy of the isochoric invariants and its derivatives. One law a file; `LAWS` lists them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

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
    """

    name: str
    parameters: dict[str, str]
    energy: Callable[..., Array]
    derivatives: Callable[..., tuple[Array, Array, Array, Array, Array]]
    shear_modulus: Callable[..., float]
    optional: dict[str, float]
