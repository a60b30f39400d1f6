"""Effects that a model file brings: held as they are while the model's own numbers are fitted through them.

`diagnose` leaves a model with `[effects]` and `[scales]` (fem_spa/loop/model_file.py). What such a model
answers is what `fem-spa simulate` says of it: the commanded pressures of all records in session order, what
happened in one remembered in the next. So one answer is of all records at once, held-out ones included, of
which it takes the pressures and nothing that was measured.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.calibration.observation import Run, commanded
from fem_spa.errors import InputError
from fem_spa.loop.model_file import Source
from fem_spa.reduced.model import ReducedModel


@dataclass(frozen=True)
class Carried:
    """The effects of a model file around a model.

    Attributes
    ----------
    effects : names, in causal order
    outputs : that they act on
    answer : model -> path of a record -> (n, outputs) SI at its samples
    """

    effects: tuple[str, ...]
    outputs: tuple[str, ...]
    answer: Callable[[ReducedModel], Mapping[Path, np.ndarray]]

    def predicted(self, model: ReducedModel, runs: Sequence[Run], outputs: Sequence[str]) -> list[np.ndarray]:
        """Of each run (rows that count, outputs) SI, by the model with its effects."""
        answer = self.answer(model)
        columns = [self.outputs.index(name) for name in outputs]
        return [answer[run.path][run.use][:, columns] for run in runs]


def carried(source: Source, given: Path, runs: Sequence[Run]) -> tuple[Carried | None, list[Run]]:
    """The effects of a model file, and its runs as these see them: under the commanded pressure.

    Parameters
    ----------
    source : content of the model file `given`
    runs : all of one call, in session order

    Returns
    -------
    None and the runs as they are, where the file has no effects

    Raises
    ------
    InputError
        for a static curve, which has no history, and where the effects are of other outputs than the records'
    """
    from fem_spa.loop.prepare import outputs_of
    from fem_spa.loop.simulate import predicted

    if not source.effects or source.scales is None:
        return None, list(runs)
    effects = tuple(effect.name for effect in source.effects)
    records = []
    for run in runs:
        if run.record is None:
            raise InputError(
                f"{run.path} is a static curve: the effects of {given} ({', '.join(effects)}) act over time; "
                "give records with 'time [s]', or the model file without [effects] and [scales]"
            )
        records.append(run.record)
    names = outputs_of(source.model, records)
    count = len(source.scales["scale"])
    if count != len(names):
        raise InputError(
            f"{given}, scales: its effects are of {count} output(s), model and records share "
            f"{', '.join(names)}; give records with the outputs of those that were diagnosed"
        )

    def answer(model: ReducedModel) -> dict[Path, np.ndarray]:
        found = predicted(replace(source, model=model), records, names)
        return {run.path: rows for run, rows in zip(runs, found, strict=True)}

    return Carried(effects, tuple(names), answer), [commanded(run) for run in runs]


def kept_tables(given: Mapping[str, Any]) -> dict[str, Any]:
    """`[scales]` and `[effects]` of a model file's tables as they stand there; none without effects."""
    return {name: given[name] for name in ("scales", "effects") if given.get("effects") and name in given}
