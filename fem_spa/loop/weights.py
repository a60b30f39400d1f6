"""How likely each name is: weights from errors on records left out, with mass for "none of these".

Pseudo-BMA (Yao et al. 2018): each set that could stand in an effect's place weighs exp(-difference of its
left-out log score / temperature), the score per block of the records, so that long records do not make a
small difference certain. What the best set leaves of the predictable error, form aside, is the mass of
"none of these".
"""

from __future__ import annotations

import numpy as np

from fem_spa.loop.decide import Decision
from fem_spa.loop.effects.registry import EFFECTS

TEMPERATURE = 0.02
"""Difference of the explained share at which a rival is e times less likely than the best."""
LEAST_OTHER = 0.06
"""Mass of what is not in the library where the best set explains everything."""
OTHER = 1.0
"""What is left unexplained adds so much of its share."""


def probability(name: str, decision: Decision) -> float:
    """Probability of `name` in its place, its declared classmates counted as other names."""
    others = set(decision.chosen) - {name}
    best = max(decision.best.share, 1e-6)
    none = LEAST_OTHER + OTHER * max(1.0 - best, 0.0)
    weights: dict[str, float] = {}
    for s in decision.scored:
        extra = set(s.trial.names) - others
        if others <= set(s.trial.names) and len(extra) == 1 and len(s.trial.names) == len(decision.chosen):
            key = extra.pop()
            weights[key] = max(weights.get(key, 0.0), float(np.exp(-max(best - s.share, 0.0) / TEMPERATURE)))
    weights[name] = max(weights.get(name, 0.0), 1.0)
    for rival in decision.rivals.get(name, []):
        weights.setdefault(rival, 0.5 if rival in EFFECTS[name].classmates else 0.0)
    return (1.0 - min(none, 0.9)) * weights[name] / sum(weights.values())
