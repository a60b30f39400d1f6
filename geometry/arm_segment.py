"""Arm segment: three round tubes at 120 deg held by rings between two plates, like the AM I-Support's.

The drawing is that of the arm paper's frame: base at the origin, axis down along -z, tip face at
z = -length; chamber 1 on +y, 2 at (+x, -y), 3 at (-x, -y). Tubes are plain annuli, as the paper's
model has them (the printed chambers are elliptical). They are closed by the plates.

Printed: radius 30, distance of the chambers from the axis 20, r_o 7.79, r_i 6.39, chambers 180, bottom
terminal 5, modelled length 190 mm. Chosen: number, thickness and bore of the rings.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from geometry.errors import millimetres, refusal
from geometry.parameters import count, flag, length
from geometry.shape import Shape

if TYPE_CHECKING:
    from geometry.cad import Parts

_THIRD = 2 * math.pi / 3
DIRECTIONS = {"1": math.pi / 2, "2": math.pi / 2 - _THIRD, "3": math.pi / 2 + _THIRD}
"""Direction of every chamber in the x-y plane, rad from +x."""


@dataclass(frozen=True)
class ArmSegment(Shape):
    """Sizes of an arm segment, m. The half (x >= 0) has half of chamber 1 and chamber 2.

    In the half, chamber 3 is the mirror image of 2: it serves loads with equal pressures in both.
    """

    name: ClassVar[str] = "arm-segment"
    title: ClassVar[str] = "three tubes at 120 deg held by rings: cavities 1, 2, 3"
    source: ClassVar[str] = "AM I-Support arm paper, section II and Table 1; rings chosen"
    default_size: ClassVar[float] = 6e-3

    radius: float = length(30e-3, "radius of plates and rings")
    chamber_offset: float = length(20e-3, "distance of the chambers' axes from the arm's", symbol="delta")
    chamber_outer_radius: float = length(7.79e-3, "outer radius of a chamber", symbol="r_o")
    chamber_inner_radius: float = length(6.39e-3, "inner radius of a chamber", symbol="r_i")
    chamber_length: float = length(180e-3, "length of the air in a chamber")
    base_plate: float = length(5e-3, "plate at the base: lower part of the top terminal")
    tip_plate: float = length(5e-3, "plate at the tip: the bottom terminal")
    rings: int = count(8, "rings that hold the chambers together (chosen)", high=60)
    ring_thickness: float = length(2e-3, "thickness of a ring (chosen)")
    ring_bore: float = length(10e-3, "radius of the hole in a ring (chosen)")
    half: bool = flag(False, "half model, x >= 0, with the surface `symmetry` at x = 0; false: whole")

    @property
    def total_length(self) -> float:
        """Length from base to tip, m."""
        return self.base_plate + self.chamber_length + self.tip_plate

    @property
    def extent(self) -> float:
        return max(self.total_length, 2 * self.radius)

    def surface_names(self) -> tuple[str, ...]:
        names = ("1", "2") if self.half else ("1", "2", "3")
        cavities = tuple(f"cavity {name}" for name in names)
        return ("base", "tip", *cavities, *(("symmetry",) if self.half else ()), "outer")

    def _relations(self) -> None:
        r_o, r_i, offset = self.chamber_outer_radius, self.chamber_inner_radius, self.chamber_offset
        if r_o - r_i < 0.02 * r_o:
            raise refusal(
                f"arm-segment: chamber_inner_radius = {millimetres(r_i)}, outer = {millimetres(r_o)}",
                "a wall of at least a fiftieth of the outer radius",
                "radii swapped" if r_o < r_i else "",
            )
        if offset * math.sqrt(3) < 2.02 * r_o:
            raise refusal(
                f"arm-segment: chamber_offset = {millimetres(offset)}",
                f"at least {millimetres(2.02 * r_o / math.sqrt(3))}, so that the chambers do not meet",
                "chambers too near to each other",
            )
        if offset + r_o > self.radius - 2e-4:
            raise refusal(
                f"arm-segment: radius = {millimetres(self.radius)}",
                f"more than chamber_offset + chamber_outer_radius = {millimetres(offset + r_o)}",
                "chambers would stick out of the rings",
            )
        if self.rings and self.ring_bore > offset - r_o - 2e-4:
            raise refusal(
                f"arm-segment: ring_bore = {millimetres(self.ring_bore)}",
                f"at most {millimetres(offset - r_o - 2e-4)}, so that rings go round the chambers",
                "the bore would cut the chambers",
            )
        if self.rings * self.ring_thickness > 0.9 * self.chamber_length:
            raise refusal(
                f"arm-segment: {self.rings} rings of {millimetres(self.ring_thickness)}",
                f"together less than nine tenths of chamber_length = {millimetres(self.chamber_length)}",
                "no free tube is left between the rings",
            )

    def _draw(self, gmsh: Any) -> Parts:
        from geometry.cad import Parts, Plane, fuse
        from geometry.session import MM
        from geometry.tripod_cad import ring_sector

        occ = gmsh.model.occ
        bottom = -self.base_plate - self.chamber_length
        turn, start = (math.pi, -math.pi / 2) if self.half else (2 * math.pi, 0.0)

        def bar(radius: float, low: float, high: float, at: tuple[float, float], wide: float) -> int:
            tag = int(
                occ.addCylinder(
                    *(c / MM for c in at), low / MM, 0, 0, (high - low) / MM, radius / MM, angle=wide
                )
            )
            if wide < 2 * math.pi:
                occ.rotate([(3, tag)], *(c / MM for c in at), 0, 0, 0, 1, -math.pi / 2)
            return tag

        solids = [
            bar(self.radius, -self.base_plate, 0.0, (0.0, 0.0), turn),
            bar(self.radius, -self.total_length, bottom, (0.0, 0.0), turn),
        ]
        step = self.chamber_length / (self.rings + 1)
        for k in range(self.rings):
            middle = -self.base_plate - (k + 1) * step
            z = (middle - self.ring_thickness / 2, middle + self.ring_thickness / 2)
            solids.append(ring_sector(gmsh, (self.ring_bore, self.radius), z, start, turn))
        cavities: dict[str, list[int]] = {}
        for name, direction in DIRECTIONS.items():
            if self.half and name == "3":
                continue
            at = (self.chamber_offset * math.cos(direction), self.chamber_offset * math.sin(direction))
            wide = math.pi if self.half and name == "1" else 2 * math.pi
            at = (0.0, at[1]) if name == "1" else at
            # the tube reaches into the plates, so that it and they are one solid
            solids.append(bar(self.chamber_outer_radius, bottom, -self.base_plate, at, wide))
            cavities[name] = [bar(self.chamber_inner_radius, bottom, -self.base_plate, at, wide)]
        planes = {"base": [Plane(2, 0.0)], "tip": [Plane(2, -self.total_length / MM)]}
        if self.half:
            planes["symmetry"] = [Plane(0, 0.0)]
        return Parts({"body": fuse(gmsh, solids)}, cavities, {}, planes)
