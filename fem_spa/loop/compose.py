"""Base model and effects as one causal chain: pressures, blocks before the base, base, blocks after it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_spa.loop.base import Base, Switches
from fem_spa.loop.data import Data
from fem_spa.loop.effects.effect import Context, Effect


@dataclass(frozen=True)
class Chain:
    """A base model with the blocks that stand around it.

    Attributes
    ----------
    base : with its refitted values
    gain : of the output, where the base has one
    offset : (d,)
    effects : blocks in causal order, with `thetas`
    scale, rest, p_max, cycles, seconds : see `Context`; kept from the refit of the base
    """

    base: Base
    gain: float
    offset: np.ndarray
    effects: tuple[Effect, ...]
    thetas: tuple[np.ndarray, ...]
    scale: np.ndarray
    rest: np.ndarray
    p_max: float
    cycles: float
    seconds: float

    def context(self, data: Data) -> Context:
        """What blocks know."""
        return Context(
            data,
            self.scale,
            self.rest,
            self.base.names,
            self.p_max,
            self.cycles,
            self.seconds,
            self.base.physical,
        )

    def predict(self, data: Data) -> np.ndarray:
        """(n, d) outputs in SI."""
        response = self.response(data, self.thetas, self.base.values)
        return np.asarray(self.gain * response + self.offset)

    def response(
        self,
        data: Data,
        thetas: Sequence[np.ndarray],
        values: np.ndarray,
        pressure: np.ndarray | None = None,
        switches: Switches | None = None,
    ) -> np.ndarray:
        """(n, d) before gain and offset; `pressure` in place of the commanded one, `switches` from outside.

        What the base carries itself (`Base.physical`) is its own, not a block.
        """
        context = self.context(data)
        pressure = data.pressure if pressure is None else pressure
        own = dict(switches or {})
        for effect, theta in zip(self.effects, thetas, strict=True):
            if effect.name in self.base.physical:
                own[effect.name] = theta
            elif effect.slot in ("input", "actuation"):
                pressure = effect.apply(context, pressure, theta)
        own = {name: theta for name, theta in own.items() if theta.any()}
        if own and self.base.switched is not None:
            # slews are of the largest pressure that the effects were found with, not of these records
            same = data if data.p_max == self.p_max else replace(data, p_max=self.p_max)
            out = self.base.switched(same, pressure, values, own)
        else:
            out = self.base.respond(data, pressure, values)
        for effect, theta in zip(self.effects, thetas, strict=True):
            block = effect.after if effect.slot in ("input", "actuation") else effect.apply
            if block is not None and effect.name not in self.base.physical:
                out = block(context, out, theta)
        return out

    def exactly(self, data: Data, pressure: np.ndarray, values: np.ndarray, switches: Switches) -> np.ndarray:
        """As `response`, the base by its whole motion."""
        base = self.base
        assert base.exact is not None
        whole = base.exact
        plain = replace(base, respond=lambda d, p, v: whole(d, p, v, {}), switched=whole)
        return replace(self, base=plain).response(data, self.thetas, values, pressure, switches)

    def with_effects(self, effects: Sequence[Effect], thetas: Sequence[np.ndarray]) -> Chain:
        """A copy with other blocks, put in causal order."""
        order = sorted(range(len(effects)), key=lambda i: effects[i].order)
        return replace(
            self,
            effects=tuple(effects[i] for i in order),
            thetas=tuple(np.asarray(thetas[i], float) for i in order),
        )


def around(chain: Chain) -> Base:
    """A base whose response is that of a whole chain: new blocks go around it, its own stay as they are."""

    def respond(data: Data, pressure: np.ndarray, values: np.ndarray) -> np.ndarray:
        return chain.response(data, chain.thetas, values, pressure)

    def switched(data: Data, pressure: np.ndarray, values: np.ndarray, switches: Switches) -> np.ndarray:
        return chain.response(data, chain.thetas, values, pressure, switches)

    return replace(
        chain.base,
        respond=respond,
        still=False,
        switched=switched if chain.base.switched else None,
        exact=chain.exactly if chain.base.exact else None,
    )
