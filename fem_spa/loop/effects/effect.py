"""What an effect is: a causal block in one slot between command and sensor, with parameters and a null."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fem_spa.loop.data import Data
from fem_spa.loop.signatures.statistic import Statistic

SLOTS = ("input", "actuation", "stiffness", "state", "load", "sensor")
"""In causal order; `input` and `actuation` blocks turn pressures, the others the response of the base
model."""


@dataclass(frozen=True)
class Param:
    """One number of an effect.

    Attributes
    ----------
    low, high, start : range and a typical value
    unit : shown; `of pressure` and `of span` are shares, shown in the unit of the pressure or output
    amplitude : the block is (nearly) linear in it and at its null where all amplitudes are zero
    """

    name: str
    low: float
    high: float
    start: float
    unit: str = ""
    amplitude: bool = False


@dataclass(frozen=True)
class Context:
    """What a block may know.

    Attributes
    ----------
    data : drive, times and metadata of all records (blocks never look at `data.output`)
    scale : (d,) largest response of the base model over the training records
    rest : (d,) its response at zero pressure
    names : outputs
    p_max, cycles, seconds : what shares of pressure, of all cycles and of all time mean
    physical : effects that the base model itself carries -> in which form, in words
    """

    data: Data
    scale: np.ndarray
    rest: np.ndarray
    names: tuple[str, ...]
    p_max: float
    cycles: float
    seconds: float
    physical: Mapping[str, str] = field(default_factory=dict)

    @property
    def q(self) -> np.ndarray:
        """(n, m) commanded pressure as a share of the largest."""
        return self.data.pressure / self.p_max

    def share(self, response: np.ndarray) -> np.ndarray:
        """(n, d) response as a share of its scale, zero at rest."""
        return (response - self.rest) / self.scale

    @property
    def drive(self) -> np.ndarray:
        """(n,) one number for how far the actuator is driven: the largest chamber's share, signed."""
        q = self.q
        return np.asarray(q[np.arange(len(q)), np.argmax(np.abs(q), axis=1)])


Apply = Callable[[Context, np.ndarray, np.ndarray], np.ndarray]
Starts = Callable[[Context], list[list[np.ndarray]]]
Needs = Callable[[Context], str | None]


def _nothing(_: Context) -> str | None:
    return None


@dataclass(frozen=True)
class Effect:
    """A block.

    Attributes
    ----------
    order : place among all blocks, causal
    parameters : see `Param`
    apply : (context, pressures or response, theta) -> the same, changed
    after : of an `input` or `actuation` block: what it does to the response as well
    starts : groups of thetas; the responses of a group add up, with factors >= 0; one group is the start
    of a fit
    untestable : why these records cannot show it, or None
    classmates : what one output alone cannot tell from it (contract)
    experiment : the primitive of `experiment.py` that would separate it
    words : what its residual looks like, for a person
    signature : what of a residual is its own mark, in numbers; None where the base's refit takes it all
    """

    name: str
    family: str
    slot: str
    order: int
    memory: str
    parameters: tuple[Param, ...]
    apply: Apply
    starts: Starts
    classmates: tuple[str, ...] = ()
    untestable: Needs = _nothing
    after: Apply | None = None
    experiment: str = "rates"
    words: str = ""
    signature: Statistic | None = None

    @property
    def low(self) -> np.ndarray:
        return np.array([p.low for p in self.parameters])

    @property
    def high(self) -> np.ndarray:
        return np.array([p.high for p in self.parameters])

    @property
    def null(self) -> np.ndarray:
        """A theta at which the block changes nothing."""
        return np.array([0.0 if p.amplitude else p.start for p in self.parameters])

    @property
    def amplitudes(self) -> np.ndarray:
        """(k,) which parameters are amplitudes."""
        return np.array([p.amplitude for p in self.parameters])


def grid(*columns: Sequence[float]) -> list[list[np.ndarray]]:
    """Groups of one theta each: all combinations of the columns."""
    mesh = np.meshgrid(*[np.asarray(c, float) for c in columns], indexing="ij")
    return [[theta] for theta in np.stack([m.ravel() for m in mesh], axis=1)]


def soft_plus(x: np.ndarray, width: float) -> np.ndarray:
    """max(x, 0) rounded over about `width`."""
    return np.asarray(width * np.logaddexp(0.0, x / width))
