"""From files to what the search works on: records, split, uniform grids, refitted base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_spa.errors import InputError
from fem_spa.loop.base import Base, base_of
from fem_spa.loop.compose import Chain, around
from fem_spa.loop.data import Data, build
from fem_spa.loop.fit import fit
from fem_spa.loop.model_file import Source
from fem_spa.loop.noise import Noise, Whitener
from fem_spa.loop.operators import travelled
from fem_spa.loop.records import Record
from fem_spa.loop.split import Split
from fem_spa.reduced.model import ReducedModel

ROWS = 12_000
"""Rows of all records together that the search works on; half of them where there are several outputs."""


@dataclass(frozen=True)
class Case:
    """One call.

    Attributes
    ----------
    data : thinned, for the search;  full : every sample, for predictions
    chain : the base (and the effects its file brought) refitted on the training records: `before`
    """

    split: Split
    data: Data
    full: Data
    chain: Chain


def prepare(source: Source, parted: Split, rows: int = ROWS) -> Case:
    """Grids and the refitted base.

    Raises
    ------
    InputError
        where records and model do not fit: outputs, number of pressures
    """
    names = outputs_of(source.model, parted.records)
    data = build(parted.records, parted.train, names, rows if len(names) == 1 else rows // 2)
    full = build(parted.records, parted.train, names, 10**9)
    return Case(parted, data, full, before(base_for(source, names, data), data))


def outputs_of(model: ReducedModel, records: Sequence[Record]) -> list[str]:
    """The outputs that model and records share: an angle, else a displacement or force, else the coordinates.

    Raises
    ------
    InputError
        where they share none, or the number of pressures is not the model's
    """
    given = [o.name for o in model.outputs]
    for record in records:
        if record.pressures.shape[1] != model.chambers:
            raise InputError(
                f"record {record.path} has {record.pressures.shape[1]} pressure(s), the model "
                f"('{model.kind}') takes {model.chambers}"
            )
        if not set(given) & set(record.outputs):
            raise InputError(
                f"record {record.path} has {', '.join(record.outputs)}; the model ('{model.kind}') gives "
                f"{', '.join(given)}: they must be the same quantity"
            )
    shared = [name for name in given if all(name in record.outputs for record in records)]
    first = next((n for n in ("angle", "displacement", "force") if n in shared), None)
    return shared if first is None else [first]


def base_for(source: Source, names: Sequence[str], data: Data) -> Base:
    """The base, prepared for the pressures of the records, with the effects that its file brought around
    it."""
    base = _plain(source, names, data)
    return around(source.chain(base)) if source.effects else base


def own_chain(source: Source, chain: Chain, data: Data) -> Chain:
    """The effects that the model's file brought as blocks, in place of a refitted `chain` around them."""
    base = _plain(source, chain.base.names, data).with_values(chain.base.values)
    return replace(source.chain(base), gain=chain.gain, offset=chain.offset)


def _plain(source: Source, names: Sequence[str], data: Data) -> Base:
    return base_of(source.model, names, data.pressure.min(axis=0), data.pressure.max(axis=0))


def before(base: Base, data: Data) -> Chain:
    """The chain of a base alone, refitted by plain least squares on the training records."""
    chain = _scaled(
        Chain(base, 1.0, np.zeros(data.output.shape[1]), (), (), *(np.ones(1),) * 2, 1.0, 1.0, 1.0), data
    )
    spread = float(np.std(data.output[data.train])) or 1.0
    plain = Noise(spread, 1e-6 * spread, 1.0, 0.0, 0.0)
    whiten = Whitener(data, plain, data.output, train_runs(data))
    return _scaled(fit(chain, data, whiten, (), (), 40).chain, data)


def _scaled(chain: Chain, data: Data) -> Chain:
    """Scales as the base is now: response in its own unit, before gain."""
    base = chain.base
    rest = base.respond(data, np.zeros_like(data.pressure), base.values)[0]
    plain = base.respond(data, data.pressure, base.values)
    scale = np.maximum(np.abs(plain - rest)[data.train].max(axis=0), 1e-12)
    chain = replace(
        chain, scale=scale, rest=rest, p_max=data.p_max, seconds=max(float(np.ptp(data.clock)), 1e-9)
    )
    cycles = float(travelled(data, chain.context(data).drive)[-1])
    return replace(chain, cycles=max(cycles, 1e-9))


def train_runs(data: Data) -> tuple[int, ...]:
    """Indices of the training runs."""
    return tuple(i for i, run in enumerate(data.runs) if run.train)
