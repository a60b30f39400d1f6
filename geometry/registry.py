"""The built-in shapes by name. A new shape is one file and one line here."""

from __future__ import annotations

from geometry.ball import Ball
from geometry.pneunet import PneuNet
from geometry.shape import Shape
from geometry.tube import Tube

SHAPES: dict[str, type[Shape]] = {shape.name: shape for shape in (PneuNet, Ball, Tube)}
