"""Closed forms and manufactured solutions against fem_spa.solid. tests/solid holds the same cases to bounds.

    python benchmarks/verification        prints docs/verification.md down to its section on contact

SI inside; the tables speak degrees. One file a topic; benchmarks and tests take what they need from here.
"""

from verification.blocks import MM, box, even, moved
from verification.closed_forms import Check, closed_forms, cylinder, flexure, hanging_bar, homogeneous, sphere
from verification.equilibrium import SAMPLES, HeldSystem, body_force, material, rotation, settle, traction
from verification.evidence import EVIDENCE, evidence_mesh, fast_module
from verification.manufactured import SIDE, Manufactured, rates

__all__ = [
    "EVIDENCE",
    "MM",
    "SAMPLES",
    "SIDE",
    "Check",
    "HeldSystem",
    "Manufactured",
    "body_force",
    "box",
    "closed_forms",
    "cylinder",
    "even",
    "evidence_mesh",
    "fast_module",
    "flexure",
    "hanging_bar",
    "homogeneous",
    "material",
    "moved",
    "rates",
    "rotation",
    "settle",
    "sphere",
    "traction",
]
