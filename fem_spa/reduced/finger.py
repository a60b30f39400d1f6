"""Kind "pneunet": the composite finger of Yu et al. (2022); slow and fast pressure in, bending angle out.

    [model]
    kind = "pneunet"
    slow_chambers = 9            # 0: fast module alone, one pressure
    fast_chambers = 6            # 0: slow module alone, one pressure
    stress = "yeoh"              # (7) in module one; "linear": (8), as the paper's (10)
    reading = "crowns"           # what theta_2 of (20) is, see finger_fast.py; "printed"
    method = "moments"           # module one by moments, two by virtual work; "cantilever": for comparison
    outputs = ["angle"]          # also x, y, z of the tip in the base's system of curvature.py
    w1 = "18 mm"                 # Table 1, C10, C20, stiffness, slow_stiffness, fast_stiffness, offset

Pressure 1 is the slow network's, 2 the fast one's; a finger with one network has one pressure. The angle is
theta_T = n1 theta_1(P1) + alpha(P2), both modules without memory and without influence on each other (in
the FE solution of the finger the parts add up to the whole within 1 deg). What is not in it: weight,
contact with an object, ends and joint of the modules.

Calibration: `stiffness` and `offset` are what `diagnose` refits (finger_sizes.BASE); `slow_stiffness`,
`fast_stiffness`, `fast_bending` and `offset` what `calibrate` fits (finger_sizes.CALIBRATED). A stiffness
multiplies the rubber's moduli, so the angle is that of the pressure over it. `fast_bending`, an angle of
module two a pressure, stands for the bending of its chambers besides squeezing, which starts linearly.
Squeezing starts where the walls meet, at P0 = `fast_touch`: alpha = fast_squeezing (crowns(P) - crowns(P0)) +
fast_bending P, the first part not below zero; `fast_squeezing` is 1 where the walls do not flatten.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from scipy.optimize import brentq

from fem_spa.errors import InputError
from fem_spa.reduced import finger_beam, finger_fast, finger_slow
from fem_spa.reduced.checks import check_drive
from fem_spa.reduced.curvature import tip
from fem_spa.reduced.finger_sizes import parameters, values
from fem_spa.reduced.model import Drive, Output, Parameter, Range
from fem_spa.reduced.tables import changed, common_table, read_parameters, read_valid, refuse_unknown
from fem_spa.units import brief, quantity, show

OUTPUTS = {"angle": "deg", "x": "mm", "y": "mm", "z": "mm"}
WORDS = {"stress": ("yeoh", "linear"), "reading": finger_fast.READINGS, "method": ("moments", "cantilever")}
"""Keys that choose a formula, with their words; the first is the default."""
COUNTS = {"slow_chambers": 9, "fast_chambers": 6}
LIMITS = (80e3, 40e3)
"""Pa: the largest pressures of the paper's bench, slow and fast."""


@dataclass(frozen=True, eq=False)
class Finger:
    """The finger.

    Attributes
    ----------
    slow_chambers, fast_chambers : n1, n2; not both zero
    stress, reading, method : words of `WORDS`
    parameters : finger_sizes.parameters()
    """

    parameters: Mapping[str, Parameter]
    slow_chambers: int = 9
    fast_chambers: int = 6
    stress: str = "yeoh"
    reading: str = "crowns"
    method: str = "moments"
    outputs: tuple[Output, ...] = (Output("angle", "deg"),)
    valid: Range | None = None
    kind: str = "pneunet"

    def __post_init__(self) -> None:
        if min(self.slow_chambers, self.fast_chambers) < 0 or not self.slow_chambers + self.fast_chambers:
            given = f"{self.slow_chambers} slow and {self.fast_chambers} fast chambers"
            raise InputError(f"given {given}: at least one chamber in all is needed, none negative")
        self._check()

    @property
    def networks(self) -> tuple[str, ...]:
        """Networks in the order of the pressures: slow, fast."""
        counts = (("slow", self.slow_chambers), ("fast", self.fast_chambers))
        return tuple(name for name, count in counts if count)

    @property
    def chambers(self) -> int:
        """Number of pressures: of networks, each inflated as one."""
        return len(self.networks)

    def with_values(self, **given: float) -> Self:
        """A copy with other parameter values (SI)."""
        return replace(self, parameters=changed(self.parameters, given, self.kind))

    def simulate(self, drive: Drive) -> np.ndarray:
        """(n, outputs): the angle in rad (`offset` added), x, y, z in m; no memory."""
        _, pressure = check_drive(drive, self.chambers, self.kind)
        modules = self.module_angles(pressure)
        total = modules.sum(axis=1) + self.parameters["offset"].value
        columns = {"angle": total}
        names = [output.name for output in self.outputs]
        if set(names) - {"angle"}:
            place = tip(*self.chain(modules))
            columns |= {"x": place[:, 0], "y": place[:, 1], "z": place[:, 2]}
        return np.column_stack([columns[name] for name in names])

    def module_angles(self, pressure: np.ndarray) -> np.ndarray:
        """(n, 2) rad, beta of module one and alpha of module two, at (n, chambers) Pa; a missing one: 0."""
        size = values(self.parameters)
        softened = np.asarray(pressure, float) / self._factors()
        result = np.zeros((len(softened), 2))
        n1, n2 = self.slow_chambers, self.fast_chambers
        for j, name in enumerate(self.networks):
            P = softened[:, j]
            if name == "slow" and self.method == "cantilever":
                result[:, 0] = n1 * finger_beam.slow_angle(P, size)
            elif name == "slow":
                result[:, 0] = n1 * finger_slow.angle(P, size, self.stress)
            elif self.method == "cantilever":
                result[:, 1] = n2 * finger_beam.fast_angle(P, size)
            else:
                result[:, 1] = self._fast_angle(P, size)
        return result

    def pressures(self, angles: np.ndarray) -> np.ndarray:
        """(n, chambers) Pa at which the modules have turned by (n, 2) rad: the inverse of `module_angles`.

        inf where no pressure turns module two so far; an angle of a module that is not there is left out.
        """
        size = values(self.parameters)
        turned = np.atleast_2d(np.asarray(angles, float))
        columns = []
        for name in self.networks:
            if self.method == "cantilever":
                beam = finger_beam.slow_angle if name == "slow" else finger_beam.fast_angle
                count = self.slow_chambers if name == "slow" else self.fast_chambers
                columns.append(turned[:, 0 if name == "slow" else 1] / (count * beam(np.ones(1), size)))
            elif name == "slow":
                columns.append(finger_slow.pressure(turned[:, 0] / self.slow_chambers, size, self.stress))
            else:
                columns.append(self._fast_pressure(turned[:, 1], size))
        return np.column_stack(columns) * self._factors()

    def _fast_pressure(self, turned: np.ndarray, size: dict[str, float]) -> np.ndarray:
        """(n,) Pa, over the factors on the moduli, at which module two has turned by (n,) rad."""
        n2, own = self.fast_chambers, size["fast_bending"] * size["fast_stiffness"]
        gain, lost = size["fast_squeezing"], self._unsqueezed(size)
        goals = np.maximum(turned, 0.0) / gain
        alone = finger_fast.pressure(np.where(goals > 0.0, goals + lost, 0.0), size, n2, self.reading)
        if own == 0.0:
            return alone
        # both shares grow with the pressure: what either alone would need is an upper bound
        most = np.where(turned > 0.0, np.minimum(alone, turned / own), 0.0)
        result = turned / own
        for i in np.flatnonzero(turned > 0.0):
            result[i] = brentq(
                lambda p, goal=turned[i]: float(self._fast_angle(np.array(p), size)) - goal,
                0.0,
                float(most[i]) * (1.0 + 1e-9),
                xtol=1e-9,
                rtol=1e-14,
            )
        return result

    def _fast_angle(self, P: np.ndarray, size: dict[str, float]) -> np.ndarray:
        """rad of module two at pressures P (Pa, any shape) over the factors on the moduli."""
        squeezed = finger_fast.angle(P, size, self.fast_chambers, self.reading) - self._unsqueezed(size)
        own = size["fast_bending"] * P * size["fast_stiffness"]
        return np.asarray(size["fast_squeezing"] * np.maximum(squeezed, 0.0) + own)

    def _unsqueezed(self, size: dict[str, float]) -> float:
        """rad of the squeezing's angle that the gap swallows, that at the pressure where the walls meet."""
        if size["fast_touch"] == 0.0:
            return 0.0
        touch = np.array(size["fast_touch"] / size["fast_stiffness"])
        return float(finger_fast.angle(touch, size, self.fast_chambers, self.reading))

    def links(self) -> np.ndarray:
        """(n1 + n2,) m, length along the paper that belongs to each chamber.

        Slow: l1. Fast: l3 and the gap l2 to the next; the last has none. (28) prints l3 for all, which leaves
        the gaps out.
        """
        size = values(self.parameters)
        fast = np.full(self.fast_chambers, size["l3"] + size["l2"])
        fast[-1:] = size["l3"]
        return np.concatenate([np.full(self.slow_chambers, size["l1"]), fast])

    def chain(self, modules: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Turns (n, n1 + n2) rad and lengths (n1 + n2,) m of the chambers' arcs, for `curvature`.

        modules : (n, 2) rad, as of `module_angles`; the chambers of a module turn alike
        """
        modules = np.atleast_2d(np.asarray(modules, float))
        counts = (self.slow_chambers, self.fast_chambers)
        turns = [np.repeat(modules[:, [j]] / max(n, 1), n, axis=1) for j, n in enumerate(counts)]
        return np.concatenate(turns, axis=1), self.links()

    def table(self) -> dict[str, Any]:
        """The `[model]` table."""
        table = common_table(self.kind, self.parameters, self.valid, self.outputs)
        own = {name: getattr(self, name) for name in (*COUNTS, *WORDS)}
        return table | own | {"outputs": [output.name for output in self.outputs]}

    def _factors(self) -> np.ndarray:
        """(chambers,) what the moduli are multiplied by in each network's module."""
        both = self.parameters["stiffness"].value
        return np.array([both * self.parameters[f"{name}_stiffness"].value for name in self.networks])

    def _check(self) -> None:
        """InputError for sizes between which there is no rubber or no air."""
        size = values(self.parameters)
        pairs = [("w1", "w2"), ("r1", "r2")] if self.slow_chambers else []
        pairs += [("w3", "w4"), ("r3", "r4")] if self.fast_chambers else []
        for inner, outer in pairs:
            if size[inner] > size[outer]:
                raise InputError(
                    f"given {inner} = {show(size[inner], 'm')} and {outer} = {show(size[outer], 'm')}: "
                    f"{inner} is inside {outer}; give {inner} at most as large"
                )
        if self.fast_chambers and 2.0 * size["t4"] >= size["l3"]:
            raise InputError(
                f"given t4 = {show(size['t4'], 'm')} and l3 = {show(size['l3'], 'm')}: two lateral walls "
                "leave no air; give t4 below l3 / 2"
            )


def finger(**given: Any) -> Finger:
    """The paper's finger; other fields of `Finger` by name."""
    return Finger(parameters(), **given)


def read(table: Mapping[str, Any], where: Path) -> Finger:
    """The model of a `[model]` table."""
    default = parameters()
    refuse_unknown(table, (*default, *COUNTS, *WORDS, "outputs"))
    given: dict[str, Any] = {}
    for name, count in COUNTS.items():
        number = quantity(table.get(name, count), "1", f"model.{name}", low=0, high=200)
        if number != int(number):
            raise InputError(f"given {brief(table[name])} for model.{name}: a whole number is needed")
        given[name] = int(number)
    for name, words in WORDS.items():
        given[name] = table.get(name, words[0])
        if given[name] not in words:
            raise InputError(f"given {brief(given[name])} for model.{name}: allowed are {', '.join(words)}")
    names = table.get("outputs", ["angle"])
    if not isinstance(names, list) or not names or any(name not in OUTPUTS for name in names):
        raise InputError(
            f"given {brief(names)} for model.outputs: a list of {', '.join(OUTPUTS)}, for example ['angle']"
        )
    outputs = tuple(Output(name, OUTPUTS[name]) for name in names)
    model = Finger(read_parameters(table, default), outputs=outputs, **given)
    return replace(model, valid=read_valid(table, outputs))
