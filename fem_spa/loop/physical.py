"""The last word of the physical model: what was found with short cuts, with the model's whole motion instead.

Gauss-Newton on the plain error: residuals of the whole motion, slopes of the short cut, which differ little.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.fit import polished
from fem_spa.loop.loads import PAYLOAD, SOFT
from fem_spa.loop.screen import base_columns
from fem_spa.loop.search import theta_columns

STEPS = 2
UNITS = {
    "gravity": (1.0, "of its weight"),
    "payload": (1e3 * PAYLOAD, "g"),
    "base-compliance": (math.degrees(SOFT), "deg/(N*m)"),
}
"""Effect that a rod carries itself -> factor and unit of its first parameter."""
BLOCK = {
    "input": "a block on the pressures, through the model itself",
    "actuation": "a block on the pressures, through the model itself",
}


def whole(chain: Chain) -> Chain:
    """The chain whose base answers by its whole motion; the same where there is no short cut."""
    exact = chain.base.exact
    if exact is None:
        return chain
    base = replace(chain.base, respond=lambda d, p, v: exact(d, p, v, {}), switched=exact)
    return replace(chain, base=base)


def last_word(chain: Chain, data: Data) -> Chain:
    """The chain by its whole motion, refitted; as it came where that does not make it better."""
    if chain.base.exact is None or not chain.effects:
        return chain
    rows = data.train & data.known
    short, best = chain, polished(whole(chain), data)
    size = _size(best, data)
    for _ in range(STEPS):
        plain = short.response(data, short.thetas, short.base.values)
        columns = np.concatenate([base_columns(short, data, plain), theta_columns(short, data)], axis=2)
        a = columns[rows].reshape(-1, columns.shape[2])
        b = (data.output - best.predict(data))[rows].ravel()
        scale = np.sqrt(np.maximum((a * a).sum(axis=0), 1e-300))
        move = np.linalg.lstsq(a / scale, b, rcond=1e-8)[0] / scale
        trial = _moved(short, move, columns.shape[2])
        found = polished(whole(trial), data)
        if _size(found, data) >= size:
            break
        short, best, size = trial, found, _size(found, data)
    return best if size < _size(chain, data) * 1.05 else chain


def _moved(chain: Chain, move: np.ndarray, count: int) -> Chain:
    """Base values and thetas moved, inside their bounds; gain and offsets are found anew."""
    sizes = [len(t) for t in chain.thetas]
    first = count - sum(sizes)
    k = len(chain.base.values)
    values = np.clip(chain.base.values + move[first - k : first], chain.base.low, chain.base.high)
    steps = np.split(move[first:], np.cumsum(sizes)[:-1])
    thetas = [
        np.clip(theta + step, effect.low, effect.high)
        for effect, theta, step in zip(chain.effects, chain.thetas, steps, strict=True)
    ]
    return replace(chain, base=chain.base.with_values(values), thetas=tuple(thetas))


def _size(chain: Chain, data: Data) -> float:
    rows = data.train & data.known
    return float(np.mean((data.output - chain.predict(data))[rows] ** 2))


def forms(chain: Chain) -> dict[str, str]:
    """Effect -> in which form it stands in the chain, for the report."""
    own = chain.base.physical
    return {e.name: own.get(e.name) or BLOCK.get(e.slot, "a block on the output") for e in chain.effects}
