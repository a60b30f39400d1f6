"""How weight turns a bending actuator: what gravity and payload share."""

import numpy as np

from fem_spa.loop.effects.effect import Context

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(6)


def turning(ctx: Context, response: np.ndarray, tip: bool) -> np.ndarray:
    """(n, d) change of the outputs for weight of unit size.

    An angle bends with constant curvature: the inclination at a share z of the length is orientation + z
    angle,
    and the moment's turn of the tip is the mean of -sin(inclination) with the weight z (1 - z) for the
    body's own
    weight, z for one at the tip. A displacement is along the axis: it changes by the cosine of the
    orientation.
    """
    phi = ctx.data.orientation
    out = np.empty_like(response)
    for j, name in enumerate(ctx.names):
        if name != "angle":
            out[:, j] = ctx.scale[j] * np.cos(phi)
            continue
        total = np.zeros(len(phi))
        for x, w in zip(_POINTS, _WEIGHTS, strict=True):
            z = 0.5 * (x + 1.0)
            weight = 0.5 * w * (z if tip else 6.0 * z * (1.0 - z))
            total -= weight * np.sin(phi + z * response[:, j])
        out[:, j] = ctx.scale[j] * total
    return out
