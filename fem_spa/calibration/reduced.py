"""A reduced model's parameters from FE curves or records: bounded least squares.

Residuals of several outputs of one unit are taken as they are; of different units, each over its range.
A parameter with a positive lower bound and a wide range is fitted in its logarithm. A parameter that the fit
drives to its bound is not accepted: it keeps its starting value, the rest is fitted anew, and what it wanted
is reported with the effects that it may stand for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fem_spa.calibration.bounds import missing_effect, plausible
from fem_spa.calibration.least_squares import Spread, spread, systematic
from fem_spa.calibration.observation import UNITS, Run
from fem_spa.calibration.outcome import Fitted, Outcome, beyond, range_of, rmse, source_of, span_of
from fem_spa.errors import InputError
from fem_spa.reduced.model import Drive, ReducedModel
from fem_spa.reduced.tables import factor

if TYPE_CHECKING:
    from fem_spa.calibration.carried import Carried

_AT_BOUND = 1e-3  # of the working range
_WIDE = 20.0  # high over low from which on the logarithm is fitted


@dataclass(frozen=True)
class _Scale:
    """Working coordinate of one parameter: its logarithm, or itself over its size.

    shift : added, so that one which starts from zero is not moved by steps relative to nothing
    """

    log: bool
    unit: float
    shift: float = 0.0

    def to(self, value: float) -> float:
        return math.log(value) if self.log else value / self.unit + self.shift

    def back(self, z: float) -> float:
        return math.exp(z) if self.log else (z - self.shift) * self.unit


def calibrate(
    model: ReducedModel,
    train: Sequence[Run],
    held: Sequence[Run],
    vary: Sequence[str],
    say: Callable[[str], None] = lambda text: None,
    source: str = "",
    output: str | None = None,
    through: Carried | None = None,
) -> tuple[ReducedModel, Outcome]:
    """Fit parameters of a reduced model.

    Parameters
    ----------
    train, held : fitted, and never looked at before the error is told
    vary : names of parameters
    say : told of the progress
    source : what the data are, for the range kept with the model; default the files' names
    output : the one output that is compared; default: see `shared_outputs`
    through : effects around the model, held as they are

    Returns
    -------
    The calibrated model, and the outcome; `model_table` makes its file, with range and intervals

    Raises
    ------
    InputError
        An unknown parameter, other chambers or outputs than the data's, a static curve for one that creeps
    """
    for name in vary:
        if name not in model.parameters:
            from fem_spa.deck import nearest

            there = nearest(name, model.parameters)
            raise InputError(f"given --vary {name}: kind '{model.kind}' has no such parameter{there}")
    outputs = shared_outputs(model, [*train, *held], output)
    if through is not None and not set(outputs) <= set(through.outputs):
        raise InputError(
            f"given {', '.join(outputs)} to compare: the effects of the model file "
            f"({', '.join(through.effects)}) act on {', '.join(through.outputs)}; "
            f"give --output {through.outputs[0]}"
        )
    _check(model, [*train, *held])
    count = [0]

    def respond(candidate: ReducedModel, runs: Sequence[Run]) -> list[np.ndarray]:
        count[0] += 1
        if through is not None:
            return through.predicted(candidate, runs, outputs)
        return [predicted(candidate, run, outputs) for run in runs]

    def errors(candidate: ReducedModel, runs: Sequence[Run]) -> list[np.ndarray]:
        told = respond(candidate, runs)
        return [rows - measured(run, outputs) for rows, run in zip(told, runs, strict=True)]

    weights = _weights(train, outputs)
    before = errors(model, train), errors(model, held)
    free, refused = list(vary), {}
    iterations = 0
    status = "done"
    fitted, found = model, None
    while free:
        try:
            fitted, found = _fit(model, respond, train, outputs, free, weights, count, say)
        except _Interrupted as stop:
            status, fitted = "interrupted", stop.reached
            break
        iterations += found.iterations
        leaving = [name for name in free if found.wanted[name] is not None]
        if not leaving:
            break
        for name in leaving:
            refused[name] = found.wanted[name]
        free = [name for name in free if name not in leaving]
        fitted, found = model, None
    after = errors(fitted, train), errors(fitted, held)
    numbers = [_number(model, fitted, name, found, refused) for name in vary]
    if refused and status == "done":
        status = "missing effect"
    error = rmse(after[1])
    source = source or source_of(train)
    valid = range_of(train, error, source)
    roles = [(run, "train") for run in train] + [(run, "heldout") for run in held]
    pairs = zip([*before[0], *before[1]], [*after[0], *after[1]], strict=True)
    outcome = Outcome(
        model.kind,
        status,
        numbers,
        outputs,
        (rmse(before[0]), rmse(before[1])),
        (rmse(after[0]), error),
        span_of([*train, *held], outputs),
        valid,
        [(run, role, rmse([b]), rmse([a])) for (run, role), (b, a) in zip(roles, pairs, strict=True)],
        count[0],
        iterations,
        [
            (b + measured(run, outputs), a + measured(run, outputs))
            for (run, _), b, a in zip(roles, [*before[0], *before[1]], [*after[0], *after[1]], strict=True)
        ],
        np.zeros((0, 0)) if found is None else found.told.correlation,
        beyond(held, valid),
        [f"{run.name}: {note}" for run in (*train, *held) for note in run.notes],
        () if through is None else through.effects,
    )
    outcome.warnings += _doubts(free, found)
    if found is not None:
        outcome.warnings += systematic(found.told, outcome.after[0], outcome.span)
    return fitted, outcome


def predicted(model: ReducedModel, run: Run, outputs: Sequence[str]) -> np.ndarray:
    """(n, outputs) SI at the rows that count; a static run takes the model's equilibria where it has them."""
    names = [o.name for o in model.outputs]
    settled = getattr(model, "settled", None)
    if run.static and settled is not None:
        drive = run.drive
        values = settled(drive.pressure[run.use], drive.orientation, drive.payload)
        return np.asarray(values)[:, [names.index(name) for name in outputs]]
    drive = run.drive
    if run.static:
        drive = Drive(drive.time, drive.pressure, drive.orientation, drive.payload)
    values = model.simulate(drive)[run.use]
    return np.asarray(values)[:, [names.index(name) for name in outputs]]


def measured(run: Run, outputs: Sequence[str]) -> np.ndarray:
    """(n, outputs) SI at the rows that count."""
    return np.column_stack([run.outputs[name][run.use] for name in outputs])


def shared_outputs(model: ReducedModel, runs: Sequence[Run], wanted: str | None = None) -> tuple[str, ...]:
    """What is compared: `wanted`, else x, y, z of a model that gives no more, else the first shared one."""
    names = [o.name for o in model.outputs]
    shared = tuple(name for name in names if all(name in run.outputs for run in runs))
    if wanted is not None:
        if wanted not in shared:
            there = ", ".join(shared) or "none"
            raise InputError(f"given --output {wanted}: model and records share {there}")
        return (wanted,)
    if not shared:
        have = ", ".join(sorted(set.intersection(*[set(run.outputs) for run in runs]))) or "nothing in common"
        raise InputError(
            f"kind '{model.kind}' gives {', '.join(names)}, the records have {have}: there is nothing to fit"
        )
    return shared if set(names) <= set("xyz") else shared[:1]


def _check(model: ReducedModel, runs: Sequence[Run]) -> None:
    for run in runs:
        if run.drive.pressure.shape[1] != model.chambers:
            raise InputError(
                f"{run.path} has {run.drive.pressure.shape[1]} pressures, kind '{model.kind}' takes "
                f"{model.chambers}"
            )
        if run.static and model.kind == "kelvin-voigt":
            raise InputError(
                f"{run.path} is a static curve: creep shows over time only; give records with 'time [s]'"
            )


def _weights(runs: Sequence[Run], outputs: Sequence[str]) -> np.ndarray:
    """(outputs,) 1 / scale: ranges where the units differ."""
    if len({UNITS[name] for name in outputs}) == 1:
        return np.full(len(outputs), 1.0 / max(span_of(runs, outputs), 1e-300))
    return np.array([1.0 / max(span_of(runs, [name]), 1e-300) for name in outputs])


class _Interrupted(Exception):
    """Ctrl-C; `reached` is the best model so far."""

    def __init__(self, reached: ReducedModel) -> None:
        super().__init__("interrupted")
        self.reached = reached


@dataclass(frozen=True)
class _Found:
    interval: dict[str, tuple[float, float]]
    wanted: dict[str, float | None]
    told: Spread
    iterations: int


def _fit(
    model: ReducedModel,
    respond: Callable[[ReducedModel, Sequence[Run]], list[np.ndarray]],
    runs: Sequence[Run],
    outputs: tuple[str, ...],
    free: Sequence[str],
    weights: np.ndarray,
    count: list[int],
    say: Callable[[str], None],
) -> tuple[ReducedModel, _Found]:
    from scipy.optimize import least_squares

    scales = {name: _scale(model, name) for name in free}
    low = np.array([_end(model, scales[name], name, 0) for name in free])
    high = np.array([_end(model, scales[name], name, 1) for name in free])
    start = np.array([scales[name].to(model.parameters[name].value) for name in free])
    inside = 1e-9 * (high - low)
    start = np.clip(start, low + inside, high - inside)
    targets = [measured(run, outputs) for run in runs]
    keep = [np.isfinite(target) for target in targets]
    parts = [int(k[:, j].sum()) for k in keep for j in range(len(outputs))]

    def candidate(z: np.ndarray) -> ReducedModel:
        values = {
            name: float(np.clip(scales[name].back(x), *_ends(model, name)[:2]))
            for name, x in zip(free, z, strict=True)
        }
        return model.with_values(**values)

    best, reached = [math.inf], [start]

    def residual(z: np.ndarray) -> np.ndarray:
        pieces = []
        told = respond(candidate(z), runs)
        for rows, target, good in zip(told, targets, keep, strict=True):
            error = (rows - target) * weights
            pieces += [error[good[:, j], j] for j in range(len(outputs))]
        r = np.concatenate(pieces)
        size = math.sqrt(float(np.mean(r**2)))
        if size < best[0]:
            better = size < 0.99 * best[0]
            best[0], reached[0] = size, z
            if better:
                say(f"{count[0]} simulations, error {100 * size:.3g} % of the range")
        return r

    options: dict[str, Any] = {
        "x_scale": "jac",
        "diff_step": 1e-5,
        "max_nfev": 60,
        "ftol": 1e-10,
        "xtol": 1e-9,
    }
    try:
        answer = least_squares(residual, start, bounds=(low, high), **options)
    except KeyboardInterrupt:
        raise _Interrupted(candidate(reached[0])) from None
    told = spread(answer.jac, answer.fun, parts)
    interval: dict[str, tuple[float, float]] = {}
    wanted: dict[str, float | None] = {}
    at_end = (answer.x - low < _AT_BOUND * (high - low)) | (high - answer.x < _AT_BOUND * (high - low))
    pull = -np.linalg.pinv(answer.jac) @ answer.fun
    for k, name in enumerate(free):
        scale = scales[name]
        ends = [scale.back(max(min(answer.x[k] + s * told.half[k], 700.0), -700.0)) for s in (-1.0, 1.0)]
        interval[name] = (
            (min(ends), max(ends))
            if np.isfinite(told.half[k])
            else (0.0 if scale.log else -math.inf, math.inf)
        )
        outward = pull[k] * (1.0 if high[k] - answer.x[k] < answer.x[k] - low[k] else -1.0) > 0
        wanted[name] = None
        if at_end[k] and outward:
            beyond_it = answer.x[k] + pull[k]
            wanted[name] = scale.back(min(beyond_it, answer.x[k] + 5.0) if scale.log else beyond_it)
    return candidate(answer.x), _Found(interval, wanted, told, int(answer.nfev))


def _scale(model: ReducedModel, name: str) -> _Scale:
    p = model.parameters[name]
    if p.low > 0 and p.value > 0 and p.high / p.low > _WIDE:
        return _Scale(True, 1.0)
    unit = abs(p.value) or factor(p.unit)
    return _Scale(False, unit, 0.0 if p.value else 1.0)


def _ends(model: ReducedModel, name: str) -> tuple[float, float, str]:
    p = model.parameters[name]
    return plausible(name, p.value, p.low, p.high, model.kind)


def _end(model: ReducedModel, scale: _Scale, name: str, which: int) -> float:
    end = float(_ends(model, name)[which])
    return scale.to(end) if np.isfinite(end) else math.copysign(1e12, end)


def _number(
    model: ReducedModel,
    fitted: ReducedModel,
    name: str,
    found: _Found | None,
    refused: dict[str, float | None],
) -> Fitted:
    p = model.parameters[name]
    value = fitted.parameters[name].value
    low, high = (-math.inf, math.inf)
    if found is not None and name in found.interval:
        low, high = map(float, found.interval[name])
    least, most, why = _ends(model, name)
    number = Fitted(name, p.unit, p.value, float(value), low, high, (least, most), refused.get(name))
    if name in refused:
        number = replace(number, why=why, advice=missing_effect(name, model.kind))
    return number


def _doubts(free: Sequence[str], found: _Found | None) -> list[str]:
    """Pairs of parameters that these data cannot tell apart, and parameters that they do not see."""
    if found is None:
        return []
    out = []
    for i, name in enumerate(free):
        if not all(map(math.isfinite, found.interval[name])):
            out.append(f"these data do not determine {name}: leave it out, or add data in which it acts")
        for j in range(i):
            if abs(found.told.correlation[i, j]) > 0.99:
                out.append(
                    f"these data hardly tell {free[j]} from {name} (correlation "
                    f"{found.told.correlation[i, j]:.3f}): vary one of them"
                )
    return out


def model_table(fitted: ReducedModel, outcome: Outcome) -> dict[str, Any]:
    """The `[model]` table of a calibrated model: intervals, range of validity, where the numbers are from."""
    from fem_spa.reduced.tables import shown

    table = fitted.table()
    intervals = dict(table.get("intervals", {}))
    sources = dict(table.get("sources", {}))
    for number in outcome.parameters:
        if number.refused:
            continue
        table[number.name] = shown(number.value, number.unit) if number.unit else number.value
        sources[number.name] = f"calibrated: {outcome.valid.source}"
        if math.isfinite(number.low) and math.isfinite(number.high):
            ends = (number.low, number.high)
            intervals[number.name] = [shown(x, number.unit) if number.unit else x for x in ends]
    first = fitted.outputs[0]
    valid = {end: [shown(p, "kPa") for p in getattr(outcome.valid, end)] for end in ("low", "high")}
    extra = {"source": outcome.valid.source}
    if outcome.valid.error is not None and math.isfinite(outcome.valid.error):
        error = shown(
            outcome.valid.error, next(o.unit for o in fitted.outputs if o.name == outcome.outputs[0])
        )
        if first.name == outcome.outputs[0]:
            extra["error"] = error
        else:  # a range's error is in the unit of the model's first output
            extra["source"] += f"; error {error} of {outcome.outputs[0]}"
    return (
        table
        | ({"intervals": intervals} if intervals else {})
        | ({"sources": sources} if sources else {})
        | {"valid": valid | extra}
    )
