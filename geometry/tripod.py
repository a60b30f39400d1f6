"""Tripod: three PneuNet channels at 120 deg round an inner support, after a printed 3-DoF actuator.

The drawing: base at the origin, axis down along -z, tip face at z = -length. Channel 1 lies on +y,
2 at (+x, -y), 3 at (-x, -y). Every channel is a row of chambers, sectors of a ring with gaps between
them along z and slots between the channels, that open inwards into a duct; the three ducts lie in the
inner support, a round bar. The ducts are closed at both ends: the pipes that let the air in are left out.

Printed: the length of 135 mm, three channels at 120 deg, chambers that touch when inflated. All other
sizes are in a figure that is not at hand: they are chosen, and open to change.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

from geometry.errors import millimetres, refusal
from geometry.parameters import angle, count, flag, length
from geometry.shape import Shape

if TYPE_CHECKING:
    from geometry.cad import Parts

_DEG = math.pi / 180
CHANNELS = {"1": 90 * _DEG, "2": -30 * _DEG, "3": 210 * _DEG}
"""Direction of every channel in the x-y plane, rad from +x."""


@dataclass(frozen=True)
class Tripod(Shape):
    """Sizes of a tripod, m and rad. The half (x >= 0) has half of channel 1 and channel 2.

    In the half, channel 3 is the mirror image of 2: it serves loads with equal pressures in both.
    """

    name: ClassVar[str] = "tripod"
    title: ClassVar[str] = "three PneuNet channels at 120 deg round an inner support: cavities 1, 2, 3"
    source: ClassVar[str] = "printed 3-DoF actuator paper (length); other sizes chosen"
    default_size: ClassVar[float] = 4e-3

    chambers: int = count(13, "chambers of every channel (chosen)", low=1, high=40)
    chamber_length: float = length(8e-3, "outer length of a chamber along the axis (chosen)")
    gap: float = length(1.75e-3, "gap between two chambers (chosen)")
    base_plate: float = length(6e-3, "solid plate at the base (chosen)")
    tip_plate: float = length(4e-3, "solid plate at the tip (chosen)")
    outer_radius: float = length(20e-3, "outer radius of the chambers and plates (chosen)")
    support_radius: float = length(10e-3, "radius of the inner support (chosen)")
    duct_inner_radius: float = length(4e-3, "inner radius of the ducts in the support (chosen)")
    duct_outer_radius: float = length(8e-3, "outer radius of the ducts (chosen)")
    duct_angle: float = angle(60 * _DEG, "angle that a duct spans (chosen)", 5 * _DEG, 115 * _DEG)
    slot_angle: float = angle(
        12 * _DEG, "angle of the slot between two channels (chosen)", 1 * _DEG, 60 * _DEG
    )
    lateral_wall: float = length(1.2e-3, "wall of a chamber towards the next one along the axis (chosen)")
    outer_wall: float = length(1.6e-3, "outer wall of a chamber (chosen)")
    side_wall_angle: float = angle(
        8 * _DEG, "angle that each side wall of a chamber spans (chosen)", _DEG, 40 * _DEG
    )
    half: bool = flag(False, "half model, x >= 0, with the surface `symmetry` at x = 0; false: whole")

    @property
    def total_length(self) -> float:
        """Length from base to tip, m."""
        chambers = self.chambers * self.chamber_length + (self.chambers - 1) * self.gap
        return self.base_plate + chambers + self.tip_plate

    @property
    def extent(self) -> float:
        return max(self.total_length, 2 * self.outer_radius)

    @property
    def channel_angle(self) -> float:
        """Angle that a channel's chambers span outside, rad."""
        return 120 * _DEG - self.slot_angle

    @property
    def air_angle(self) -> float:
        """Angle that a chamber's air spans, rad."""
        return self.channel_angle - 2 * self.side_wall_angle

    def surface_names(self) -> tuple[str, ...]:
        names = ("1", "2") if self.half else ("1", "2", "3")
        cavities = tuple(f"cavity {name}" for name in names)
        return ("base", "tip", *cavities, *(("symmetry",) if self.half else ()), "outer")

    def _relations(self) -> None:
        radii = ("duct_inner_radius", "duct_outer_radius", "support_radius", "outer_radius")
        for inner, outer in pairwise(radii):
            if getattr(self, outer) - getattr(self, inner) < 2e-4:
                raise refusal(
                    f"tripod: {inner} = {millimetres(getattr(self, inner))}",
                    f"at least 0.2 mm less than {outer} = {millimetres(getattr(self, outer))}",
                )
        if self.outer_radius - self.outer_wall - self.support_radius < 1e-4:
            raise refusal(
                f"tripod: outer_wall = {millimetres(self.outer_wall)}",
                f"less than {millimetres(self.outer_radius - self.support_radius)}, the room outside it",
                "no room is left for air outside the support",
            )
        if self.chamber_length - 2 * self.lateral_wall < 1e-4:
            raise refusal(
                f"tripod: lateral_wall = {millimetres(self.lateral_wall)}",
                f"less than half of chamber_length = {millimetres(self.chamber_length)}",
                "no room is left for air between the walls",
            )
        if self.air_angle < 5 * _DEG:
            raise refusal(
                f"tripod: side_wall_angle = {math.degrees(self.side_wall_angle):.4g} deg, slot_angle = "
                f"{math.degrees(self.slot_angle):.4g} deg",
                "together less than 115 deg (a slot and two walls), so that air is left",
            )
        if self.duct_angle > self.air_angle:
            raise refusal(
                f"tripod: duct_angle = {math.degrees(self.duct_angle):.4g} deg",
                f"at most the chambers' air, {math.degrees(self.air_angle):.4g} deg",
                "a duct wider than the chamber",
            )

    def _draw(self, gmsh: Any) -> Parts:
        from geometry.tripod_cad import draw

        return draw(gmsh, self)
