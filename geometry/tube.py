"""Tube: a round bar with a closed round bore; the plainest actuator, which stretches and swells."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from geometry.errors import millimetres, refusal
from geometry.parameters import count, length
from geometry.shape import Shape

if TYPE_CHECKING:
    from geometry.cad import Parts


@dataclass(frozen=True)
class Tube(Shape):
    """Sizes of a tube along +x from the base at x = 0, m. All chosen.

    A half has the surface `symmetry` at y = 0 (body where y is positive), a quarter `symmetry y`
    at y = 0 and `symmetry z` at z = 0.
    """

    name: ClassVar[str] = "tube"
    title: ClassVar[str] = "round tube with closed ends: a quarter, a half or whole"
    source: ClassVar[str] = "test body, sizes chosen"
    default_size: ClassVar[float] = 3e-3

    inner_radius: float = length(5e-3, "radius of the bore (chosen)", low=1e-4)
    outer_radius: float = length(8e-3, "radius of the outside (chosen)", low=1e-4)
    tube_length: float = length(60e-3, "length from base to tip, both ends counted (chosen)", low=1e-3)
    end_wall: float = length(4e-3, "thickness of each closed end (chosen)")
    share: int = count(2, "1: whole; 2: half; 4: quarter", low=1, high=4)

    @property
    def extent(self) -> float:
        return max(self.tube_length, self.outer_radius)

    def surface_names(self) -> tuple[str, ...]:
        planes = {1: (), 2: ("symmetry",), 4: ("symmetry y", "symmetry z")}[self.share]
        return ("base", "tip", "cavity main", *planes, "outer")

    def _relations(self) -> None:
        if self.share not in (1, 2, 4):
            raise refusal(f"tube: share = {self.share}", "1, 2 or 4")
        wall = self.outer_radius - self.inner_radius
        if wall < 0.02 * self.outer_radius:
            raise refusal(
                f"tube: inner_radius = {millimetres(self.inner_radius)}, "
                f"outer_radius = {millimetres(self.outer_radius)}",
                "a wall of at least a fiftieth of the outer radius",
                "radii swapped" if wall < 0 else "",
            )
        if self.tube_length - 2 * self.end_wall < 1e-4:
            raise refusal(
                f"tube: end_wall = {millimetres(self.end_wall)}",
                f"less than half of tube_length = {millimetres(self.tube_length)}",
                "no room is left for air between the ends",
            )

    def _draw(self, gmsh: Any) -> Parts:
        from geometry.cad import Parts, Plane
        from geometry.session import MM

        length, wall = self.tube_length / MM, self.end_wall / MM
        sweep = 2 * math.pi / self.share
        solids = []
        for start, long, radius in (
            (0.0, length, self.outer_radius),
            (wall, length - 2 * wall, self.inner_radius),
        ):
            bar = gmsh.model.occ.addCylinder(start, 0, 0, long, 0, 0, radius / MM, angle=sweep)
            # OpenCASCADE's half lies at y < 0, its quarter at y < 0 < z
            turn = {1: 0.0, 2: math.pi, 4: -math.pi / 2}[self.share]
            gmsh.model.occ.rotate([(3, bar)], 0, 0, 0, 1, 0, 0, turn)
            solids.append(bar)
        planes = {"base": [Plane(0, 0.0)], "tip": [Plane(0, length)]}
        axes = {"symmetry": 1, "symmetry y": 1, "symmetry z": 2}
        planes |= {n: [Plane(axes[n], 0.0)] for n in self.surface_names() if n in axes}
        return Parts({"body": solids[:1]}, {"main": solids[1:]}, {}, planes)
