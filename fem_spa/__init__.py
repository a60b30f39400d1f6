"""Soft pneumatic actuators: from a drawing and a rubber's test to a trusted angle-pressure curve."""

__version__ = "0.1.0"
