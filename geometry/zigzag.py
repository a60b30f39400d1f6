"""Zig-zag actuator: a flat tube folded to and fro, with or without a limiting layer on one side.

The drawing: base at x = 0, actuator along +x, width along y about y = 0, height along z; the flat
joints lie by turns at z = 0 (even ones) and z = H (odd ones). The chambers between them are straight
pieces of one tube, slanted by half the fold angle to either side of z: the paper says that
consecutive chambers join "at an angle of 45 deg". From the middle of the first and the last joint on the
tube goes straight, as high as the joint, and ends solid (where the paper presses PLA connectors in): so the
outer joints can open about half as far as the others, and without a layer the whole extends about straight.
The limiting layer, of the same rubber and part of the volume `body`, lies under the joints at z = 0.

No air inlet is drawn: it goes through the end at x = 0, which is solid and held, and a pressure on the whole
wall of a closed cavity is the load that the inlet brings. A hole there would change nothing that moves.

Printed: length 134, width 16, height 13, chamber wall 0.6, fold angle 45 deg, layer 0.5 to 2 mm, 13 g.
Not printed, chosen: 22 chambers, 5.5 mm wide along x, and ends of 4 + 3.77 mm, which make the printed
length. T2 and T6 are in a figure that is not at hand: write them as a pattern.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from geometry.errors import millimetres, refusal
from geometry.parameters import angle, count, flag, length, pattern
from geometry.shape import Shape

if TYPE_CHECKING:
    from geometry.cad import Parts

_DEG = math.pi / 180


@dataclass(frozen=True)
class Zigzag(Shape):
    """Sizes of a zig-zag actuator, m and rad."""

    name: ClassVar[str] = "zigzag"
    title: ClassVar[str] = (
        "zig-zag actuator: linear (no layer) or bending (limiting layer, whole or in pieces)"
    )
    source: ClassVar[str] = "multimodal zig-zag actuator paper, Table I; number and width of chambers chosen"
    default_size: ClassVar[float] = 3e-3

    chambers: int = count(22, "slanted chambers, one more joint than that (chosen)", low=1)
    width: float = length(16e-3, "outer width", symbol="W")
    height: float = length(13e-3, "outer height without the limiting layer", symbol="H")
    wall: float = length(0.6e-3, "wall of the chambers", symbol="t")
    fold_angle: float = angle(45 * _DEG, "angle between consecutive chambers", 10 * _DEG, 90 * _DEG)
    chamber_width: float = length(5.5e-3, "outer width of a chamber along x (chosen)")
    end_chamber: float = length(4e-3, "straight tube from the middle of the outer joints (chosen)")
    end_wall: float = length(3.77e-3, "solid ends behind it (chosen: makes L = 134 mm)")
    layer: float = length(0.0, "thickness of the limiting layer; 0: none (linear)", low=0.0, symbol="s")
    layer_pattern: str = pattern(
        "1",
        "pieces of the layer along the length, equally long: 1 there, 0 left out; '1' is T1",
        letters="01",
    )
    half: bool = flag(True, "half model, y >= 0, with the surface `symmetry` at y = 0; false: whole")

    @property
    def linear(self) -> bool:
        return self.layer == 0.0

    @property
    def pitch(self) -> float:
        """Distance along x from one joint to the next, m."""
        return self.height * math.tan(self.fold_angle / 2)

    @property
    def total_length(self) -> float:
        """Length from base to tip, m."""
        return 2 * (self.end_wall + self.end_chamber) + self.chambers * self.pitch

    @property
    def extent(self) -> float:
        return max(self.total_length, self.width, self.height)

    def surface_names(self) -> tuple[str, ...]:
        return ("base", "tip", "cavity main", *(("symmetry",) if self.half else ()), "outer")

    def outline(self, inset: float) -> list[tuple[float, float]]:
        """Corners (x, z) in m of the zig-zag, walls moved inwards by `inset`; 0: the outside with its ends.

        Source: the construction in this module's docstring; even joints first, then odd ones backwards.
        """
        p, h, b, n = self.pitch, self.height, self.chamber_width, self.chambers
        side = inset / math.cos(self.fold_angle / 2)
        lean = inset * p / h
        depth = h * (b - 2 * side) / (2 * p)
        first_joint = self.end_wall + self.end_chamber
        air = (self.end_wall, self.total_length - self.end_wall)
        ends = (0.0, self.total_length) if inset == 0 else air

        def run(first: int) -> list[tuple[float, float]]:
            """One side from left to right: flats of the joints, and the notches between them."""
            z, notch = (inset, h - depth) if first == 0 else (h - inset, depth)
            points: list[tuple[float, float]] = []
            if first == 1:
                points = [(ends[0], notch), (first_joint, notch)]
            for k in range(first, n + 1, 2):
                middle = first_joint + k * p
                points.append((ends[0], z) if k == 0 else (middle - b / 2 + side - lean, z))
                points.append((ends[1], z) if k == n else (middle + b / 2 - side + lean, z))
                if k < n:
                    points.append((middle + p, notch))
            if (n - first) % 2:
                points.append((ends[1], notch))
            return points

        return run(0) + run(1)[::-1]

    def pieces(self) -> list[tuple[float, float]]:
        """Where the limiting layer lies, (x from, x to) in m; neighbouring pieces are one."""
        if not self.layer:
            return []
        step = self.total_length / len(self.layer_pattern)
        out: list[tuple[float, float]] = []
        for k, letter in enumerate(self.layer_pattern):
            if letter == "1":
                start = out.pop()[0] if out and abs(out[-1][1] - k * step) < 1e-9 else k * step
                out.append((start, (k + 1) * step))
        return out

    def _relations(self) -> None:
        side = self.wall / math.cos(self.fold_angle / 2)
        if self.layer and "1" not in self.layer_pattern:
            raise refusal(
                f"zigzag: layer_pattern = {self.layer_pattern!r}", "at least one '1'", "", "layer = 0 mm"
            )
        if 0 < self.layer < 2e-5:
            raise refusal(f"zigzag: layer = {millimetres(self.layer)}", "0 (none) or at least 0.02 mm")
        if len(self.layer_pattern) > 200:
            raise refusal(f"zigzag: layer_pattern of {len(self.layer_pattern)} pieces", "at most 200")
        if self.width - 2 * self.wall < 1e-4:
            raise refusal(
                f"zigzag: wall = {millimetres(self.wall)}",
                f"less than half of width = {millimetres(self.width)}",
            )
        gap = 2 * self.pitch - self.chamber_width
        if gap < 0.02 * self.pitch:
            raise refusal(
                f"zigzag: chamber_width = {millimetres(self.chamber_width)}",
                f"less than twice the pitch, {millimetres(2 * self.pitch)}",
                "the folds would be closed to a block",
                "a larger fold_angle, a higher actuator or narrower chambers",
            )
        inner = self.chamber_width - 2 * side
        least = 4 * self.wall * self.pitch / self.height
        if inner < max(least, 1e-4):
            raise refusal(
                f"zigzag: wall = {millimetres(self.wall)}",
                f"thin enough to leave {millimetres(max(least, 1e-4))} of air in chamber_width = "
                f"{millimetres(self.chamber_width)}; it leaves {millimetres(inner)}",
                "the air would be cut off at the joints",
                "a thinner wall or wider chambers",
            )
        if inner > 2 * self.pitch * (1 - 2 * self.wall / self.height) * 0.98:
            raise refusal(
                f"zigzag: wall = {millimetres(self.wall)}",
                "thick enough to part the chambers from the folds",
                "chambers nearly twice as wide as the pitch",
                "narrower chambers",
            )

    def _draw(self, gmsh: Any) -> Parts:
        from geometry.cad import Parts, Plane, box, extrude, fuse, polygon
        from geometry.session import MM

        def prism(inset: float, half_width: float) -> int:
            low = 0.0 if self.half else -half_width
            face = polygon(gmsh, [(x / MM, low / MM, z / MM) for x, z in self.outline(inset)])
            return extrude(gmsh, face, (0, (half_width - low) / MM, 0))

        right = self.width / 2 / MM
        left = 0.0 if self.half else -right
        solids = [prism(0.0, self.width / 2)]
        solids += [
            box(gmsh, (start / MM, left, -self.layer / MM), (end / MM, right, 0.0))
            for start, end in self.pieces()
        ]
        air = prism(self.wall, self.width / 2 - self.wall)
        planes = {"base": [Plane(0, 0.0)], "tip": [Plane(0, self.total_length / MM)]}
        if self.half:
            planes["symmetry"] = [Plane(1, 0.0)]
        return Parts({"body": fuse(gmsh, solids)}, {"main": [air]}, {}, planes)
