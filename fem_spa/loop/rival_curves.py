"""What the explanations that are left foretell for an experiment, and how far apart they are in noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from fem_spa.errors import InputError
from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data, build
from fem_spa.loop.fit import polished
from fem_spa.loop.noise import Whitener

if TYPE_CHECKING:
    from fem_spa.loop.diagnose import Study

ROWS = 12_000
SETTINGS = {"flip": {"orientation": np.pi}, "known masses": {"payload": 0.02}}
"""Experiment -> what changes against the first record: rad turned, kg added."""


@dataclass(frozen=True)
class Foretold:
    """An experiment as each explanation sees it.

    Attributes
    ----------
    kind : of `experiment.py`
    time : (n,) s;  pressure : (n,) Pa, of every chamber
    curves : name of the explanation -> (n, d) SI
    noise : standard deviation of a sample about the truth, offset of a record included, SI
    apart : pair of names -> (largest difference in noise, how sure a likelihood would be: whitened distance)
    """

    kind: str
    time: np.ndarray
    pressure: np.ndarray
    curves: Mapping[str, np.ndarray]
    noise: float
    apart: Mapping[tuple[str, str], tuple[float, float]]

    @property
    def least(self) -> float:
        """Whitened distance of the two that are nearest."""
        return min((far for _, far in self.apart.values()), default=0.0)


def explanations(study: Study) -> dict[str, Chain]:
    """Name -> chain: what is named, each rival in its place; without any rival the model before, too."""
    d = study.decision
    if not d.chosen or study.pneumatics is not None:
        return {}
    found = {" and ".join(d.chosen): study.after}
    for name in d.chosen:
        others = set(d.chosen) - {name}
        for rival in d.rivals.get(name, []):
            wanted = others | {rival}
            trial = next((t for n, t in study.found.trials.items() if set(n) == wanted), None)
            if trial is not None:
                label = " and ".join(sorted(wanted, key=lambda n: n != rival))
                found[label] = polished(trial.fit.chain, study.case.data)
    if len(found) == 1:
        found["the model before"] = study.case.chain
    return found


def foretell(study: Study, kind: str, table: np.ndarray, chains: Mapping[str, Chain]) -> Foretold | None:
    """Curves of the explanations on a profile (n, 2), s and Pa, run after all records; None where one cannot.

    A record's own offset and gain are no difference: they are taken off by the noise.
    """
    data, part = _data(study, kind, table)
    curves = {}
    try:
        for name, chain in chains.items():
            curves[name] = chain.predict(data)[part]
    except InputError:
        return None
    noise = study.decision.noise
    level = next(iter(curves.values()))
    whole = np.zeros((len(data.clock), level.shape[1]))
    whole[part] = level - level[0]
    whiten = Whitener(data, noise, whole, (len(data.runs) - 1,))
    apart = {}
    sigma = float(np.hypot(noise.sample, noise.offset))
    for a, b in combinations(curves, 2):
        off = np.zeros_like(whole)
        off[part] = curves[a] - curves[b]
        largest = float(np.linalg.norm(off[part], axis=1).max()) / max(sigma, 1e-300)
        apart[a, b] = (largest, float(np.sqrt(np.sum(whiten(off) ** 2))))
    time = data.clock[part] - data.clock[part.start]
    return Foretold(kind, time, data.pressure[part, 0], curves, sigma, apart)


def _data(study: Study, kind: str, table: np.ndarray) -> tuple[Data, slice]:
    """The records and, after a rest of ten minutes, the profile; and the rows of the latter."""
    records = study.case.split.records
    first, last = records[0], records[-1]
    chambers = first.pressures.shape[1]
    change: Mapping[str, Any] = SETTINGS.get(kind, {})
    n = len(table)
    start = None if last.start is None else last.start + last.duration + 600.0
    new = replace(
        first,
        name="next experiment",
        time=table[:, 0],
        pressures=np.repeat(table[:, 1:2], chambers, axis=1),
        measured=None,
        temperature=None,
        outputs={name: np.zeros(n) for name in first.outputs},
        orientation=None
        if first.orientation is None and "orientation" not in change
        else (first.orientation or 0.0) + change.get("orientation", 0.0),
        payload=None
        if first.payload is None and "payload" not in change
        else (first.payload or 0.0) + change.get("payload", 0.0),
        start=start,
    )
    plain = [replace(r, measured=None, temperature=None) for r in records]
    if first.temperature is not None:  # a room that stays as it was
        warm = float(np.nanmean(last.temperature)) if last.temperature is not None else 293.0
        plain = list(records)
        new = replace(new, temperature=np.full(n, warm))
    names = list(study.after.base.names)
    data = build([*plain, new], [*study.case.split.train, False], names, ROWS)
    return data, data.runs[-1].part


def words(told: Foretold, unit: str, size: float) -> str:
    """How far apart, for a person; `size` is SI in one `unit`."""
    pairs: Sequence[tuple[tuple[str, str], tuple[float, float]]] = sorted(
        told.apart.items(), key=lambda item: item[1][1]
    )
    if not pairs:
        return ""
    (a, b), (largest, far) = pairs[0]
    text = (
        f"on it {a} and {b} differ by up to {largest * told.noise / size:.2g} {unit}, {largest:.2g} times "
        f"the scatter of readings ({told.noise / size:.2g} {unit}); all samples together "
        f"{far:.2g} standard deviations"
    )
    if len(pairs) > 1:
        text += " (the nearest two of them)"
    return text
