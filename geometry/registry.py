"""The built-in shapes by name. A new shape is one file and one line here."""

from __future__ import annotations

from geometry.arm_segment import ArmSegment
from geometry.ball import Ball
from geometry.bellow import Bellow
from geometry.pneunet import PneuNet
from geometry.shape import Shape
from geometry.tripod import Tripod
from geometry.tube import Tube
from geometry.zigzag import Zigzag

SHAPES: dict[str, type[Shape]] = {
    shape.name: shape for shape in (PneuNet, Zigzag, Bellow, Tripod, ArmSegment, Tube, Ball)
}
