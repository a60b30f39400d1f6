"""Parameters that these tests cannot tell apart, and the test that would.

A second test, of each mode in turn, as large and as noisy as those given and reaching the same
I1 - 3, is added to the sensitivities. Twice the rows alone narrow an interval to 0.71; a test that
narrows it far more sees what the given ones do not.
"""

from __future__ import annotations

import math

import numpy as np

from materials.fitting import Data, Fit, predict_by_parameter
from materials.intervals import Uncertainty, _inverse
from materials.response import MODES, principal_stretches
from materials.stability import reach_stretch

NARROWS = 3.0
"""A further test that narrows an interval by this factor sees what the given tests do not."""

TIED = 0.9
OPEN = 1.0
_FEWER = "no further test of these modes would help: take a law with fewer parameters"


def warnings(fitted: Fit, u: Uncertainty, data: Data) -> list[str]:
    """One sentence for each thing that these tests leave open."""
    names, out = fitted.variant.free, []
    gains = {mode: _gain(fitted, data, mode) for mode in MODES}
    for j, name in enumerate(names):
        mode = max(gains, key=lambda m: gains[m][j])
        gain = gains[mode][j]
        partner = _partner(u, j)
        low, high = u.intervals[name]
        half = 0.5 * (high - low)
        vague = half > OPEN * abs(fitted.parameters[name])
        tied = partner is not None and abs(u.correlation[j, partner]) > TIED
        if not (vague or (tied and gain > NARROWS)):
            continue
        text = f"{fitted.name}: {name} is not told"
        if tied and partner is not None:
            text += f" apart from {names[partner]} (correlation {u.correlation[j, partner]:+.3f})"
        else:
            text += f" by these tests ({_number(low)} to {_number(high)})"
        if gain > 1.8:
            text += f"; {_article(mode)} {mode} test would narrow its interval {_times(gain)}"
        else:
            text += f"; {_FEWER}"
        out.append(text)
    if len(out) > 2 and not any("would narrow" in s for s in out):
        return [f"{fitted.name}: {len(out)} of {len(names)} parameters are not told by these tests; {_FEWER}"]
    return _merge(out, names)


def _merge(sentences: list[str], names: tuple[str, ...]) -> list[str]:
    """One sentence for each pair, not one for each of its members."""
    kept: list[str] = []
    pairs: set[frozenset[str]] = set()
    for s in sentences:
        pair = frozenset(n for n in names if f" {n} " in s)
        if len(pair) == 2 and pair in pairs:
            continue
        pairs.add(pair)
        kept.append(s)
    return kept


def _partner(u: Uncertainty, j: int) -> int | None:
    """The parameter most tied to the j-th."""
    row = np.abs(u.correlation[j]).copy()
    row[j] = -1.0
    return None if row.size < 2 else int(np.argmax(row))


def _gain(fitted: Fit, data: Data, mode: str) -> np.ndarray:
    """Factor by which a further test of `mode` narrows each parameter's interval, (n_free,)."""
    low, high = reach_stretch(mode, data.reach)
    pressed = bool(np.any(data.stretches[0] < 0.98))
    grid = np.linspace(low if pressed else 1.0, high, max(20, data.stress.size))
    J = predict_by_parameter(fitted.variant, fitted.parameters, principal_stretches(mode, grid))
    J = J[np.all(np.isfinite(J), axis=1)] * float(np.median(data.weight))
    before = np.diag(_inverse(fitted.jacobian))
    after = np.diag(_inverse(np.vstack([fitted.jacobian, J])))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.sqrt(np.where(after > 0, before / after, 1.0))


def _article(word: str) -> str:
    return "an" if word[0] in "aei" else "a"


def _times(gain: float) -> str:
    return f"{gain:.1f} times" if gain < 100 else "more than 100 times"


def _number(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "open"
