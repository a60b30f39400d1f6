"""Bellow-driven actuator: a bellow with a closed top, and the soft square layer that is glued on it.

The drawing: axis z, base at z = 0. From below: a straight collar, the convolutions, a straight neck
with a closed top, and the soft layer (volume `soft layer`) on it. The collar's foot is closed by a
floor: it stands for the stiff plate into which the paper glues the bellow, and its underside is the
clamped `base`. The layer's rim is the surface `frame`, to be held where the paper glues it to its
frame: supports fixed = ["base", "frame"]. `tip` is the part of the top face above the bellow.

A convolution here is one flank (from a valley to a peak or back), made of two arcs that meet
smoothly: eight of them in 15 mm. Were a convolution a whole wave, two walls of 0.8 mm eight times
would fill 12.8 of the 15 mm, and the measured stroke of -7 mm would find no room.

Printed: height 35, deformable 15, bottom 5, wall 0.8, outer diameter 10, inner 5, eight convolutions,
layer 30 x 30 x 1 mm. Chosen: what of the height is neck (the rest), floor and top.
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


@dataclass(frozen=True)
class Bellow(Shape):
    """Sizes of a bellow-driven actuator, m.

    A quarter has the surfaces `symmetry x` (x = 0) and `symmetry y` (y = 0), a half `symmetry` (y = 0).
    """

    name: ClassVar[str] = "bellow"
    title: ClassVar[str] = "bellow with closed top and soft square layer: a quarter, a half or whole"
    source: ClassVar[str] = "Hashem, Stommel, Cheng, Xu, bellow-driven soft pneumatic actuator, section IV"
    default_size: ClassVar[float] = 1.5e-3

    convolutions: int = count(8, "flanks, each from a valley to a peak or back", low=1, symbol="M")
    convoluted_height: float = length(15e-3, "height of all convolutions together")
    outer_diameter: float = length(10e-3, "outer diameter at the peaks")
    inner_diameter: float = length(5e-3, "inner diameter at the valleys")
    wall: float = length(0.8e-3, "wall thickness", symbol="w")
    collar_height: float = length(5e-3, "straight part below the convolutions, floor counted")
    neck_height: float = length(15e-3, "straight part above them, top counted (chosen: makes 35 mm in all)")
    floor: float = length(1e-3, "floor that closes the foot (chosen)")
    top: float = length(0.8e-3, "wall that closes the top (chosen: as the wall)")
    soft_layer: bool = flag(True, "with the soft layer on the top; false: the bellow alone")
    layer_width: float = length(30e-3, "side of the square soft layer")
    layer_thickness: float = length(1e-3, "thickness of the soft layer")
    share: int = count(4, "1: whole; 2: half; 4: quarter", low=1, high=4)

    @property
    def linear(self) -> bool:
        return True

    @property
    def bellow_height(self) -> float:
        """Height of the bellow without the soft layer, m."""
        return self.collar_height + self.convoluted_height + self.neck_height

    @property
    def total_height(self) -> float:
        """Height with the soft layer, m."""
        return self.bellow_height + (self.layer_thickness if self.soft_layer else 0.0)

    @property
    def valley(self) -> float:
        """Radius of the middle of the wall at a valley, m."""
        return (self.inner_diameter + self.wall) / 2

    @property
    def peak(self) -> float:
        """Radius of the middle of the wall at a peak, m."""
        return (self.outer_diameter - self.wall) / 2

    @property
    def flank(self) -> float:
        """Height of one convolution, m."""
        return self.convoluted_height / self.convolutions

    @property
    def turn(self) -> float:
        """Angle through which each of the two arcs of a flank turns, rad."""
        return 2 * math.atan((self.peak - self.valley) / self.flank)

    @property
    def arc_radius(self) -> float:
        """Radius of the arcs, middle of the wall, m."""
        return self.flank / (2 * math.sin(self.turn))

    @property
    def neck_radius(self) -> float:
        """Radius of the middle of the wall at the neck, m: a peak, where the number of flanks is even."""
        return self.peak if self.convolutions % 2 == 0 else self.valley

    @property
    def extent(self) -> float:
        return max(self.total_height, self.outer_diameter, self.layer_width if self.soft_layer else 0.0)

    def volume_names(self) -> tuple[str, ...]:
        return ("body", "soft layer") if self.soft_layer else ("body",)

    def surface_names(self) -> tuple[str, ...]:
        planes = {1: (), 2: ("symmetry",), 4: ("symmetry x", "symmetry y")}[self.share]
        return ("base", "tip", *(("frame",) if self.soft_layer else ()), "cavity main", *planes, "outer")

    def _relations(self) -> None:
        if self.share not in (1, 2, 4):
            raise refusal(f"bellow: share = {self.share}", "1, 2 or 4")
        if self.peak - self.valley < 0.02 * self.peak:
            raise refusal(
                f"bellow: outer_diameter = {millimetres(self.outer_diameter)}, inner_diameter = "
                f"{millimetres(self.inner_diameter)}",
                f"an outer diameter above {millimetres(self.inner_diameter + 2 * self.wall)}, inner + 2 wall",
                "no room is left for convolutions",
                "a thinner wall or diameters further apart",
            )
        if self.turn > math.pi / 2 * (1 + 1e-9):
            raise refusal(
                f"bellow: {self.convolutions} convolutions in {millimetres(self.convoluted_height)}",
                f"flanks of {millimetres(self.peak - self.valley)} or more; now {millimetres(self.flank)}",
                "flanks would lean over their neighbours",
                "fewer convolutions, more height or diameters nearer to each other",
            )
        if self.arc_radius < 0.55 * self.wall:
            raise refusal(
                f"bellow: wall = {millimetres(self.wall)}",
                f"at most {millimetres(self.arc_radius / 0.55)}, as the folds have a radius of "
                f"{millimetres(self.arc_radius)}",
                "the fold would close on its inner side",
                "a thinner wall or fewer convolutions",
            )
        for word, wall in (("collar_height", self.floor), ("neck_height", self.top)):
            if getattr(self, word) - wall < 5e-5:
                raise refusal(
                    f"bellow: {word} = {millimetres(getattr(self, word))}",
                    f"more than {'floor' if word[0] == 'c' else 'top'} = {millimetres(wall)}",
                )
        if self.soft_layer and self.layer_width / 2 < self.neck_radius + self.wall / 2 + 1e-4:
            raise refusal(
                f"bellow: layer_width = {millimetres(self.layer_width)}",
                f"more than the neck's outer diameter, {millimetres(2 * self.neck_radius + self.wall)}",
            )

    def _draw(self, gmsh: Any) -> Parts:
        from geometry.bellow_cad import draw

        return draw(gmsh, self)
