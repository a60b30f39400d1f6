"""Which of several fitted effects have left no mark of their own."""

from __future__ import annotations

from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.noise import Noise
from fem_spa.loop.signatures.measure import gauge, seen

NOISE = 3.0
"""Standard deviations within which a figure may be noise."""


def unmarked(found: Chain, data: Data, noise: Noise) -> tuple[str, ...]:
    """Of several fitted effects those whose own mark is not in what the others leave, or has the other sign.

    Effects whose mark these records cannot show, or that have none, are not among them.
    """
    names = []
    for effect in found.effects if len(found.effects) > 1 else ():
        if effect.signature is None:
            continue
        rest = without(found, effect.name)
        made = gauge(effect.signature, seen(rest, data), noise)
        if isinstance(made, str):
            continue
        read = made.read(data.output - rest.predict(data))
        if abs(read.deviations[0]) < NOISE or effect.signature.sign * read.values[0] < 0.0:
            names.append(effect.name)
    return tuple(names)


def without(chain: Chain, name: str) -> Chain:
    """A fitted chain without one of its effects."""
    kept = [i for i, effect in enumerate(chain.effects) if effect.name != name]
    return chain.with_effects([chain.effects[i] for i in kept], [chain.thetas[i] for i in kept])
