"""Parameters of the three-chamber arm as a rod: Table 1 of the arm paper, and what a bench may add.

Alessi, Falotico, Lucantonio, "Ablation Study of a Dynamic Model for a 3D-Printed Pneumatic Soft Robotic
Arm", IEEE Access 2023. Mass and density of the table disagree: the density on the chambers' walls alone
(area of (34), length) gives 0.039 kg, the weighed parts 0.1704 kg. Weight and translational inertia are
those of `mass`, shared by the nodes; `density` serves the rotational inertia of the cross-section only,
which has next to no influence on the tip.
"""

from __future__ import annotations

import math

from fem_spa.errors import InputError
from fem_spa.reduced.model import Parameter
from fem_spa.units import brief

CHAMBERS = 3
_TABLE = "Alessi et al. 2023, Table 1"


def am_i_support() -> dict[str, Parameter]:
    """Name -> Parameter of the preset "am-i-support"; the effects of a bench at their null."""
    mm, deg, bar = 1e-3, math.pi / 180, 1e5
    rows: dict[str, Parameter] = {
        "length": Parameter(190 * mm, "mm", 20 * mm, 2.0, _TABLE),
        "chamber_angle_1": Parameter(90 * deg, "deg", -math.tau, math.tau, _TABLE),
        "chamber_angle_2": Parameter(210 * deg, "deg", -math.tau, math.tau, _TABLE),
        "chamber_angle_3": Parameter(330 * deg, "deg", -math.tau, math.tau, _TABLE),
        "chamber_distance": Parameter(20 * mm, "mm", 1 * mm, 0.2, _TABLE),
        "outer_radius": Parameter(7.79 * mm, "mm", 0.5 * mm, 0.1, _TABLE),
        "inner_radius": Parameter(6.39 * mm, "mm", 0.2 * mm, 0.1, _TABLE),
        "mass": Parameter(0.1704, "kg", 1e-4, 10.0, _TABLE),
        "density": Parameter(1104.0, "kg/m^3", 100.0, 2e4, _TABLE + "; for the rotational inertia only"),
        "poisson": Parameter(0.5, "", 0.0, 0.5, _TABLE),
        "modulus": Parameter(1.6464e6, "MPa", 1e4, 1e9, _TABLE + ", fitted to the stretching test"),
        "strain_gain_1": Parameter(1.0133, "", 0.2, 3.0, _TABLE + ", fitted by (35)"),
        "strain_gain_2": Parameter(1.0035, "", 0.2, 3.0, _TABLE + ", fitted by (35)"),
        "strain_gain_3": Parameter(1.1092, "", 0.2, 3.0, _TABLE + ", fitted by (35)"),
        "translational_damping": Parameter(806.0, "1/s", 1.0, 2e4, _TABLE + ", fitted by (35)"),
        "rotational_damping": Parameter(1.9416e-4, "m^2/s", 0.0, 1e-2, _TABLE + ", fitted by (35)"),
        "gravity_acceleration": Parameter(9.80513, "m/s^2", 0.0, 30.0, _TABLE),
        "elements": Parameter(20.0, "", 4.0, 400.0, _TABLE + ", n"),
        "time_step": Parameter(2e-4, "s", 1e-6, 1e-2, _TABLE + ", dt of the explicit integration"),
        "pressure_threshold": Parameter(0.2 * bar, "kPa", 0.0, 1 * bar, _TABLE + ", p0"),
        "rise_time": Parameter(0.2 / bar, "s/bar", 0.0, 10 / bar, _TABLE + ", for 1 bar"),
        "drop_time": Parameter(0.56 / bar, "s/bar", 0.0, 10 / bar, _TABLE + ", for 1 bar"),
        "valve_delay": Parameter(0.0, "s", 0.0, 2.0, _TABLE),
        "payload": Parameter(
            0.0, "g", 0.0, 1.0, "mass at the tip beside that of the drive; none in the paper"
        ),
        "cross_coupling": Parameter(
            0.0,
            "",
            -0.3,
            0.3,
            "share of each other chamber's pressure that acts in a chamber; none in the paper",
        ),
        "base_compliance": Parameter(
            0.0,
            "rad/(N*m)",
            0.0,
            5.0,
            "turn of the clamp for the moment at it, zero for a clamp that is fast; none in the paper",
        ),
        "base_tilt_x": Parameter(
            0.0, "deg", -0.5, 0.5, "rotation of the clamped base about x; none in the paper"
        ),
        "base_tilt_y": Parameter(
            0.0, "deg", -0.5, 0.5, "rotation of the clamped base about y; none in the paper"
        ),
        "offset_x": Parameter(0.0, "mm", -0.1, 0.1, "constant added to the tip; none in the paper"),
        "offset_y": Parameter(0.0, "mm", -0.1, 0.1, "constant added to the tip; none in the paper"),
        "offset_z": Parameter(0.0, "mm", -0.1, 0.1, "constant added to the tip; none in the paper"),
    }
    return rows


PRESETS = {"am-i-support": am_i_support}


def preset(name: object) -> dict[str, Parameter]:
    """The parameters of a preset; InputError with the names there are for another one."""
    if not isinstance(name, str) or name not in PRESETS:
        from fem_spa.deck import nearest

        raise InputError(
            f"given {brief(name)} for model.preset: there is no such preset{nearest(str(name), PRESETS)}"
        )
    return PRESETS[name]()
