r"""Three fingers on a Y-shaped connector: (29)-(35) of Yu et al. (2022).

The global y axis is the way of approach; every finger's x runs along it at rest, its y towards the axis. The
matrices (29), (31), (33) are one family, T = [R_z(yaw) R_x(roll), X]:

    finger 1 at  +x          yaw alpha_1 = 90 deg            roll    0
    finger 2 at 120 deg      yaw beta_1  = 90 deg            roll   -beta_2,  beta_2 = 120 deg
    finger 3 at 240 deg      yaw gamma_1 = 90 deg            roll   +gamma_2, gamma_2 = 120 deg

(counted from +x towards +z about the y axis, which is the rotation by minus that angle). The paper prints
neither the angles nor the places X. Its egg gives them: global (-7.5, 75, 12.9) is (75, 51.4, 0) of finger
2, so that X lies at y = 0, 120 deg, and 51.4 + 14.92 = 66.32 mm from the axis, `RADIUS`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fem_spa.errors import InputError
from fem_spa.reduced.curvature import joints
from fem_spa.reduced.curvature_inverse import Reach, inverse
from fem_spa.reduced.finger import Finger

EGG_GLOBAL = (-7.5e-3, 75e-3, 12.9e-3)
EGG_BASE = (75e-3, 51.4e-3, 0.0)
"""m: point A on the egg, globally and in finger 2's frame, as printed (section 4)."""
SPHERE_GLOBAL = (-25e-3, 55e-3, 43.3e-3)
"""m: point A on the sphere of 100 mm."""
RADIUS = EGG_BASE[1] + math.hypot(EGG_GLOBAL[0], EGG_GLOBAL[2])
"""m: from the axis to each finger's root, from the egg's coordinates."""


def frame(yaw: float, roll: float, place: np.ndarray) -> np.ndarray:
    """(4, 4): a base's frame in the global one, R_z(yaw) R_x(roll) at `place` (3,) m; angles in rad."""
    cy, sy, cr, sr = math.cos(yaw), math.sin(yaw), math.cos(roll), math.sin(roll)
    T = np.eye(4)
    T[:3, :3] = [[cy, -sy * cr, sy * sr], [sy, cy * cr, -cy * sr], [0.0, sr, cr]]
    T[:3, 3] = place
    return T


@dataclass(frozen=True, eq=False)
class Gripper:
    """Equal fingers and where their roots are.

    finger : the model of each;  bases : (m, 4, 4), their frames in the global one
    """

    finger: Finger
    bases: np.ndarray

    def to_base(self, point: np.ndarray, which: int) -> np.ndarray:
        """(3,) m, a global point in the frame of finger `which`, from 1."""
        T = self._base(which)
        return np.asarray(T[:3, :3].T @ (np.asarray(point, float) - T[:3, 3]))

    def to_global(self, point: np.ndarray, which: int) -> np.ndarray:
        """(..., 3) m, points of finger `which`'s frame in the global one."""
        T = self._base(which)
        return np.asarray(np.asarray(point, float) @ T[:3, :3].T + T[:3, 3])

    def joints(self, pressure: np.ndarray) -> np.ndarray:
        """(m, n + 1, 4, 4): every joint of every finger, global (35), at (chambers,) Pa in all."""
        modules = self.finger.module_angles(np.atleast_2d(np.asarray(pressure, float)))
        local = joints(*self.finger.chain(modules))[0]
        return np.asarray(self.bases[:, None] @ local[None])

    def reach(self, point: np.ndarray, which: int, place: float | None = None, offset: float = 0.0) -> Reach:
        """`curvature_inverse.inverse` for a global point; the Reach's own point is in the finger's frame."""
        return inverse(self.finger, self.to_base(point, which), place, offset=offset)

    def _base(self, which: int) -> np.ndarray:
        if not 1 <= which <= len(self.bases):
            raise InputError(f"given finger {which}: the gripper has fingers 1 to {len(self.bases)}")
        return np.asarray(self.bases[which - 1])


def gripper(finger: Finger, radius: float = RADIUS) -> Gripper:
    """The paper's three fingers, roots `radius` (m) from the axis."""
    if not 0.0 < radius < 10.0:
        raise InputError(f"given radius {radius:g} m: it must be above zero and below 10 m")
    bases = []
    for roll in (0.0, -2.0 * math.pi / 3.0, 2.0 * math.pi / 3.0):
        around = -roll  # +x is 0, towards +z positive
        place = radius * np.array([math.cos(around), 0.0, math.sin(around)])
        bases.append(frame(0.5 * math.pi, roll, place))
    return Gripper(finger, np.array(bases))
