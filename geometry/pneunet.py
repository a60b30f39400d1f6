"""PneuNet: slow network, fast network, and the composite finger of both (Yu et al. 2022).

The drawing: base at x = 0, finger along +x, width along y about the plane y = 0, height along z
from the bottom face z = 0. Two bottom layers with a plane of paper between them carry, from the
base on: the slow module (one block, chambers parted by inner walls), the soft joint, the fast module
(chambers of their own with gaps between, joined by a bridge on the bottom that holds the channel).

What Table 1 prints, and how it is read here where the figure is not at hand:

- w1 = 2 r1, w2 = 2 r2, w3 = 2 r3, w4 = 2 r4: semicircular tops. Radii of their own are allowed: an
  inner top is an arc of radius r1 (r3) over walls h1 (h2) high; an outer top is an arc of radius r2
  (r4) whose crown lies t7 (t6) above the inner crown. With the sizes of the table both are concentric.
- l1 is the pitch of the slow chambers (chamber and inner wall), as the kinematics of the paper, eq. (28),
  chains nine l1: the clear length of a chamber is l1 - t5.
- l3 is the outer length of a fast chamber, as in eq. (14), where its inside is l3 - 2 t4.
- t1, t2: the two bottom layers; t3: the bridge between fast chambers, above them, as in eq. (14), where
  the gap's section is (2 t1 + t3) w4; t4: lateral walls of the fast chambers.
- t5: inner walls of the slow module; t6: top wall of the fast module; t7: of the slow module (eq. 12).

Not printed, chosen, open to change: channel, end walls of the slow module, length and height of the joint.
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

_LEAST_WALL = 5e-5


@dataclass(frozen=True)
class PneuNet(Shape):
    """Sizes of a PneuNet finger, m. Defaults: Table 1 of the paper; "chosen" where it prints none."""

    name: ClassVar[str] = "pneunet"
    title: ClassVar[str] = "PneuNet finger: slow network, fast network, or the composite of both"
    source: ClassVar[str] = (
        "Yu, Liu, Zhao, Hou, Hong, Zhang (2022), composite soft pneumatic actuator, Table 1"
    )
    default_size: ClassVar[float] = 3e-3

    slow_chambers: int = count(9, "chambers of the slow network; 0: fast module alone", symbol="n1")
    fast_chambers: int = count(6, "chambers of the fast network; 0: slow module alone", symbol="n2")
    slow_inner_width: float = length(18e-3, "inner width of a slow chamber", symbol="w1")
    slow_outer_width: float = length(20e-3, "outer width of the slow module", symbol="w2")
    fast_inner_width: float = length(16e-3, "inner width of a fast chamber", symbol="w3")
    fast_outer_width: float = length(20e-3, "outer width of the fast module", symbol="w4")
    slow_inner_radius: float = length(
        9e-3, "radius of a slow chamber's inner top, at least w1/2", symbol="r1"
    )
    slow_outer_radius: float = length(
        10e-3, "radius of the slow module's outer top, at least w2/2", symbol="r2"
    )
    fast_inner_radius: float = length(
        8e-3, "radius of a fast chamber's inner top, at least w3/2", symbol="r3"
    )
    fast_outer_radius: float = length(
        10e-3, "radius of a fast chamber's outer top, at least w4/2", symbol="r4"
    )
    slow_wall_height: float = length(10e-3, "height of a slow chamber's straight inner walls", symbol="h1")
    fast_wall_height: float = length(10e-3, "height of a fast chamber's straight inner walls", symbol="h2")
    slow_pitch: float = length(9e-3, "slow chamber and one inner wall; clear length is l1 - t5", symbol="l1")
    gap: float = length(2e-3, "gap between two fast chambers", symbol="l2")
    fast_chamber_length: float = length(5e-3, "outer length of a fast chamber", symbol="l3")
    lower_layer: float = length(2e-3, "thickness of the bottom layer under the paper", symbol="t1")
    upper_layer: float = length(2e-3, "thickness of the bottom layer above the paper", symbol="t2")
    bridge: float = length(3e-3, "height of the bridge between fast chambers above the layers", symbol="t3")
    lateral_wall: float = length(1e-3, "lateral wall of a fast chamber, towards its neighbour", symbol="t4")
    slow_inner_wall: float = length(2e-3, "inner wall between two slow chambers", symbol="t5")
    fast_top_wall: float = length(2e-3, "wall of a fast chamber at the crown of its top", symbol="t6")
    slow_top_wall: float = length(1e-3, "wall of the slow module at the crown of its top", symbol="t7")
    channel_width: float = length(3e-3, "width of the channel that joins the chambers of a network (chosen)")
    channel_height: float = length(2e-3, "height of that channel, on the chambers' floor (chosen)")
    slow_end_wall: float = length(2e-3, "walls that close the slow module at both ends (chosen)")
    joint_length: float = length(5e-3, "length of the soft joint between the modules (chosen)")
    joint_height: float = length(3e-3, "height of the soft joint above the bottom layers (chosen: as t3)")
    half: bool = flag(True, "half model, y >= 0, with the surface `symmetry` at y = 0; false: whole")

    @property
    def slow_length(self) -> float:
        """Length of the slow module along x, m; 0 without slow chambers."""
        if not self.slow_chambers:
            return 0.0
        return self.slow_chambers * self.slow_pitch - self.slow_inner_wall + 2 * self.slow_end_wall

    @property
    def fast_length(self) -> float:
        """Length of the fast module along x, m; 0 without fast chambers."""
        if not self.fast_chambers:
            return 0.0
        return self.fast_chambers * self.fast_chamber_length + (self.fast_chambers - 1) * self.gap

    @property
    def fast_start(self) -> float:
        """x of the fast module's first face, m."""
        both = self.slow_chambers and self.fast_chambers
        return self.slow_length + (self.joint_length if both else 0.0)

    @property
    def total_length(self) -> float:
        """Length of the finger along x, m."""
        return self.fast_start + self.fast_length if self.fast_chambers else self.slow_length

    @property
    def floor(self) -> float:
        """z of the chambers' floor, m."""
        return self.lower_layer + self.upper_layer

    @property
    def extent(self) -> float:
        slow = self._slow_profile() if self.slow_chambers else (0.0, 0.0)
        fast = self._fast_profile() if self.fast_chambers else (0.0, 0.0)
        return max(self.total_length, self.slow_outer_width, self.fast_outer_width, slow[1], fast[1])

    def surface_names(self) -> tuple[str, ...]:
        names = ["base", "tip"]
        if self.slow_chambers:
            names.append("cavity slow")
        if self.fast_chambers:
            names.append("cavity fast")
        if self.half:
            names.append("symmetry")
        return (*names, "layer paper", "outer")

    def _slow_profile(self) -> tuple[float, float]:
        """z of the inner and of the outer crown of the slow module, m."""
        inner = self.floor + self.slow_wall_height + _rise(self.slow_inner_width, self.slow_inner_radius)
        return inner, inner + self.slow_top_wall

    def _fast_profile(self) -> tuple[float, float]:
        """z of the inner and of the outer crown of a fast chamber, m."""
        inner = self.floor + self.fast_wall_height + _rise(self.fast_inner_width, self.fast_inner_radius)
        return inner, inner + self.fast_top_wall

    def _relations(self) -> None:
        if not self.slow_chambers and not self.fast_chambers:
            raise refusal("pneunet: slow_chambers = 0 and fast_chambers = 0", "at least one chamber in all")
        if self.slow_chambers:
            self._module_relations("slow", *self._slow_profile())
            if self.slow_pitch - self.slow_inner_wall < _LEAST_WALL:
                raise refusal(
                    f"pneunet: slow_inner_wall = {millimetres(self.slow_inner_wall)}",
                    f"less than slow_pitch = {millimetres(self.slow_pitch)}",
                    "the pitch counts the chamber and one inner wall",
                    "a longer pitch or a thinner wall",
                )
        if self.fast_chambers:
            self._module_relations("fast", *self._fast_profile())
            if self.fast_chamber_length - 2 * self.lateral_wall < _LEAST_WALL:
                raise refusal(
                    f"pneunet: lateral_wall = {millimetres(self.lateral_wall)}",
                    f"less than half of fast_chamber_length = {millimetres(self.fast_chamber_length)}",
                    "no room is left for air between the two lateral walls",
                    "a longer chamber or thinner walls",
                )
            if self.fast_chambers > 1 and self.bridge - self.channel_height < _LEAST_WALL:
                raise refusal(
                    f"pneunet: channel_height = {millimetres(self.channel_height)}",
                    f"less than bridge = {millimetres(self.bridge)}",
                    "the channel would be open to the gap between the chambers",
                    "a lower channel or a higher bridge",
                )
            low = (
                self._fast_profile()[1]
                - self.fast_outer_radius
                + _side(self.fast_outer_width, self.fast_outer_radius)
            )
            if self.floor + self.bridge > low:
                raise refusal(
                    f"pneunet: bridge = {millimetres(self.bridge)}",
                    f"at most {millimetres(low - self.floor)}, where the chambers' outer tops begin",
                    "the gap between the chambers would be closed",
                )
        if self.slow_chambers and self.fast_chambers:
            lowest = min(
                self._slow_profile()[1]
                - self.slow_outer_radius
                + _side(self.slow_outer_width, self.slow_outer_radius),
                self._fast_profile()[1]
                - self.fast_outer_radius
                + _side(self.fast_outer_width, self.fast_outer_radius),
            )
            if self.floor + self.joint_height > lowest:
                raise refusal(
                    f"pneunet: joint_height = {millimetres(self.joint_height)}",
                    f"at most {millimetres(lowest - self.floor)}, where the outer tops begin",
                )

    def _module_relations(self, which: str, inner_crown: float, outer_crown: float) -> None:
        """Arches over their walls, side and top walls, channel, of one module."""
        get = lambda word: float(getattr(self, f"{which}_{word}"))  # noqa: E731
        inner_width, outer_width = get("inner_width"), get("outer_width")
        for side, width in (("inner", inner_width), ("outer", outer_width)):
            radius = get(f"{side}_radius")
            if radius < width / 2 * (1 - 1e-9):
                raise refusal(
                    f"pneunet: {which}_{side}_radius = {millimetres(radius)}",
                    f"at least half of {which}_{side}_width = {millimetres(width)}",
                    "the arch would not span the walls",
                    f"{millimetres(width / 2)} for a semicircular top",
                )
        wall = (outer_width - inner_width) / 2
        if wall < _LEAST_WALL:
            raise refusal(
                f"pneunet: {which}_inner_width = {millimetres(inner_width)}, "
                f"{which}_outer_width = {millimetres(outer_width)}: side wall {millimetres(wall)}",
                f"a side wall of at least {millimetres(_LEAST_WALL)}",
                "the inner width is not smaller than the outer",
            )
        inner_centre = inner_crown - get("inner_radius")
        outer_centre = outer_crown - get("outer_radius")
        outer_side = outer_centre + _side(outer_width, get("outer_radius"))
        if outer_side < self.floor + 1e-4:
            raise refusal(
                f"pneunet: {which}_wall_height = {millimetres(get('wall_height'))}",
                "walls high enough that the outer top begins above the chambers' floor",
                "outer arch higher than the inner one by more than the walls",
                f"a larger {which}_outer_radius or higher walls",
            )
        thinnest = min(
            outer_centre
            + math.sqrt(get("outer_radius") ** 2 - y * y)
            - (inner_centre + math.sqrt(max(0.0, get("inner_radius") ** 2 - y * y)))
            for y in (inner_width / 2 * k / 40 for k in range(41))
        )
        if thinnest < _LEAST_WALL:
            raise refusal(
                f"pneunet: {which}_outer_radius = {millimetres(get('outer_radius'))} over "
                f"{which}_inner_radius = {millimetres(get('inner_radius'))}: wall {millimetres(thinnest)}",
                f"at least {millimetres(_LEAST_WALL)} everywhere in the top",
                "the two arches cut each other",
                f"{which}_outer_radius = {which}_inner_radius + {which}_top_wall",
            )
        if self.channel_width > inner_width:
            raise refusal(
                f"pneunet: channel_width = {millimetres(self.channel_width)}",
                f"at most {which}_inner_width = {millimetres(inner_width)}",
                "a channel wider than the chamber",
            )
        if self.channel_height > get("wall_height"):
            raise refusal(
                f"pneunet: channel_height = {millimetres(self.channel_height)}",
                f"at most {which}_wall_height = {millimetres(get('wall_height'))}",
                "a channel higher than the chamber's straight walls",
            )

    def _draw(self, gmsh: Any) -> Parts:
        from geometry.pneunet_cad import draw

        return draw(gmsh, self)


def _rise(width: float, radius: float) -> float:
    """Height of an arc of a radius over a chord of a width, m."""
    return radius - _side(width, radius)


def _side(width: float, radius: float) -> float:
    """Height of the arc's ends above its centre, m."""
    return math.sqrt(max(0.0, radius**2 - (width / 2) ** 2))
