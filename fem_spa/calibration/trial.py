"""One FE run of a calibration as a function of a deck's numbers, here or in a process of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_spa.calibration.deck_numbers import Numbers, numbers
from fem_spa.calibration.fe_response import Design, Response, respond
from fem_spa.deck import Deck
from fem_spa.solid.observe import Observer


@dataclass(frozen=True)
class Trial:
    """What a run needs, as plain data.

    deck : as calibrated;  names : that vary;  values : name -> SI
    design : load points;  outputs : that are compared
    """

    deck: Deck
    names: tuple[str, ...]
    values: Mapping[str, float]
    design: Design
    outputs: tuple[str, ...]


def try_values(trial: Trial) -> Response:
    """The response of a trial whose deck is not prepared yet; raises as `response`."""
    return response(numbers(trial.deck, trial.names), trial.values, trial.design, trial.outputs)


def response(
    found: Numbers,
    values: Mapping[str, float],
    chosen: Design,
    outputs: tuple[str, ...],
    observers: Sequence[Observer] = (),
) -> Response:
    """One FE run at these values (SI), derivatives to d(log) of each number but lengths and offset.

    Raises
    ------
    fe_response.RunFailed, KeyboardInterrupt, InputError
    """
    problem = found.problem(values)
    knobs = found.knobs(problem)
    answer = respond(problem, found.setup.steps, chosen, outputs, knobs, observers)
    scale = np.array([found.per_log(k.name, values[k.name]) for k in knobs])
    return replace(answer, by_knob=answer.by_knob * scale.reshape(-1, 1, 1))
