"""Kind "chain": the zig-zag actuator as rigid links with springs at the folds.

    [model]
    kind = "chain"
    preset = "linear"                # or "bending": with the limiting layer; then overridden:
    segments = 23                    # n; `length` d, `fold` theta, `end`, `mass`, `damping`
    layer = "1"                      # pieces of the layer along the length: "1" whole (T1), "10101", "0" none
    k_theta = "1.3296 N*m/rad"       # folds without layer
    k_layer = "1.21 N*m/rad"         # folds where the layer is;  layer_stiffening = "0 1/rad^2"
    torque = { columns = ["pressure [kPa]", "torque [N*m]"], rows = [[0, 0], [350, 0.37]] }
    extension = { file = "linear.csv" }   # instead: `displacement` of the linear actuator, which gives the
    torque gravity = false                  # default true: weights and the drive's orientation and payload
    count dynamics = true                  # default false: equation (1) by MuJoCo instead of equilibrium
    hysteresis = { A = 0.3, beta = 6, alpha = 2, n = 1 }   # Bouc-Wen of every fold, u in rad

Source: the multimodal zig-zag paper, (1)-(7); what it leaves open is in `chain_actuator`, `chain_stiffness`
and `hysteresis`. `series = [{...}, {...}]` puts actuators end to end, one chamber each. Outputs: `angle`
of the base-tip line against its rest direction, `displacement` of the tip along the rest axis (extension),
its place `x`, `y`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from fem_spa.errors import InputError
from fem_spa.reduced import chain_actuator
from fem_spa.reduced.chain_actuator import Actuator, series
from fem_spa.reduced.chain_links import Links, chord_angle, loaded, places
from fem_spa.reduced.chain_statics import along, turns
from fem_spa.reduced.checks import check_drive
from fem_spa.reduced.curve import Curve
from fem_spa.reduced.hysteresis import BoucWen, displacement
from fem_spa.reduced.model import Drive, Output, Parameter, Range
from fem_spa.reduced.tables import changed

OUTPUTS = (Output("angle", "deg"), Output("displacement", "mm"), Output("x", "mm"), Output("y", "mm"))
STANDARD_GRAVITY = 9.80665


@dataclass(frozen=True, eq=False)
class Chain:
    """One zig-zag actuator, or several end to end.

    Attributes
    ----------
    actuators : from base to tip
    parameters : of one: k_theta, k_layer, length, ...; of several: k_theta_1, ..., k_theta_2, ...
    hysteresis : of every fold, or None;  gravity, dynamics : switches
    """

    actuators: tuple[Actuator, ...]
    parameters: Mapping[str, Parameter]
    hysteresis: BoucWen | None = None
    gravity: bool = True
    dynamics: bool = False
    valid: Range | None = None
    outputs: tuple[Output, ...] = OUTPUTS
    kind: str = "chain"

    @property
    def chambers(self) -> int:
        """One an actuator."""
        return len(self.actuators)

    def with_values(self, **values: float) -> Self:
        """A copy with other parameter values (SI); the torques of the air stay."""
        return replace(self, parameters=changed(self.parameters, values, self.kind))

    def values(self, i: int) -> dict[str, float]:
        """Parameter values of actuator i (from 0), SI."""
        suffix = f"_{i + 1}" if len(self.actuators) > 1 else ""
        return {name: self.parameters[name + suffix].value for name in chain_actuator.parameters("")}

    @cached_property
    def links(self) -> Links:
        """Joints and bodies of all actuators."""
        return series([actuator.links(self.values(i)) for i, actuator in enumerate(self.actuators)])

    def simulate(self, drive: Drive) -> np.ndarray:
        """(n, 4): angle rad, displacement m, x m, y m of the tip.

        InputError also where `dynamics` is on and MuJoCo is missing.
        """
        return self.observe(self.turns(drive), drive.payload)

    def observe(self, q: np.ndarray, payload: float = 0.0) -> np.ndarray:
        """(n, 4) outputs at turns q (n, m)."""
        tip = places(self.links, q)[0][..., -1]
        moved = np.real(tip) - self.links.rest.real
        return np.column_stack([chord_angle(self.links, q), moved, np.real(tip), np.imag(tip)])

    def turns(self, drive: Drive) -> np.ndarray:
        """Turns of all joints (n, m), rad."""
        time, pressure = check_drive(drive, self.chambers, self.kind)
        links = loaded(self.links, drive.payload)
        gravity = 0j
        if self.gravity:
            gravity = STANDARD_GRAVITY * complex(np.cos(drive.orientation), -np.sin(drive.orientation))
        if self.dynamics:
            from fem_spa.reduced.chain_dynamics import motion

            start = turns(links, np.zeros((1, links.mass.size)), gravity)[0]
            return motion(links, time, self.torques(pressure), start, gravity, self.hysteresis)[0]
        torque = self.torques(pressure)
        if self.hysteresis is not None:
            if np.any(links.stiffening):
                raise InputError(
                    "given hysteresis and layer_stiffening: at equilibrium springs have one or the other; "
                    "leave one out, or give dynamics = true"
                )
            torque = self._yielding(time, torque)
        if gravity == 0j:
            return turns(links, torque, gravity)
        row, column = np.unravel_index(np.argmax(np.abs(torque)), torque.shape)
        if torque[row, column] == 0.0:
            return np.repeat(turns(links, torque[:1], gravity), len(torque), axis=0)
        pattern = torque[row] / torque[row, column]
        if np.allclose(
            torque, torque[:, column, None] * pattern, rtol=0, atol=1e-12 * abs(torque[row, column])
        ):
            return along(links, torque[:, column], pattern, gravity)
        rows, back = np.unique(np.round(torque, 12), axis=0, return_inverse=True)
        return turns(links, rows, gravity)[back.reshape(-1)]

    def torques(self, pressure: np.ndarray) -> np.ndarray:
        """Torque of the air on each joint (n, m), N m, at pressures (n, chambers)."""
        parts = [a.torque.at(pressure[:, i])[:, None] * a.pattern() for i, a in enumerate(self.actuators)]
        return np.concatenate(parts, axis=1)

    def _yielding(self, time: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """Torques (n, m) that elastic springs need for the turns of springs with hysteresis, (7)."""
        assert self.hysteresis is not None
        result, known = np.empty_like(torque), {}
        links = self.links
        for j in range(torque.shape[1]):
            k, c = links.stiffness[j] * links.part[j], links.damping[j] * links.part[j]
            size = np.max(np.abs(torque[:, j]))
            sign = np.sign(torque[np.argmax(np.abs(torque[:, j])), j]) if size > 0 else 1.0
            key = (float(k), float(c), (sign * torque[:, j]).tobytes())
            if key not in known:
                known[key] = k * displacement(time, sign * torque[:, j], k, c, self.hysteresis)[0]
            result[:, j] = sign * known[key]
        return result

    def table(self) -> dict[str, Any]:
        """The `[model]` table with the torques themselves."""
        from fem_spa.reduced.chain_files import chain_table

        return chain_table(self)


def actuator(
    torque: Curve, layer: str = "0", segments: int = chain_actuator.SEGMENTS, source: str = "zig-zag paper"
) -> Chain:
    """A chain of one actuator with the paper's numbers (`chain_actuator.parameters`)."""
    numbers = chain_actuator.parameters(source)
    wanted = "k_layer" if "1" in layer else "k_theta"  # first: the one that moves the actuator
    ordered = {wanted: numbers[wanted]} | numbers
    return Chain((Actuator(segments, layer, torque),), ordered, valid=torque.valid)


def in_series(*chains: Chain) -> Chain:
    """Actuators end to end, the first at the base, one chamber each; switches and hysteresis of the first.

    Raises
    ------
    InputError : fewer than two
    """
    if len(chains) < 2:
        raise InputError("given one actuator; a series has two or more")
    names = {f"{name}_{i}": p for i, chain in enumerate(chains, 1) for name, p in chain.parameters.items()}
    ranges = [chain.valid for chain in chains]
    valid = None
    if all(ranges):
        low, high = (tuple(getattr(r, end)[0] for r in ranges) for end in ("low", "high"))
        valid = Range(low, high, None, "; ".join(dict.fromkeys(r.source for r in ranges if r)))
    parts = tuple(chain.actuators[0] for chain in chains)
    return replace(chains[0], actuators=parts, parameters=names, valid=valid)


def task_space(chain: Chain, pressures: list[np.ndarray], orientation: float = 0.0) -> np.ndarray:
    """Where the tip can go: (k1, k2, ..., 4) outputs for all combinations of the chambers' pressures (Pa)."""
    grids = np.meshgrid(*pressures, indexing="ij")
    flat = np.column_stack([grid.reshape(-1) for grid in grids])
    still = replace(chain, dynamics=False, hysteresis=None)
    drive = Drive(np.arange(len(flat), dtype=float), flat, orientation)
    return still.simulate(drive).reshape(*grids[0].shape, len(OUTPUTS))


def read(table: Mapping[str, Any], where: Path) -> Chain:
    """The model of a `[model]` table; `where` is the folder of files."""
    from fem_spa.reduced.chain_files import read_chain

    return read_chain(table, where)
