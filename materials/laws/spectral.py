"""Derivatives to (I1, I2) of W = sum of f(x_i), x_i the principal values of the isochoric C.

The x_i are the roots of p(z) = z^3 - I1 z^2 + I2 z - 1. With Cauchy's theorem, on a contour around
them and inside the region where f' is analytic,

    W  =  1/(2 pi i) * integral of f p'/p dz,
    W1 =  [z^2 f'],   W2 = -[z f'],        [g] = 1/(2 pi i) * integral of g/p dz,
    W11 = {z^4 f'},   W12 = -{z^3 f'},     {g} = 1/(2 pi i) * integral of g/p^2 dz,
    W22 = {z^2 f'}

([g] and {g} are the divided differences of g on the roots, single and double.) Nothing here
divides by a difference of roots, so equal roots, as at rest, need no branch, and no root is ever
computed: only the largest and smallest are estimated to place the contour. It is an ellipse in
w = ln z with the outermost roots as foci, where powers and logarithms of z are entire; the
trapezoid rule on it converges geometrically (L. N. Trefethen, J. A. C. Weideman, SIAM Review 56
(2014) 385). Its foci are at ln of the outermost roots, the copies of p's zeros at distance 2 pi.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Array = np.ndarray

CHUNK = 4096
"""Points worked on at once: their temporaries stay in the cache."""

_BINS = np.array([0.15, 0.6, 1.5, 3.0, 6.0, 12.0, 20.0])
_DIGITS = 40.0


def spectral_energy(I1: Array, I2: Array, f: Callable[[Array, Array], Array]) -> Array:
    """Sum of f over the principal values.

    Parameters
    ----------
    I1, I2 : isochoric invariants, both >= 3, one shape; stretches up to about e^4 to either side
    f : (z, w) -> f(z), w = ln z, complex arrays; analytic in w for |Im w| < pi

    Returns
    -------
    W, shape of I1
    """

    def integrand(z: Array, w: Array, i1: Array, i2: Array) -> tuple[Array, ...]:
        p, dp = _cubic(z, i1, i2)
        return (f(z, w) * dp * z / p,)

    return _contour(I1, I2, integrand, 1)[0]


def spectral_derivatives(
    I1: Array, I2: Array, zdf: Callable[[Array, Array], Array]
) -> tuple[Array, Array, Array, Array, Array]:
    """W1, W2, W11, W12, W22 of W = sum of f(x_i), to about 1e-12 relative, equal roots included.

    Parameters
    ----------
    I1, I2 : isochoric invariants, both >= 3, one shape
    zdf : (z, w) -> z f'(z), w = ln z, complex arrays; analytic in w for |Im w| < pi
    """

    def integrand(z: Array, w: Array, i1: Array, i2: Array) -> tuple[Array, ...]:
        p, _ = _cubic(z, i1, i2)
        b = zdf(z, w) * z / p  # z f' dz/dw over p
        a = b * z
        c = b * z / p
        d = c * z
        return a, -b, d * z, -d, c

    w1, w2, w11, w12, w22 = _contour(I1, I2, integrand, 5)
    return w1, w2, w11, w12, w22


def _cubic(z: Array, i1: Array, i2: Array) -> tuple[Array, Array]:
    return ((z - i1) * z + i2) * z - 1.0, (3.0 * z - 2.0 * i1) * z + i2


def outer_roots(I1: Array, I2: Array) -> tuple[Array, Array]:
    """Largest and smallest principal value of C, by the trigonometric formula.

    Near rest good to sqrt(eps) only, which is all that a contour and a stretch readout need. Where
    (I1, I2) belong to no real deformation (round-off), the nearest ones are returned.
    """
    I1, I2 = np.asarray(I1, float), np.asarray(I2, float)
    m = I1 / 3.0
    q = np.sqrt(np.maximum(m * m - I2 / 3.0, 0.0))
    r = m * m * m - 0.5 * (m * I2 - 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        cos = np.where(q > 0, r / np.where(q > 0, q, 1.0) ** 3, 0.0)
    angle = np.arccos(np.clip(cos, -1.0, 1.0)) / 3.0
    high = m + 2.0 * q * np.cos(angle)
    # 1/x are the roots of z^3 - I2 z^2 + I1 z - 1: the smallest root without cancellation.
    m = I2 / 3.0
    q = np.sqrt(np.maximum(m * m - I1 / 3.0, 0.0))
    r = m * m * m - 0.5 * (m * I1 - 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        cos = np.where(q > 0, r / np.where(q > 0, q, 1.0) ** 3, 0.0)
    angle = np.arccos(np.clip(cos, -1.0, 1.0)) / 3.0
    return high, 1.0 / (m + 2.0 * q * np.cos(angle))


def _nodes(span: float) -> tuple[float, int]:
    """(rho of the ellipse, number of points on its upper half) for ln(x_max/x_min) up to `span`."""
    rho = 0.5 * np.arcsinh(4.0 * np.pi / span)
    return rho, int(np.ceil(0.5 * _DIGITS / rho)) + 2


def _contour(
    I1: Array, I2: Array, integrand: Callable[[Array, Array, Array, Array], tuple[Array, ...]], count: int
) -> list[Array]:
    """Trapezoid rule over the upper half of the contour; the lower half is its conjugate."""
    I1, I2 = np.broadcast_arrays(np.asarray(I1, float), np.asarray(I2, float))
    shape = I1.shape
    i1, i2 = I1.ravel(), I2.ravel()
    result = [np.full(i1.shape, np.nan) for _ in range(count)]
    good = np.isfinite(i1) & np.isfinite(i2) & (i1 > 0) & (i2 > 0)
    high, low = outer_roots(np.where(good, i1, 3.0), np.where(good, i2, 3.0))
    w_high, w_low = np.log(high), np.log(low)
    span = w_high - w_low
    bins = np.searchsorted(_BINS, span)
    for b in range(len(_BINS)):
        members = np.flatnonzero(good & (bins == b))
        rho, n = _nodes(float(_BINS[b]))
        theta = (np.arange(n) + 0.5) * np.pi / n
        for start in range(0, members.size, CHUNK):
            index = members[start : start + CHUNK]
            half = 0.5 * span[index]
            minor = np.maximum(half * np.sinh(rho), 0.6)
            major = np.sqrt(half**2 + minor**2)
            centre = 0.5 * (w_high[index] + w_low[index])
            total = [np.zeros(index.size) for _ in range(count)]
            for t in theta:
                w = (centre + major * np.cos(t)) + 1j * (minor * np.sin(t))
                dw = (minor * np.cos(t)) + 1j * (major * np.sin(t))  # dw/dt divided by i
                for k, value in enumerate(integrand(np.exp(w), w, i1[index], i2[index])):
                    total[k] += (value * dw).real
            for k in range(count):
                result[k][index] = total[k] / n
    return [r.reshape(shape) for r in result]
