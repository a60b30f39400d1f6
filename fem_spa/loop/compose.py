"""Base model and effects as one causal chain: pressures, blocks before the base, base, blocks after it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_spa.loop.base import Base
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
    ) -> np.ndarray:
        """(n, d) before gain and offset; `pressure` in place of the commanded one."""
        context = self.context(data)
        pressure = data.pressure if pressure is None else pressure
        for effect, theta in zip(self.effects, thetas, strict=True):
            if effect.slot in ("input", "actuation"):
                pressure = effect.apply(context, pressure, theta)
        out = self.base.respond(data, pressure, values)
        for effect, theta in zip(self.effects, thetas, strict=True):
            if effect.slot not in ("input", "actuation"):
                out = effect.apply(context, out, theta)
        return out

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

    return replace(chain.base, respond=respond, still=False)
