"""Yeoh: W = sum of Ci0 (I1 - 3)^i, i = 1..3. O. H. Yeoh, Rubber Chem. Technol. 66 (1993) 754, eq. 4."""

from __future__ import annotations

import numpy as np

from materials.laws import Array, Law


def energy(I1: Array, I2: Array, *, C10: float, C20: float, C30: float = 0.0) -> Array:
    """W in Pa; I1, I2 >= 3 of any one shape, C10 > 0, C20, C30 in Pa."""
    x = I1 - 3.0
    return x * (C10 + x * (C20 + x * C30))


def derivatives(
    I1: Array, I2: Array, *, C10: float, C20: float, C30: float = 0.0
) -> tuple[Array, Array, Array, Array, Array]:
    """W1, W2, W11, W12, W22 in Pa, shapes of I1."""
    x = I1 - 3.0
    zero = np.zeros_like(x)
    return C10 + x * (2.0 * C20 + 3.0 * x * C30), zero, 2.0 * C20 + 6.0 * x * C30, zero, zero


def shear_modulus(*, C10: float, C20: float, C30: float = 0.0) -> float:
    """mu = 2 C10, Pa."""
    return 2.0 * C10


def by_parameter(
    I1: Array, I2: Array, *, C10: float, C20: float, C30: float = 0.0
) -> dict[str, tuple[Array, Array]]:
    """(dW1, dW2) to each parameter."""
    x, zero = I1 - 3.0, np.zeros_like(I1)
    return {"C10": (np.ones_like(x), zero), "C20": (2.0 * x, zero), "C30": (3.0 * x * x, zero)}


YEOH = Law(
    "yeoh",
    {"C10": "Pa", "C20": "Pa", "C30": "Pa"},
    energy,
    derivatives,
    shear_modulus,
    optional={"C20": 0.0, "C30": 0.0},
    limits={"C10": (0.0, np.inf)},
    by_parameter=by_parameter,
    variants={"yeoh-2": ("C10", "C20"), "yeoh-3": ("C10", "C20", "C30")},
    linear=True,
    starts=lambda mu, reach: [{"C10": mu / 2, "C20": 0.0, "C30": 0.0}],
)
