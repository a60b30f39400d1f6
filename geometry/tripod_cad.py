"""The drawing of a tripod in gmsh's OpenCASCADE kernel (mm)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from geometry.cad import Parts, Plane, fuse, polygon
from geometry.session import MM
from geometry.tripod import CHANNELS

if TYPE_CHECKING:
    from geometry.tripod import Tripod


def ring_sector(gmsh: Any, r: tuple[float, float], z: tuple[float, float], start: float, sweep: float) -> int:
    """The solid between two radii and two heights (m) over an angle from `start`, about z; rad."""
    c, s = math.cos(start), math.sin(start)
    corners = [(r[i] * c / MM, r[i] * s / MM, z[j] / MM) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
    made = gmsh.model.occ.revolve([(2, polygon(gmsh, corners))], 0, 0, 0, 0, 0, 1, sweep)
    return next(int(tag) for dim, tag in made if dim == 3)


def draw(gmsh: Any, s: Tripod) -> Parts:
    """Support, plates, chambers, voids and planes."""
    occ = gmsh.model.occ
    end = -s.total_length
    turn, start = (math.pi, -math.pi / 2) if s.half else (2 * math.pi, 0.0)

    def disc(radius: float, low: float, high: float) -> int:
        bar = int(occ.addCylinder(0, 0, low / MM, 0, 0, (high - low) / MM, radius / MM, angle=turn))
        occ.rotate([(3, bar)], 0, 0, 0, 0, 0, 1, start)
        return bar

    solids = [
        disc(s.support_radius, end, 0.0),
        disc(s.outer_radius, -s.base_plate, 0.0),
        disc(s.outer_radius, end, end + s.tip_plate),
    ]
    cavities: dict[str, list[int]] = {}
    tops = [-s.base_plate - k * (s.chamber_length + s.gap) for k in range(s.chambers)]
    for name, direction in CHANNELS.items():
        if s.half and name == "3":
            continue
        # a sector cut by the plane x = 0 keeps the part where x > 0: it ends at the channel's own direction
        part = 0.5 if s.half and name == "1" else 1.0

        def sector(
            r: tuple[float, float],
            z: tuple[float, float],
            wide: float,
            to: float = direction,
            part: float = part,
        ) -> int:
            return ring_sector(gmsh, r, z, to - wide / 2, wide * part)

        for top in tops:
            z = (top - s.chamber_length, top)
            # sunk into the support, so that no sliver is left between a plane sector and the round bar
            solids.append(sector((s.duct_outer_radius, s.outer_radius), z, s.channel_angle))
        first, last = tops[0] - s.lateral_wall, tops[-1] - s.chamber_length + s.lateral_wall
        air = [sector((s.duct_inner_radius, s.duct_outer_radius), (last, first), s.duct_angle)]
        for top in tops:
            z = (top - s.chamber_length + s.lateral_wall, top - s.lateral_wall)
            air.append(sector((s.duct_outer_radius, s.outer_radius - s.outer_wall), z, s.air_angle))
        cavities[name] = fuse(gmsh, air)
    planes = {"base": [Plane(2, 0.0)], "tip": [Plane(2, end / MM)]}
    if s.half:
        planes["symmetry"] = [Plane(0, 0.0)]
    return Parts({"body": fuse(gmsh, solids)}, cavities, {}, planes)
