"""Kind "rod": the three-chamber arm as a Cosserat rod; three pressures in, the tip's x, y, z out.

    [model]
    kind = "rod"
    preset = "am-i-support"      # Table 1 of the arm paper, then overridden:
    gravity = true               # false: weightless, a payload too
    damping = true               # false: quasi-static, the equilibrium of every moment
    strain_gains = true          # false: all 1; or [1.0, 1.0, 1.1]
    valve = true                 # false: no threshold, no transient, no delay
    modulus = "1.6464 MPa"       # any parameter by its name
    clamp = "element"            # holds the whole first element, as PyElastica; "base": its frame alone
    integration = "explicit"     # PyElastica's scheme; "modal": implicit, in few strain modes, faster
    base_compliance = "2 deg/(N*m)"   # the clamp turns under the moment at it; default: it is fast
    law = "law.csv"              # one chamber's actuation from FE (rod_law.py) in place of (24)-(26)

The base is at the origin, z up, the rest tip at (0, 0, -190 mm); chamber 1 on +y, 2 at (+x, -y), 3 at
(-x, -y). `orientation` of a drive turns gravity in the y-z plane: at 90 deg the arm lies level and the
bending that chamber 1 makes lifts it. The tip is given in the frame of the base. The mass is shared by the
nodes, ends half; the arm starts at rest under gravity, unpressurised. docs/rod.md has the scheme and what
was measured.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from fem_spa.errors import InputError
from fem_spa.reduced.checks import check_drive
from fem_spa.reduced.model import Drive, Output, Parameter, Range
from fem_spa.reduced.rod_actuation import spontaneous
from fem_spa.reduced.rod_base import compliant
from fem_spa.reduced.rod_kernel import verlet
from fem_spa.reduced.rod_law import RodLaw, read_law
from fem_spa.reduced.rod_modal import bases, implicit
from fem_spa.reduced.rod_parameters import CHAMBERS, preset
from fem_spa.reduced.rod_section import Discrete, discrete, largest_step, straight
from fem_spa.reduced.rod_static import equilibria
from fem_spa.reduced.tables import changed, common_table, read_parameters, read_valid, refuse_unknown
from fem_spa.reduced.valve import Valve, valve_pressure
from fem_spa.units import brief, quantity

SWITCHES = ("gravity", "damping", "strain_gains", "valve")
CHOICES = {"clamp": ("element", "base"), "integration": ("explicit", "modal")}
"""Words that a key may have, the default first."""
GRID = 1e-3
"""s; spacing of the pressures that a time loop gets."""
MODAL_GRID = 1e-2
"""s; step of the implicit integration."""
FINER = (1, 4, 16, 64)
"""Parts of that step, tried in turn where the motion on a compliant base is not found."""
LONGEST = 2e4
"""s; a longer record is a slip of units, or has a gap of hours."""
SAFE = 0.9
"""Of the largest stable explicit step."""
_OUTPUTS = (Output("x", "mm"), Output("y", "mm"), Output("z", "mm"))


@dataclass(frozen=True, eq=False)
class Rod:
    """The arm: `parameters` of rod_parameters.py, four switches, the law of a chamber or None, choices."""

    parameters: Mapping[str, Parameter]
    gravity: bool = True
    damping: bool = True
    strain_gains: bool = True
    valve: bool = True
    law: RodLaw | None = None
    clamp: str = "element"
    integration: str = "explicit"
    valid: Range | None = None
    preset: str = "am-i-support"
    kind: str = "rod"
    chambers: int = CHAMBERS
    outputs: tuple[Output, ...] = _OUTPUTS

    def with_values(self, **values: float) -> Self:
        """A copy with other values in SI; InputError for an unknown name, or one out of bounds."""
        return replace(self, parameters=changed(self.parameters, values, self.kind))

    def switched(self, **switches: bool) -> Self:
        """A copy with `gravity`, `damping`, `strain_gains`, `valve` on or off."""
        return replace(self, **switches)  # type: ignore[arg-type]

    def values(self) -> dict[str, float]:
        """Name -> value in SI."""
        return {name: p.value for name, p in self.parameters.items()}

    def supply(self) -> Valve:
        """The valve before the chambers; one that does nothing where it is switched off."""
        v = self.values()
        if not self.valve:
            return Valve()
        return Valve(v["rise_time"], v["drop_time"], v["valve_delay"], v["pressure_threshold"])

    @property
    def hinge(self) -> bool:
        """Whether the clamp holds the base's frame and not the first element."""
        return self.clamp == "base"

    @property
    def compliance(self) -> float:
        """Of the clamp, rad/(N m)."""
        return self.parameters["base_compliance"].value

    def discrete(self) -> Discrete:
        """The rod of nodes and elements."""
        return discrete(self.values(), self.law)

    def strains(self, pressure: np.ndarray) -> np.ndarray:
        """Spontaneous strains (m, 3) at chamber pressures (m, 3) Pa: sigma_3, kappa_1, kappa_2."""
        return spontaneous(pressure, self.values(), self.strain_gains, self.law)

    def simulate(self, drive: Drive) -> np.ndarray:
        """(n, 3) tip in m at the drive's times.

        InputError as `check_drive`, for more than `LONGEST`, no equilibrium, a motion without bound.
        """
        time, pressure = check_drive(drive, self.chambers, self.kind)
        if not self.damping:
            inside = valve_pressure(time, pressure, self.supply())
            return self.settled(inside, drive.orientation, drive.payload)
        modal = self.integration == "modal" or self.compliance > 0.0
        step, march = (MODAL_GRID, self.glide) if modal else (GRID, self.march)
        if time[-1] - time[0] > LONGEST:
            raise InputError(
                f"given a record of {time[-1] - time[0]:.4g} s: the rod moves through {LONGEST:g} s at most; "
                "cut it, or take damping = false"
            )
        grid = time[0] + step * np.arange(math.ceil((time[-1] - time[0]) / step - 1e-9) + 1)
        inside = valve_pressure(time, pressure, self.supply(), at=grid)
        tip = march(self.strains(inside), step, drive.orientation, drive.payload)
        return np.column_stack([np.interp(time, grid, column) for column in tip.T])

    def settled(self, pressure: np.ndarray, orientation: float = 0.0, payload: float = 0.0) -> np.ndarray:
        """(m, 3) tip in m at rest under each of the chamber pressures (m, 3) Pa, no valve before them."""
        tip = self.rest(self.strains(np.atleast_2d(pressure)), orientation, payload)[0]
        return self._placed(tip)

    def rest(
        self,
        strain: np.ndarray,
        orientation: float = 0.0,
        payload: float = 0.0,
        tip_force: Any = (0.0, 0.0, 0.0),
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Equilibria of spontaneous strains (m, 3): tip (m, 3); nodes (n + 1, 3), directors (n, 9) at last.

        tip_force : N in the frame of the clamp. InputError where no equilibrium is found.
        """
        rod = self.discrete()
        r, Q = straight(rod)
        mass = rod.mass.copy()
        mass[-1] += self._payload(payload)
        weight = mass[:, None] * self.pull(orientation)
        force = np.asarray(tip_force, float)
        given = (strain, Q, r, weight, force, self.hinge, rod.length, rod.axial, rod.bending)
        tip = compliant(*given, self.compliance) if self.compliance else equilibria(*given)
        if not np.all(np.isfinite(tip)):
            row = int(np.argmin(np.isfinite(tip).all(axis=1)))
            raise InputError(
                f"the rod finds no equilibrium at row {row + 1}: the load is too much for its stiffness; "
                "see modulus, payload, pressures and base_compliance"
            )
        return tip, r, Q

    def march(self, strain: np.ndarray, grid: float, orientation: float, payload: float) -> np.ndarray:
        """(m, 3) tip at points `grid` s apart, explicit in time, from rest without pressure.

        strain : (m, 3) spontaneous strains at the points, linear in between
        """
        value, rod = self.values(), self.discrete()
        _, r, Q = self.rest(self.strains(np.zeros((1, CHAMBERS))), orientation, payload)
        substeps = max(1, math.ceil(grid / min(value["time_step"], SAFE * largest_step(rod, value)) - 1e-9))
        v, w = np.zeros_like(r), np.zeros((rod.n, 3))
        dt = grid / substeps
        extra, pull, slow = self._payload(payload), self.pull(orientation), math.log1p(rod.viscous * dt) / dt
        stiff = (self.hinge, rod.length, rod.mass, extra, rod.inertia, rod.axial, rod.bending)
        tip = verlet(r, v, Q, w, strain, substeps, dt, *stiff, pull, slow, rod.slow)
        if not np.all(np.isfinite(tip)):
            raise InputError("the rod's motion grows without bound; give a smaller model.time_step")
        return self._placed(tip)

    def glide(self, strain: np.ndarray, grid: float, orientation: float, payload: float) -> np.ndarray:
        """As `march`, implicit in strain modes; where that fails, the explicit loop takes over, but where
        the clamp is on a spring, which that loop has not."""
        rod = self.discrete()
        mass = rod.mass.copy()
        mass[-1] += self._payload(payload)
        weight = mass[:, None] * self.pull(orientation)
        shape = (*bases(rod.n), self.hinge, rod.length, rod.axial, rod.bending, self.compliance)
        path = np.vstack([self.strains(np.zeros((1, CHAMBERS))), strain[1:]])
        for fine in FINER if self.compliance else FINER[:1]:
            between = np.arange(fine * (len(path) - 1) + 1) / fine
            finer = np.stack([np.interp(between, np.arange(len(path)), c) for c in path.T], axis=1)
            tip = implicit(finer, grid / fine, weight, mass, rod.mass, rod.viscous, shape)[::fine]
            if np.all(np.isfinite(tip)):
                return self._placed(tip)
        if self.compliance:
            raise InputError(
                "the rod's motion on its compliant base is not found: too much load for its stiffness; "
                "see base_compliance, modulus, payload and pressures"
            )
        return self.march(strain, grid, orientation, payload)

    def pull(self, orientation: float) -> np.ndarray:
        """(3,) gravity in the frame of the clamp, m/s^2; zero where it is switched off."""
        size = self.parameters["gravity_acceleration"].value if self.gravity else 0.0
        return size * self._tilt().T @ np.array([0.0, math.sin(orientation), -math.cos(orientation)])

    def _payload(self, payload: float) -> float:
        return payload + self.parameters["payload"].value

    def _tilt(self) -> np.ndarray:
        """Rotation (3, 3) of the clamp in its stand."""
        a, b = (self.parameters[f"base_tilt_{axis}"].value for axis in "xy")
        about_x = np.array([[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]])
        about_y = np.array([[math.cos(b), 0, math.sin(b)], [0, 1, 0], [-math.sin(b), 0, math.cos(b)]])
        return about_y @ about_x

    def _placed(self, tip: np.ndarray) -> np.ndarray:
        """The tip as the bench sees it: tilt and offset of the frame."""
        return tip @ self._tilt().T + np.array([self.parameters[f"offset_{axis}"].value for axis in "xyz"])

    def table(self) -> dict[str, Any]:
        """The `[model]` table: what differs from the preset, the switches, the law."""
        base = preset(self.preset)
        names = [n for n, p in self.parameters.items() if p != base[n]]
        table = common_table(self.kind, self.parameters, self.valid, self.outputs, names)
        table = {"kind": self.kind, "preset": self.preset} | {s: getattr(self, s) for s in SWITCHES} | table
        table |= {
            name: getattr(self, name) for name, words in CHOICES.items() if getattr(self, name) != words[0]
        }
        return table | ({"law": self.law.table()} if self.law is not None else {})


def arm(name: str = "am-i-support") -> Rod:
    """The arm of a preset; InputError for an unknown one."""
    return Rod(preset(name), preset=name)


def read(table: Mapping[str, Any], where: Path) -> Rod:
    """The rod of a `[model]` table.

    Raises
    ------
    InputError : no or an unknown preset, an unknown key, a switch that is none, a value out of range
    """
    if "preset" not in table:
        raise InputError("given no model.preset: kind 'rod' needs one; write preset = 'am-i-support'")
    base = preset(table["preset"])
    refuse_unknown(table, (*base, "preset", *SWITCHES, *CHOICES, "law"))
    parameters = read_parameters(table, base)
    switches: dict[str, bool] = {}
    for name in SWITCHES:
        given = table.get(name, True)
        if name == "strain_gains" and isinstance(given, list):
            parameters |= _gains(given, parameters)
            given = True
        if not isinstance(given, bool):
            more = " or a list of three gains" if name == "strain_gains" else ""
            raise InputError(f"given {brief(given)} for model.{name}: true or false is needed{more}")
        switches[name] = given
    law = read_law(table["law"], where) if "law" in table else None
    n = parameters["elements"].value
    if n != round(n):
        raise InputError(f"given {n:g} for model.elements: a whole number is needed")
    chosen = {name: table.get(name, words[0]) for name, words in CHOICES.items()}
    for name, word in chosen.items():
        if word not in CHOICES[name]:
            allowed = " and ".join(f"'{w}'" for w in CHOICES[name])
            raise InputError(f"given {brief(word)} for model.{name}: allowed are {allowed}")
    rod = Rod(parameters, law=law, **chosen, valid=read_valid(table, _OUTPUTS), preset=str(table["preset"]))
    rod = rod.switched(**switches)
    rod.discrete()
    return rod


def _gains(given: list[Any], parameters: Mapping[str, Parameter]) -> dict[str, Parameter]:
    """Strain gains of a list."""
    if len(given) != CHAMBERS:
        raise InputError(
            f"given {len(given)} numbers for model.strain_gains: three are needed, one a chamber"
        )
    found = {}
    for i, number in enumerate(given, 1):
        p = parameters[f"strain_gain_{i}"]
        value = quantity(number, "1", "model.strain_gains", low=p.low, high=p.high)
        found[f"strain_gain_{i}"] = p if value == p.value else replace(p, value=value, source="")
    return found
