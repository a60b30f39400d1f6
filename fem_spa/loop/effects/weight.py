"""How weight turns a bending actuator: what gravity and payload share."""

import numpy as np

from fem_spa.loop.effects.effect import Context

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def weighed(ctx: Context, response: np.ndarray, weight: np.ndarray, tip: bool) -> np.ndarray:
    """(n, d) outputs in balance with a weight, (n,) shares of the response's scale.

    An angle bends with constant curvature: the inclination at a share z of the length is orientation plus
    z times the angle, and the moment turns the tip by the mean of -sin(inclination), weighted with z (1 - z)
    for the body's own weight, with z for one at the tip. The angle is the one that is reached, so this
    is solved (Newton). A
    displacement is along the axis: it changes by the cosine of the orientation.
    """
    phi = ctx.data.orientation
    out = np.empty_like(response)
    for j, name in enumerate(ctx.names):
        size = weight * ctx.scale[j]
        if name != "angle":
            out[:, j] = response[:, j] + size * np.cos(phi)
            continue
        angle = response[:, j].copy()
        for _ in range(4):
            turn, slope = np.zeros(len(phi)), np.zeros(len(phi))
            for x, w in zip(_POINTS, _WEIGHTS, strict=True):
                z = 0.5 * (x + 1.0)
                share = 0.5 * w * (z if tip else 6.0 * z * (1.0 - z))
                turn -= share * np.sin(phi + z * angle)
                slope -= share * z * np.cos(phi + z * angle)
            step = (angle - response[:, j] - size * turn) / np.maximum(1.0 - size * slope, 0.3)
            angle = np.clip(angle - step, -6.0, 6.0)
        out[:, j] = angle
    return out
