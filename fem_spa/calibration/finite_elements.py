"""Numbers of an FE deck from measured records: Gauss-Newton with the solver's own derivatives.

Each iteration is one FE run along the records' pressures; its derivatives to every number (but the lengths of
a drawing) come with it. Numbers are fitted in their logarithm, a step changes none by more than 1.65 times,
bounds are those of bounds.py; a step that does not lower the error, or whose run fails, is halved. A length
of a built-in shape takes one more run (5 % longer, drawn and meshed anew, beside the first run) for its
derivative, kept from then on; the mesh's own change is part of that difference.

A number that the fit drives to its bound is not accepted: see reduced.py.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fem_spa.calibration.bounds import bounds_of, missing_effect
from fem_spa.calibration.deck_numbers import OFFSET, Numbers, numbers
from fem_spa.calibration.fe_response import Design, Response, RunFailed, design
from fem_spa.calibration.least_squares import Spread, spread, systematic
from fem_spa.calibration.observation import Run
from fem_spa.calibration.outcome import Fitted, Outcome, beyond, range_of, rmse, source_of, span_of
from fem_spa.calibration.reduced import measured
from fem_spa.calibration.trial import Trial, try_values
from fem_spa.calibration.trial import response as response_at
from fem_spa.deck import Deck
from fem_spa.engine import open_engine
from fem_spa.errors import InputError
from fem_spa.solid.observe import Observer

MOST_RUNS = 12
_MOST_STEP = 0.5  # of a logarithm
_LENGTH_STEP = 0.05
_ENOUGH = 1e-3  # relative change of the error, and of every logarithm, at which the fit ends


@dataclass
class _Work:
    """State of a fit: the deck's numbers, the data, and what the runs have cost.

    lengths : name -> of each training run (n, outputs), derivative to the logarithm of a drawing's length
    """

    found: Numbers
    train: Sequence[Run]
    chosen: Design
    outputs: tuple[str, ...]
    weights: np.ndarray
    observers: Sequence[Observer]
    say: Callable[[str], None]
    runs: int = 0
    reached: tuple[dict[str, float], Response] | None = None
    lengths: dict[str, list[np.ndarray]] = field(default_factory=dict)


def calibrate_deck(
    deck: Deck,
    train: Sequence[Run],
    held: Sequence[Run],
    vary: Sequence[str],
    say: Callable[[str], None] = lambda text: None,
    observers: Sequence[Observer] = (),
    source: str = "",
    output: str | None = None,
) -> tuple[Numbers, dict[str, float], Outcome, Response]:
    """Fit numbers of a deck to records.

    Parameters
    ----------
    deck : its pressures and load points are replaced by those of the records
    train, held : fitted, and never looked at before the error is told
    vary : `materials.body.C10`, `materials.body.scale`, `layers.paper.modulus`, `walls.scale`,
        `geometry.LENGTH`, `offset`
    observers : of every FE run
    output : the one output that is compared; default angle, displacement, or x, y, z of the tip

    Returns
    -------
    The deck's numbers, their calibrated values (SI), the outcome, and the response at those values

    Raises
    ------
    InputError
        A name that the deck does not have, records that do not fit it, a first run that fails
    """
    found = numbers(deck, vary)
    both = [*train, *held]
    outputs = _outputs(both, found, output)
    chosen = design(found.setup.problem.mesh.cavities, both)
    scale = 1.0 / max(span_of(train, outputs), 1e-300)
    work = _Work(found, train, chosen, outputs, np.full(len(outputs), scale), observers, say)
    values = dict(found.start)
    from fem_spa.run import listen

    listen()
    try:
        first = _first(work, values)
    except RunFailed as stop:
        raise InputError(f"the deck does not reach the pressures of the records: {stop}") from None
    flip = _turned(first, train, outputs)
    if flip:
        train, held = [_flipped(r) for r in train], [_flipped(r) for r in held]
        work.train = train
    free = list(vary)
    refused: dict[str, float] = {}
    told: Spread | None = None
    status, iterations, response = "done", 0, first
    while free:
        try:
            values, response, told, wanted, steps = _descend(work, dict(found.start), first, free)
        except KeyboardInterrupt:
            status, told = "interrupted", None
            values, response = work.reached or (dict(found.start), first)
            break
        iterations += steps
        if not wanted:
            break
        refused |= wanted
        free = [name for name in free if name not in wanted]
        work.reached = None
        values, response, told = dict(found.start), first, None
    if refused and status == "done":
        status = "missing effect"
    outcome = _outcome(work, held, first, response, values, free, refused, told, status, iterations, source)
    if flip:
        outcome.notes.append("the records count the angle the other way round than the deck: it was turned")
    return found, values, outcome, response


def _outputs(runs: Sequence[Run], found: Numbers, wanted: str | None = None) -> tuple[str, ...]:
    """What is fitted: angle where all runs have it, else displacement, else the tip's x, y, z, else force."""
    common = set.intersection(*[set(run.outputs) for run in runs])
    problem = found.setup.problem
    if wanted is not None:
        if wanted not in common:
            raise InputError(f"given --output {wanted}: the records have {', '.join(sorted(common))}")
        return (wanted,)
    if "force" in common and (problem.blocked or problem.loads.tip_displacement is not None):
        return ("force",)
    for choice in (("angle",), ("displacement",), ("x", "y", "z")):
        if common >= set(choice):
            return choice
    have = ", ".join(sorted(common)) or "no output in common"
    raise InputError(f"the records have {have}; a deck gives angle, displacement or x, y, z of a free tip")


def _turned(first: Response, runs: Sequence[Run], outputs: tuple[str, ...]) -> bool:
    if outputs != ("angle",):
        return False
    sign = 0.0
    for run in runs:
        got, want = first.at(run)[0][:, 0], run.outputs["angle"][run.use]
        sign += float(np.nansum(got * want))
    return sign < 0


def _flipped(run: Run) -> Run:
    return replace(run, outputs={**run.outputs, "angle": -run.outputs["angle"]})


def _run(work: _Work, values: dict[str, float]) -> Response:
    """One FE run at these values."""
    work.runs += 1
    return response_at(work.found, values, work.chosen, work.outputs, work.observers)


def _first(work: _Work, values: dict[str, float]) -> Response:
    """The run at the deck's own values, and beside it those with a length of the drawing changed, which need
    not wait for it: each in a process of its own, as many at a time as there are cores."""
    if not work.found.lengths:
        return _run(work, values)
    longer = {name: {**values, name: values[name] * (1 + _LENGTH_STEP)} for name in work.found.lengths}
    tasks = [
        Trial(work.found.deck, work.found.names, v, work.chosen, work.outputs)
        for v in (values, *longer.values())
    ]
    work.say(f"{len(tasks)} FE runs: the deck's, and one for each length, {100 * _LENGTH_STEP:.0f} % longer")
    found: dict[int, Response] = {}
    with open_engine(most=len(tasks)) as engine:
        for ended in engine.run(try_values, tasks):
            if ended.error is not None:
                raise ended.error
            work.runs += 1
            found[ended.number] = ended.value
            work.say(f"FE run {work.runs} of {len(tasks)}")
    change = math.log1p(_LENGTH_STEP)
    work.lengths = {
        name: [(found[k].at(run)[0] - found[0].at(run)[0]) / change for run in work.train]
        for k, name in enumerate(longer, 1)
    }
    return found[0]


def _residual(
    work: _Work, response: Response, values: dict[str, float], free: Sequence[str]
) -> tuple[np.ndarray, np.ndarray, list[int]]:
    """Weighted residual (n,), its Jacobian (n, free) to log(number) (offset: to itself over the range)."""
    names = [n for n in work.found.names if n not in work.found.lengths and n != OFFSET]
    residuals, jacobians, parts = [], [], []
    for r, run in enumerate(work.train):
        value, slopes = response.at(run)
        target = measured(run, work.outputs) - values.get(OFFSET, 0.0)
        for j, weight in enumerate(work.weights):
            good = np.isfinite(target[:, j])
            residuals.append((value[good, j] - target[good, j]) * weight)
            columns = []
            for name in free:
                if name == OFFSET:
                    columns.append(np.ones(good.sum()))
                elif name in work.found.lengths:
                    columns.append(work.lengths[name][r][good, j] * weight)
                else:
                    columns.append(slopes[names.index(name)][good, j] * weight)
            jacobians.append(np.column_stack(columns))
            parts.append(int(good.sum()))
    return np.concatenate(residuals), np.concatenate(jacobians), parts


def _descend(
    work: _Work, values: dict[str, float], response: Response, free: list[str]
) -> tuple[dict[str, float], Response, Spread, dict[str, float], int]:
    """Gauss-Newton from `values`; what leaves its bounds, with where it wants to go."""
    from scipy.optimize import lsq_linear

    low, high = _log_bounds(work, free)
    steps = 0
    unit = float(1.0 / work.weights[0])

    def moved(by: np.ndarray) -> dict[str, float]:
        out = dict(values)
        for name, z in zip(free, by, strict=True):
            out[name] = float(values[name] + z * unit if name == OFFSET else values[name] * math.exp(z))
        return out

    r, J, parts = _residual(work, response, values, free)
    while work.runs < MOST_RUNS:
        at = np.array([_log(work, name, values) for name in free])
        room = np.minimum(high - at, _MOST_STEP), np.maximum(low - at, -_MOST_STEP)
        step = lsq_linear(J, -r, bounds=(room[1] - 1e-12, room[0] + 1e-12)).x
        gain = 1.0 - float(np.sum((r + J @ step) ** 2)) / max(float(r @ r), 1e-300)
        largest = float(np.max(np.abs(step)))
        if (gain < _ENOUGH and largest < 0.02) or largest < 1e-6:
            break
        taken = False
        only_offset = all(n == OFFSET for n in free)
        for _ in range(4):
            trial = moved(step)
            try:
                new = response if only_offset else _run(work, trial)
            except (RunFailed, InputError) as stop:
                work.say(f"a trial run failed ({stop}); half the step")
                step = 0.5 * step
                continue
            rn, Jn, _ = _residual(work, new, trial, free)
            if float(rn @ rn) < float(r @ r):
                taken = True
                break
            if work.runs >= MOST_RUNS:
                break
            step = 0.5 * step
        steps += 1
        if not taken:
            break
        small = np.max(np.abs(step)) < _ENOUGH or 1.0 - float(rn @ rn) / float(r @ r) < _ENOUGH
        values, response, r, J = trial, new, rn, Jn
        work.reached = values, response
        error = math.sqrt(float(np.mean(r**2)))
        work.say(f"FE run {work.runs}: error {100 * error:.3g} % of the range; {_words(work, values, free)}")
        if small:
            break
    told = spread(J, r, parts)
    return values, response, told, _leaving(work, values, free, low, high, J, r), steps


def _words(work: _Work, values: dict[str, float], free: Sequence[str]) -> str:
    return ", ".join(
        f"{name} {values[name] / work.found.start[name]:.3g} times" for name in free if name != OFFSET
    )


def _log(work: _Work, name: str, values: dict[str, float]) -> float:
    """Working coordinate: the logarithm of the change, an offset over the range."""
    if name == OFFSET:
        return values[name] * float(work.weights[0])
    return math.log(values[name] / work.found.start[name])


def _log_bounds(work: _Work, free: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    low, high = [], []
    for name in free:
        if name == OFFSET:
            low.append(-1.0)
            high.append(1.0)
            continue
        b = bounds_of(name, work.found.unit[name])
        low.append(math.log(b.low))
        high.append(math.log(b.high))
    return np.array(low), np.array(high)


def _leaving(work, values, free, low, high, J, r) -> dict[str, float]:
    """Numbers at a bound that would go further: where to."""
    out = {}
    pull = -np.linalg.pinv(J) @ r
    for k, name in enumerate(free):
        at = _log(work, name, values)
        if (high[k] - at < 1e-3 and pull[k] > 1e-3) or (at - low[k] < 1e-3 and pull[k] < -1e-3):
            further = at + float(np.clip(pull[k], -3.0, 3.0))
            out[name] = (
                further / work.weights[0] if name == OFFSET else work.found.start[name] * math.exp(further)
            )
    return out


def _outcome(
    work: _Work,
    held: Sequence[Run],
    first: Response,
    last: Response,
    values: dict[str, float],
    free: Sequence[str],
    refused: dict[str, float],
    told: Spread | None,
    status: str,
    iterations: int,
    source: str,
) -> Outcome:
    def errors(response: Response, runs: Sequence[Run], at: dict[str, float]) -> list[np.ndarray]:
        offset = at.get(OFFSET, 0.0)
        return [response.at(run)[0] + offset - measured(run, work.outputs) for run in runs]

    train, found = work.train, work.found
    before = errors(first, train, dict(found.start)), errors(first, held, dict(found.start))
    after = errors(last, train, values), errors(last, held, values)
    parameters = []
    for name in found.names:
        half = math.inf
        if told is not None and name in free:
            half = float(told.half[list(free).index(name)])
        unit = {"output": "deg" if work.outputs == ("angle",) else "mm", "1": ""}.get(
            found.unit[name], found.unit[name]
        )
        if name == OFFSET:
            wide = half / float(work.weights[0])
            ends = (float(values[name] - wide), float(values[name] + wide))
            limits = (-1.0 / float(work.weights[0]), 1.0 / float(work.weights[0]))
            why = "not more than the range of the output"
        else:
            b = bounds_of(name, found.unit[name])
            ends = values[name] * math.exp(max(-half, -700.0)), values[name] * math.exp(min(half, 700.0))
            limits, why = (b.low * found.start[name], b.high * found.start[name]), b.why
        number = Fitted(name, unit, found.start[name], values[name], *ends, limits, refused.get(name))
        if name in refused:
            number = replace(number, why=why, advice=missing_effect(name, "finite elements"))
        parameters.append(number)
    error = rmse(after[1])
    source = source or source_of(train)
    valid = range_of(train, error, source)
    pairs = zip([*before[0], *before[1]], [*after[0], *after[1]], strict=True)
    roles = [(run, "train") for run in train] + [(run, "heldout") for run in held]
    outcome = Outcome(
        "finite elements",
        status,
        parameters,
        work.outputs,
        (rmse(before[0]), rmse(before[1])),
        (rmse(after[0]), error),
        span_of([*train, *held], work.outputs),
        valid,
        [(run, role, rmse([b]), rmse([a])) for (run, role), (b, a) in zip(roles, pairs, strict=True)],
        work.runs,
        iterations,
        [
            (b + measured(run, work.outputs), a + measured(run, work.outputs))
            for (run, _), b, a in zip(roles, [*before[0], *before[1]], [*after[0], *after[1]], strict=True)
        ],
        np.zeros((0, 0)) if told is None else told.correlation,
        [*found.setup.warnings, *beyond(held, valid)],
        [f"{run.name}: {note}" for run in (*train, *held) for note in run.notes],
    )
    outcome.warnings += systematic(told, outcome.after[0], outcome.span)
    if told is not None:
        for i, name in enumerate(free):
            for j in range(i):
                if abs(told.correlation[i, j]) > 0.99:
                    outcome.warnings.append(
                        f"these data hardly tell {free[j]} from {name} (correlation "
                        f"{told.correlation[i, j]:.3f}): vary one of them"
                    )
    return outcome
