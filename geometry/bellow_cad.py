"""The drawing of a bellow in gmsh's OpenCASCADE kernel (mm): profiles turned about z."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from geometry.cad import Parts, Plane, box
from geometry.session import MM

if TYPE_CHECKING:
    from geometry.bellow import Bellow


def _profile(gmsh: Any, s: Bellow, offset: float, bottom: float, top: float) -> int:
    """Half section in the plane y = 0: everything within the wall's middle moved outwards by `offset`, m."""
    occ = gmsh.model.occ

    def point(r: float, z: float) -> int:
        return int(occ.addPoint(r / MM, 0, z / MM))

    first = point(0, bottom)
    outline = [first, point(s.peak + offset, bottom)]
    outline.append(point(s.peak + offset, s.collar_height))
    curves = [occ.addLine(outline[0], outline[1]), occ.addLine(outline[1], outline[2])]
    last = outline[2]
    middle = (s.peak + s.valley) / 2
    for k in range(s.convolutions):
        low, sign = s.collar_height + k * s.flank, 1 if k % 2 == 0 else -1
        start, end = (s.peak, s.valley) if sign == 1 else (s.valley, s.peak)
        # arc about a centre on the inner side of the peak, then one on the outer side of the valley
        for half, radius, z in ((0, start, low), (1, end, low + s.flank)):
            inner = (sign == 1) == (half == 0)
            centre = point(radius + (-s.arc_radius if inner else s.arc_radius), z)
            if half == 0:
                normal = (math.sin(s.turn), math.cos(s.turn))
                target = point(middle + offset * normal[1], low + s.flank / 2 + sign * offset * normal[0])
            else:
                target = point(end + offset, z)
            curves.append(occ.addCircleArc(last, centre, target))
            occ.remove([(0, centre)])
            last = target
    neck = point(s.neck_radius + offset, top)
    crown = point(0, top)
    curves += [occ.addLine(last, neck), occ.addLine(neck, crown), occ.addLine(crown, first)]
    return int(occ.addPlaneSurface([occ.addCurveLoop(curves)]))


def _turned(gmsh: Any, face: int, share: int) -> int:
    made = gmsh.model.occ.revolve([(2, face)], 0, 0, 0, 0, 0, 1, 2 * math.pi / share)
    return next(int(tag) for dim, tag in made if dim == 3)


def draw(gmsh: Any, s: Bellow) -> Parts:
    """Bellow, soft layer, void and planes."""
    occ = gmsh.model.occ
    height, total = s.bellow_height / MM, s.total_height / MM
    body = _turned(gmsh, _profile(gmsh, s, s.wall / 2, 0.0, s.bellow_height), s.share)
    air = _turned(gmsh, _profile(gmsh, s, -s.wall / 2, s.floor, s.bellow_height - s.top), s.share)
    volumes = {"body": [body]}
    reach = (s.neck_radius + s.wall / 2) / MM
    planes = {"base": [Plane(2, 0.0)]}
    if s.soft_layer:
        side = s.layer_width / 2 / MM
        low = {1: (-side, -side), 2: (-side, 0.0), 4: (0.0, 0.0)}[s.share]
        # the disc above the bellow is a solid of its own, so that its top is a face of its own: the tip
        disc = occ.addCylinder(0, 0, height, 0, 0, total - height, reach, angle=2 * math.pi / s.share)
        volumes["soft layer"] = [disc, box(gmsh, (*low, height), (side, side, total))]
        planes["tip"] = [Plane(2, total, reach=reach)]
        planes["frame"] = [Plane(axis, at) for axis in (0, 1) for at in (-side, side)]
    else:
        planes["tip"] = [Plane(2, total)]
    axes = {"symmetry": 1, "symmetry x": 0, "symmetry y": 1}
    planes |= {n: [Plane(axes[n], 0.0)] for n in s.surface_names() if n in axes}
    return Parts(volumes, {"main": [air]}, {}, planes)
