"""Ball: a hollow sphere, thick or thin; the balloon of the limit-point study."""

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
class Ball(Shape):
    """Sizes of a hollow sphere about the origin, m. All chosen.

    An eighth has the surfaces `symmetry x`, `symmetry y`, `symmetry z` (the planes x = 0, y = 0,
    z = 0; the body where all three are positive), a quarter `symmetry x` and `symmetry y`, a half
    `symmetry`, at y = 0. A ball has no base: symmetry holds the eighth, and of the others
    what is left over must be held by the caller.
    """

    name: ClassVar[str] = "ball"
    title: ClassVar[str] = "hollow sphere: an eighth, a quarter, a half or whole"
    source: ClassVar[str] = "test body, sizes chosen"
    default_size: ClassVar[float] = 4e-3

    inner_radius: float = length(10e-3, "radius of the void (chosen)", low=1e-4)
    outer_radius: float = length(20e-3, "radius of the outside (chosen)", low=1e-4)
    share: int = count(8, "1: whole; 2: half; 4: quarter; 8: an eighth", low=1, high=8)

    @property
    def extent(self) -> float:
        return self.outer_radius * (1 if self.share == 8 else 2)

    def surface_names(self) -> tuple[str, ...]:
        planes = {
            1: (),
            2: ("symmetry",),
            4: ("symmetry x", "symmetry y"),
            8: ("symmetry x", "symmetry y", "symmetry z"),
        }
        return ("cavity main", *planes[self.share], "outer")

    def air_volume(self) -> float:
        """Volume of the void in the model, m^3."""
        return 4 / 3 * math.pi * self.inner_radius**3 / self.share

    def solid_volume(self) -> float:
        """Volume of the body in the model, m^3."""
        return 4 / 3 * math.pi * (self.outer_radius**3 - self.inner_radius**3) / self.share

    def _relations(self) -> None:
        if self.share not in (1, 2, 4, 8):
            raise refusal(f"ball: share = {self.share}", "1, 2, 4 or 8")
        wall = self.outer_radius - self.inner_radius
        if wall < 0.01 * self.outer_radius:
            raise refusal(
                f"ball: inner_radius = {millimetres(self.inner_radius)}, "
                f"outer_radius = {millimetres(self.outer_radius)}",
                "a wall of at least a hundredth of the outer radius",
                "radii swapped" if wall < 0 else "",
            )

    def _draw(self, gmsh: Any) -> Parts:
        from geometry.cad import Parts, Plane
        from geometry.session import MM

        occ = gmsh.model.occ
        # polar angles from, polar angle to, sweep: the piece then lies where x, y (and z) are positive
        low, sweep = {
            1: (-math.pi / 2, 2 * math.pi),
            2: (-math.pi / 2, math.pi),
            4: (-math.pi / 2, math.pi / 2),
            8: (0.0, math.pi / 2),
        }[self.share]
        outer, inner = (
            occ.addSphere(0, 0, 0, radius / MM, angle1=low, angle2=math.pi / 2, angle3=sweep)
            for radius in (self.outer_radius, self.inner_radius)
        )
        axes = {"symmetry": 1, "symmetry x": 0, "symmetry y": 1, "symmetry z": 2}
        planes = {n: [Plane(axes[n], 0.0)] for n in self.surface_names() if n in axes}
        return Parts({"body": [outer]}, {"main": [inner]}, {}, planes)
