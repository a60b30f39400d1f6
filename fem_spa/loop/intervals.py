"""Parameters with their 95 % intervals, in the units of the records."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.noise import Whitener
from fem_spa.loop.physical import UNITS
from fem_spa.loop.prepare import train_runs
from fem_spa.loop.screen import base_columns
from fem_spa.loop.search import theta_columns

if TYPE_CHECKING:
    from fem_spa.loop.diagnose import Study


def standard_errors(study: Study) -> dict[str, np.ndarray]:
    """Effect -> (k,) standard errors of its parameters; infinite where the records do not bound one."""
    chain, data = study.decision.best.trial.fit.chain, study.case.data
    plain = chain.response(data, chain.thetas, chain.base.values)
    slopes = theta_columns(chain, data)
    columns = np.concatenate([slopes, base_columns(chain, data, plain)], axis=2)
    level = chain.gain * (plain - chain.rest)
    turned = Whitener(data, study.decision.noise, level, train_runs(data))(columns)
    flat = turned.reshape(-1, turned.shape[2])
    gram = flat.T @ flat
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    inverse = np.linalg.pinv(gram / np.outer(size, size), rcond=1e-10, hermitian=True)
    spread = np.sqrt(np.maximum(np.diag(inverse), 0.0)) / size
    found, at = {}, 0
    for effect in chain.effects:
        k = len(effect.parameters)
        found[effect.name] = spread[at : at + k]
        at += k
    return found


def shown_parameters(name: str, study: Study, size: float, unit: str) -> dict[str, Any]:
    """The contract's `parameters` of one effect; shares of pressure in kPa, of span in the output's unit."""
    effect = EFFECTS[name]
    chain = study.after
    pairs = list(zip(chain.effects, chain.thetas, strict=True))
    spread = standard_errors(study)
    if study.pneumatics is not None:
        pairs += list(zip(study.pneumatics.effects, study.pneumatics.thetas, strict=True))
    theta = next(t for e, t in pairs if e.name == name)
    errors = spread.get(name, np.full(len(theta), np.nan))
    shown = {}
    for p, value, error in zip(effect.parameters, theta, errors, strict=True):
        factor, word = 1.0, p.unit
        if p.unit == "of pressure":
            factor, word = chain.p_max / 1e3, "kPa"
        elif name in chain.base.physical and name in UNITS:
            factor, word = UNITS[name]
        elif p.unit == "of span":
            factor, word = float(chain.scale[0]) * chain.gain / size, unit
        low, high = max(value - 1.96 * error, p.low), min(value + 1.96 * error, p.high)
        shown[p.name] = {
            "value": float(value) * factor,
            "unit": word,
            "low": float(low) * factor,
            "high": float(high) * factor,
        }
    return shown
