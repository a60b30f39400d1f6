"""What a signature statistic is: contrasts of the residual, a sign that the effect asks for, words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from fem_spa.loop.effects.effect import Context

Respond = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Seen:
    """What a statistic may look at beside the residual: drives and the refitted base, never the fit of an
    effect.

    Attributes
    ----------
    context : of the blocks
    response : (n, d) of the base on what was commanded, SI, gain included
    free : (n, d, c) what the refit of the base takes
    respond : pressures (n, m) Pa -> (n, d) response of the base, gain included
    loaded : (name of a load that the base carries itself, its theta) -> (n, d) likewise
    gain : of the base
    theta, sensed : what was found for the effect, and (n, d) what the others predict without it, before gain
    and offset; for the lattice alone, whose step nothing else foretells
    """

    context: Context
    response: np.ndarray
    free: np.ndarray
    respond: Respond
    loaded: Callable[[str, np.ndarray], np.ndarray]
    gain: float = 1.0
    theta: np.ndarray | None = None
    sensed: np.ndarray | None = None

    @property
    def scale(self) -> np.ndarray:
        """(d,) largest response, SI of the output."""
        return np.asarray(self.gain * self.context.scale)

    @property
    def share(self) -> np.ndarray:
        """(n, d) response as a share of its scale, zero at rest."""
        return self.context.share(self.response / self.gain)

    @property
    def rows(self) -> np.ndarray:
        """(n,) rows that count."""
        data = self.context.data
        return np.asarray(data.train & data.known)

    @property
    def record(self) -> np.ndarray:
        """(n,) which record a row belongs to."""
        return self.context.data.place[0]


@dataclass(frozen=True)
class Contrast:
    """One pattern whose factor in the residual, all else put aside, is the statistic.

    Attributes
    ----------
    pattern : (n, d) the residual where the statistic is one
    beside : (n, d, k) what else may be in the residual and must not count
    groups : (n,) rows of one number share a constant that does not count, rows of -1 are left out; None:
    constants count
    at : place in words, where there are several
    """

    pattern: np.ndarray
    beside: np.ndarray
    groups: np.ndarray | None = None
    at: str = ""


Contrasts = Callable[[Seen], "tuple[Contrast, ...] | str"]


@dataclass(frozen=True)
class Statistic:
    """The mark of an effect.

    Attributes
    ----------
    words : what is measured, for a person
    sign : +1 or -1, which the effect asks for; 0 where it may be either
    contrasts : several where the place is not known beforehand, of which the clearest counts; or why these
    records cannot show it
    unit : `output`, or what is shown
    """

    words: str
    sign: int
    contrasts: Contrasts
    unit: str = "output"
