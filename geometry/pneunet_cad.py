"""The drawing of a PneuNet finger in gmsh's OpenCASCADE kernel (mm)."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

from geometry.cad import Parts, Plane, box, extrude, fuse
from geometry.session import MM

if TYPE_CHECKING:
    from geometry.pneunet import PneuNet


def arched_prism(
    gmsh: Any, x: tuple[float, float], width: float, bottom: float, crown: float, radius: float, half: bool
) -> int:
    """A block from x[0] to x[1] with straight sides and a top that is a circular arc, all in mm.

    width : full width; bottom, crown : z of the floor and of the arc's highest line; radius >= width/2.
    """
    occ = gmsh.model.occ
    side = width / 2
    centre_z = crown - radius
    rise = centre_z + math.sqrt(max(0.0, radius**2 - side**2))
    centre = occ.addPoint(x[0], 0, centre_z)
    top = occ.addPoint(x[0], 0, crown)
    right_top = occ.addPoint(x[0], side, rise)
    right = occ.addPoint(x[0], side, bottom)
    left = occ.addPoint(x[0], 0 if half else -side, bottom)
    lines = [
        occ.addLine(left, right),
        occ.addLine(right, right_top),
        occ.addCircleArc(right_top, centre, top),
    ]
    if half:
        lines.append(occ.addLine(top, left))
    else:
        left_top = occ.addPoint(x[0], -side, rise)
        lines += [occ.addCircleArc(top, centre, left_top), occ.addLine(left_top, left)]
    face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    occ.remove([(0, centre)])
    return extrude(gmsh, face, (x[1] - x[0], 0, 0))


def draw(gmsh: Any, shape: PneuNet) -> Parts:
    """Body, voids, paper plane and end planes of a PneuNet finger."""
    solids: list[int] = []
    cavities: dict[str, list[int]] = {}
    width = 0.0
    if shape.slow_chambers:
        solids.append(_slow_block(gmsh, shape))
        cavities["slow"] = _slow_air(gmsh, shape)
        width = shape.slow_outer_width
    if shape.fast_chambers:
        solids += _fast_blocks(gmsh, shape)
        cavities["fast"] = _fast_air(gmsh, shape)
        width = max(width, shape.fast_outer_width)
    if shape.slow_chambers and shape.fast_chambers:
        joint = min(shape.slow_outer_width, shape.fast_outer_width)
        top = shape.floor + shape.joint_height
        solids.append(_bar(gmsh, (shape.slow_length, shape.fast_start), joint, (0, top), shape.half))
    end = shape.total_length / MM
    left = 0.0 if shape.half else -width / 2 / MM
    paper = gmsh.model.occ.addRectangle(0, left, shape.lower_layer / MM, end, width / 2 / MM - left)
    planes = {"base": [Plane(0, 0.0)], "tip": [Plane(0, end)]}
    if shape.half:
        planes["symmetry"] = [Plane(1, 0.0)]
    return Parts({"body": fuse(gmsh, solids)}, cavities, {"paper": [paper]}, planes)


def _bar(gmsh: Any, x: tuple[float, float], width: float, z: tuple[float, float], half: bool) -> int:
    """A box over x and z, symmetric in y; all in m."""
    left = 0.0 if half else -width / 2
    return box(gmsh, (x[0] / MM, left / MM, z[0] / MM), (x[1] / MM, width / 2 / MM, z[1] / MM))


def _slow_block(gmsh: Any, s: PneuNet) -> int:
    crown = s._slow_profile()[1] / MM
    x = (0.0, s.slow_length / MM)
    return arched_prism(gmsh, x, s.slow_outer_width / MM, 0.0, crown, s.slow_outer_radius / MM, s.half)


def _slow_air(gmsh: Any, s: PneuNet) -> list[int]:
    crown = s._slow_profile()[0] / MM
    clear = s.slow_pitch - s.slow_inner_wall
    starts = [s.slow_end_wall + k * s.slow_pitch for k in range(s.slow_chambers)]
    air = [
        arched_prism(
            gmsh,
            (x / MM, (x + clear) / MM),
            s.slow_inner_width / MM,
            s.floor / MM,
            crown,
            s.slow_inner_radius / MM,
            s.half,
        )
        for x in starts
    ]
    return _with_channel(gmsh, s, air, [x + clear for x in starts[:-1]], starts[1:])


def _fast_blocks(gmsh: Any, s: PneuNet) -> list[int]:
    crown = s._fast_profile()[1] / MM
    pitch = s.fast_chamber_length + s.gap
    starts = [s.fast_start + k * pitch for k in range(s.fast_chambers)]
    blocks = [
        arched_prism(
            gmsh,
            (x / MM, (x + s.fast_chamber_length) / MM),
            s.fast_outer_width / MM,
            0.0,
            crown,
            s.fast_outer_radius / MM,
            s.half,
        )
        for x in starts
    ]
    for left, right in itertools.pairwise(starts):
        gap = (left + s.fast_chamber_length, right)
        blocks.append(_bar(gmsh, gap, s.fast_outer_width, (0, s.floor + s.bridge), s.half))
    return blocks


def _fast_air(gmsh: Any, s: PneuNet) -> list[int]:
    crown = s._fast_profile()[0] / MM
    pitch = s.fast_chamber_length + s.gap
    clear = s.fast_chamber_length - 2 * s.lateral_wall
    starts = [s.fast_start + s.lateral_wall + k * pitch for k in range(s.fast_chambers)]
    air = [
        arched_prism(
            gmsh,
            (x / MM, (x + clear) / MM),
            s.fast_inner_width / MM,
            s.floor / MM,
            crown,
            s.fast_inner_radius / MM,
            s.half,
        )
        for x in starts
    ]
    return _with_channel(gmsh, s, air, [x + clear for x in starts[:-1]], starts[1:])


def _with_channel(gmsh: Any, s: PneuNet, air: list[int], ends: list[float], starts: list[float]) -> list[int]:
    """The chambers' air united with the pieces of channel from each chamber's end to the next start."""
    z = (s.floor, s.floor + s.channel_height)
    pieces = [_bar(gmsh, gap, s.channel_width, z, s.half) for gap in zip(ends, starts, strict=True)]
    return fuse(gmsh, air + pieces)
