"""From fitted sets to a decision: how much each explains, what is left, who the rivals are.

Everything is measured on left-out folds under one noise, that of what remains when both the best set and the
reference learner are taken off. A set's share is (E0 - E) / (E0 - floor), E0 the error of the base alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.form import Freedom, contributions, formed, freedom
from fem_spa.loop.gates import gates
from fem_spa.loop.learner import Learned, learn
from fem_spa.loop.mcs import confidence_set
from fem_spa.loop.noise import Noise, Whitener, between, fit_noise, repeating
from fem_spa.loop.placebo import OF_THE_SESSION
from fem_spa.loop.screen import base_columns
from fem_spa.loop.search import FoldErrors, Found, Trial, fold_errors, several_records
from fem_spa.loop.signatures.unmarked import unmarked

TOLERANCE = 0.05
"""Sets within this share of the best's explained error stay rivals: the true law is never the library's."""
LEAST_SHARE = 0.62
"""A set that explains less of what is predictable explains only part."""
LEAST_OWN = 0.1
"""Share that an effect of a set counts as adding at least, where its rivals are compared with it."""
LEAST_OF_SET, LEAST_OF_THREE = 0.9, 0.94
"""The same for two effects and for three, which imitate more."""
LEAST_BEFORE = 0.8
"""Share from which a smaller set stands where the larger one that goes beyond it explains too little."""
LEAST_BETWEEN = 12.0
"""By how much one more effect must lessen the squares of what differs between records, in whitened units, or
-2 log likelihood where it takes up all that was left."""
STEP_FORM = 0.15
"""Size of an effect's contribution, as a share of the largest one's, below which it is no more than another
form of that one's law."""
TAKEN_WHOLE, LEAST_TAKEN = 0.12, 0.005
"""Share of what was left that one more effect may leave, and least share that it then adds, where the form of
the others' laws will not do for an account of it: what is another law's form no effect takes up whole."""
MOST_FORMED = 6
"""Sets of a size that are looked at with their laws free."""
ENOUGH = 0.94
"""Share from which what is left of two effects is no more than their laws' form, and no third is sought but
one that takes it up whole."""
LEAST_NEED = 20.0
"""By how much -2 log likelihood must rise when an effect of a set is taken away."""
STEP_REST = 0.45
"""What one more effect must take of what was left before it."""

USUAL_COLOURED = 0.005
"""Share of the span: coloured noise beyond this is suspected to be structure."""
LEAST_VISIBLE = 0.003
"""Share of the span below which a change of the prediction by an effect is not worth a name."""
LARGEST_WITHIN = 0.01
"""Share of the span above which what is left within records, their own offset and gain aside, is no noise."""
LEAST_OF_BOTH = 0.5
"""What the whitened and the plain share must each reach."""
MCS_LEVEL = 0.1
"""Of the model confidence set."""
LARGEST_NOISE = 0.025
"""Share of the span above which a remainder is not taken for noise, whatever its colour."""


@dataclass(frozen=True)
class Scored:
    """A trial with its errors on left-out folds.

    Attributes
    ----------
    share : of the predictable error that it explains
    errors : whitened, by folds
    least : the smaller of the whitened and the plain share, of which `share` is the mean
    """

    trial: Trial
    share: float
    errors: FoldErrors
    least: float


@dataclass(frozen=True)
class Decision:
    """What may be said.

    Attributes
    ----------
    verdict : of the contract
    chosen : the set that is named, () where none is
    rivals : effect -> those that do as well in its place, best first
    scored : all sets, best first
    share : of the predictable error that the best set explains
    left : share that the learner still finds after it
    detected : whether there is anything beyond noise
    learned : the learner on what the best set leaves
    noise : of what remains
    reasons : gates that were not passed, in words
    """

    verdict: str
    chosen: tuple[str, ...]
    rivals: dict[str, list[str]]
    scored: list[Scored]
    share: float
    left: float
    detected: bool
    learned: Learned
    noise: Noise
    best: Scored
    reasons: tuple[str, ...]


def decide(chain: Chain, data: Data, found: Found, provisional: bool, seed: int) -> Decision:
    """Decide; see the module."""
    runs = tuple(i for i, run in enumerate(data.runs) if run.train)
    plain = chain.response(data, chain.thetas, chain.base.values)
    level = chain.gain * (plain - chain.rest)
    lead = min(found.trials.values(), key=lambda t: t.cost + 12.0 * len(t.names))
    learned, noise = _reference(chain, data, lead, level, runs)
    whiten = Whitener(data, repeating(noise, level), level, runs)
    errors = {names: fold_errors(trial, data, whiten) for names, trial in found.trials.items()}
    plain_share = _plain_shares(found, data, noise, level, runs)
    sizes = {names: _size(e) for names, e in errors.items()}
    samples = float(np.sum(data.known & data.train)) * data.output.shape[1]
    floor = min(_learned_floor(lead, learned, whiten), *sizes.values(), samples)
    span = max(sizes[()] - floor, 1e-12)
    scored = [
        _scored(trial, (sizes[()] - sizes[names]) / span, plain_share[names], errors[names])
        for names, trial in found.trials.items()
    ]
    scored.sort(key=lambda s: -_rank(s, data))
    detected = max(found.score, found.drop) > 1.15 * found.limit + 2.0
    path = _choose(scored, found, level, data, whiten)
    best = path[-1]
    if len(best.trial.names) > 1 and best.share < _enough(best):
        best = next((s for s in path[::-1] if _stands(s)), best)
    marked = set(best.trial.names) - set(unmarked(best.trial.fit.chain, data, noise))
    best = next((s for s in scored if set(s.trial.names) == marked), path[0])
    known = _learnable(chain, data, found, level, runs)
    left = 1.0 - best.share
    large = _relative(found.base, level, data) > LARGEST_NOISE
    large = large or _within(found.base, level, data) > LARGEST_WITHIN
    if not detected or (not best.trial.names and known < 0.15):
        if known >= 0.2 or large:
            return Decision("unexplained", (), {}, scored, best.share, left, True, learned, noise, best, ())
        return Decision("none", (), {}, scored, 0.0, 0.0, False, learned, noise, best, ())
    if best.trial.names and _visible(found.base, best.trial, level, data) < LEAST_VISIBLE and not large:
        return Decision("none", (), {}, scored, 0.0, 0.0, False, learned, noise, best, ())
    if best.share < _enough(best) or best.least < LEAST_OF_BOTH or not best.trial.names:
        words = (f"the best set explains {100 * max(best.share, 0):.0f} % of what is predictable",)
        return Decision("unexplained", (), {}, scored, best.share, left, True, learned, noise, best, words)
    reasons = gates(best.trial, found.base, Whitener(data, noise, level, runs))
    if reasons and known < 0.15 and not large and all(_in_the_session(n) for n in best.trial.names):
        # offsets of records that lie like a trend
        return Decision("none", (), {}, scored, 0.0, 0.0, False, learned, noise, best, ())
    if reasons:
        return Decision("unexplained", (), {}, scored, best.share, left, True, learned, noise, best, reasons)
    rivals = {name: _rivals(name, best, scored, data, seed) for name in best.trial.names}
    odd = any(r not in EFFECTS[name].classmates for name, rs in rivals.items() for r in rs)
    verdict = "ambiguous" if odd or provisional else "attributed"
    return Decision(
        verdict, best.trial.names, rivals, scored, best.share, left, True, learned, noise, best, ()
    )


def _enough(scored: Scored) -> float:
    """Share that a set must explain."""
    return (LEAST_SHARE, LEAST_SHARE, LEAST_OF_SET, LEAST_OF_THREE)[len(scored.trial.names)]


def _stands(scored: Scored) -> bool:
    """Whether a set stands though something goes on beyond it."""
    return bool(scored.trial.names) and scored.share >= max(_enough(scored), LEAST_BEFORE)


def _scored(trial: Trial, whitened: float, plain: float, errors: FoldErrors) -> Scored:
    return Scored(trial, 0.5 * (whitened + plain), errors, min(whitened, plain))


def _within(base: Trial, level: np.ndarray, data: Data) -> float:
    """RMS of the base's residual as a share of the span, every record's own offset and gain aside."""
    total, count = 0.0, 0
    for run in data.runs:
        rows = np.arange(run.part.start, run.part.stop)[data.known[run.part]]
        if not run.train or len(rows) < 3:
            continue
        for j in range(level.shape[1]):
            columns = np.column_stack([level[rows, j], np.ones(len(rows))])
            left = base.fit.residual[rows, j]
            left = left - columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
            total += float(left @ left)
        count += len(rows)
    rows_all = data.train & data.known
    extent = float(np.max(np.ptp(level[rows_all], axis=0))) or 1.0
    return math.sqrt(total / max(count, 1)) / extent


def _plain_shares(
    found: Found, data: Data, noise: Noise, level: np.ndarray, runs: tuple[int, ...]
) -> dict[tuple[str, ...], float]:
    """Share of the plain squared error that each set explains, records' own offsets and gains aside.

    The floor is the white noise with coloured noise of a usual size: what a coloured noise as large as the
    remainder would hide in the whitened shares shows here.
    """
    rows = data.train & data.known
    extent = float(np.max(np.ptp(level[rows], axis=0))) or 1.0
    usual = math.hypot(noise.white, min(noise.coloured, USUAL_COLOURED * extent))
    flat = Whitener(data, Noise(usual, 1e-6 * usual, 1.0, noise.offset, noise.gain), level, runs)
    sizes = {names: float(np.sum(flat(trial.fit.residual) ** 2)) for names, trial in found.trials.items()}
    floor = min(float(np.sum(rows)) * data.output.shape[1], *sizes.values())
    span = max(sizes[()] - floor, 1e-12)
    return {names: (sizes[()] - size) / span for names, size in sizes.items()}


def _visible(base: Trial, best: Trial, level: np.ndarray, data: Data) -> float:
    """RMS of what the effects change on the training rows, as a share of the span."""
    rows = data.train & data.known
    extent = float(np.max(np.ptp(level[rows], axis=0))) or 1.0
    change = base.fit.residual[rows] - best.fit.residual[rows]
    return float(np.sqrt(np.mean(np.sum((change - change.mean(axis=0)) ** 2, axis=1)))) / extent


def _relative(base: Trial, level: np.ndarray, data: Data) -> float:
    """RMS of the base's residual on the training rows, as a share of the span."""
    rows = data.train & data.known
    span = float(np.max(np.ptp(level[rows], axis=0))) or 1.0
    return float(np.sqrt(np.mean(np.sum(base.fit.residual[rows] ** 2, axis=1)))) / span


def _size(errors: FoldErrors) -> float:
    """Squared error of a fit, and what its parameters cost: each takes about two by chance alone."""
    return float(errors.fitted.sum()) + 2.5 * errors.parameters


def _rank(scored: Scored, data: Data) -> float:
    """Share, less a little for each parameter, so that of equals the simpler one is named."""
    names = scored.trial.names
    return (
        scored.share
        - 0.002 * sum(len(EFFECTS[n].parameters) for n in names)
        - 1e-4 * sum(_late(n) for n in names)
        - sum(_untried(n, data) for n in names)
    )


def _untried(name: str, data: Data) -> float:
    """A weight whose inclination was never changed is a static change of shape, and is named after those."""
    turned = len(np.unique(np.round(data.orientation[data.train], 2))) > 1
    weighed = len(np.unique(data.payload[data.train])) > 1
    return 0.03 if EFFECTS[name].family == "load" and not (turned or weighed) else 0.0


def _late(name: str) -> int:
    """Among equals the body's own effects are named before those of the sensor."""
    return 1 if EFFECTS[name].family in ("sensor", "pneumatic") else 0


def _reference(
    chain: Chain, data: Data, lead: Trial, level: np.ndarray, runs: tuple[int, ...]
) -> tuple[Learned, Noise]:
    """The learner on what the lead leaves, and the noise once the lead's own form and that are taken off."""
    own = lead.fit.chain
    noise = lead.noise
    if lead.names:
        free = formed(freedom(own, data), Whitener(data, noise, level, runs)).residual
        noise, _ = fit_noise(data, free, level, runs, noise)
    nuisance = base_columns(own, data, own.response(data, own.thetas, own.base.values))
    learned = learn(chain.context(data), lead.fit.residual, Whitener(data, noise, level, runs), nuisance)
    if learned.gain <= 0.02:
        return learned, noise
    noise, _ = fit_noise(data, lead.fit.residual - learned.prediction, level, runs, noise)
    again = learn(chain.context(data), lead.fit.residual, Whitener(data, noise, level, runs), nuisance)
    return again, noise


def _learned_floor(lead: Trial, learned: Learned, whiten: Whitener) -> float:
    return float(learned.after.sum()) if learned.gain > 0.0 else float(np.sum(whiten(lead.fit.residual) ** 2))


def _learnable(chain: Chain, data: Data, found: Found, level: np.ndarray, runs: tuple[int, ...]) -> float:
    """Share of the base's own whitened error that the learner predicts on left-out folds."""
    base = found.base
    nuisance = base_columns(chain, data, chain.response(data, chain.thetas, chain.base.values))
    learned = learn(chain.context(data), base.fit.residual, Whitener(data, base.noise, level, runs), nuisance)
    better = float(np.mean(learned.after < learned.before))
    return learned.gain if better > 0.7 else min(learned.gain, 0.0)


def _choose(
    scored: Sequence[Scored], found: Found, level: np.ndarray, data: Data, whiten: Whitener
) -> list[Scored]:
    """From nothing to the smallest set that no larger one beats by enough, its laws free to take another
    form."""
    free: dict[tuple[str, ...], Freedom] = {}
    metrics = [_Metric(whiten, free, {})]
    if several_records(data):
        slow = between(whiten.noise, level, data)
        metrics.append(_Metric(Whitener(data, slow, level, whiten.runs), free, {}))
    best = next(s for s in scored if not s.trial.names)
    path = [best]
    for size in (1, 2, 3):
        options = [s for s in scored if len(s.trial.names) == size]
        options = [s for s in options if not _one_class(s.trial.names)] or (
            options if best.share < LEAST_SHARE else []
        )
        if size == 3 and best.share > ENOUGH:
            options = [s for s in options if _taken_whole(best, s)]
        if not options:
            break
        if size == 1:
            top = max(options, key=lambda s: _rank(s, data))
            best = top if top.share - best.share > 0.0 else best
            path.append(best)
            continue
        wider = [s for s in options if set(best.trial.names) < set(s.trial.names)]
        rounds = [(sorted(options, key=lambda s: -_rank(s, data))[:MOST_FORMED], found.limit + 10.0)]
        rounds.append((wider, LEAST_BETWEEN))
        passed: list[Scored] = []
        for metric, (sets, least) in zip(metrics, rounds, strict=False):
            for wide in metric.better(best, sets, least):
                if wide not in passed and _needed(best, wide, scored, found, level, data):
                    passed.append(wide)
        if not passed:
            break
        best = max(passed, key=lambda s: _rank(s, data))
        path.append(best)
    return path


@dataclass(frozen=True)
class _Metric:
    """What sets leave with their laws free, under one noise.

    Attributes
    ----------
    free : names -> what may give way, shared by the metrics
    left : names -> sum of whitened squares, filled as sets are asked for
    """

    whiten: Whitener
    free: dict[tuple[str, ...], Freedom]
    left: dict[tuple[str, ...], float]

    def of(self, scored: Scored) -> float:
        """Squares that a set leaves."""
        names = scored.trial.names
        if names not in self.left:
            if names not in self.free:
                self.free[names] = freedom(scored.trial.fit.chain, self.whiten.data)
            self.left[names] = formed(self.free[names], self.whiten).left
        return self.left[names]

    def better(self, best: Scored, options: Sequence[Scored], least: float) -> list[Scored]:
        """The options that take enough of what `best` leaves."""
        if not options:
            return []
        start, floor = self.of(best), min(self.of(s) for s in options)
        enough = max(least, STEP_REST * (start - floor))
        return [s for s in options if start - self.of(s) >= enough]


def _needed(
    best: Scored, top: Scored, scored: Sequence[Scored], found: Found, level: np.ndarray, data: Data
) -> bool:
    """Whether a larger set is likelier by enough, changes the prediction by enough, and each effect
    matters."""
    least = LEAST_BETWEEN if _taken_whole(best, top) else found.limit + 10.0
    if best.trial.cost - top.trial.cost < least or not _each_needed(top, scored):
        return False
    more = set(top.trial.names) - set(best.trial.names)
    if not any(_in_the_session(n) for n in more) and not _no_form(best, top):
        return False
    rows = data.train & data.known
    extent = float(np.max(np.ptp(level[rows], axis=0))) or 1.0
    parts = contributions(top.trial.fit.chain, data)
    return float(parts.min()) >= max(LEAST_VISIBLE * extent, STEP_FORM * float(parts.max()))


def _taken_whole(less: Scored, more: Scored) -> bool:
    """Whether the larger set takes up all that the smaller one leaves."""
    left = 1.0 - less.share
    return more.share - less.share >= LEAST_TAKEN and 1.0 - more.share <= TAKEN_WHOLE * left


def _no_form(less: Scored, more: Scored) -> bool:
    """Whether the larger set explains more than another form of the smaller one's laws would."""
    return more.share - less.share >= STEP_FORM**2 or _taken_whole(less, more)


def _one_class(names: Sequence[str]) -> bool:
    """Whether two of the effects are declared to look alike: then one of them is enough."""
    return any(b in EFFECTS[a].classmates for a in names for b in names)


def _each_needed(top: Scored, scored: Sequence[Scored]) -> bool:
    """Whether the set loses enough when any of its effects is taken away and the others take over what they
    can."""
    for name in top.trial.names:
        kept = set(top.trial.names) - {name}
        without = next((s for s in scored if set(s.trial.names) == kept), None)
        if without is None:
            continue
        if without.trial.cost - top.trial.cost < (0.5 if _taken_whole(without, top) else 1.0) * LEAST_NEED:
            return False
        if not _in_the_session(name) and not _no_form(without, top):
            return False
    return True


def _in_the_session(name: str) -> bool:
    """Whether an effect changes little within a record, so that the shares, measured there, tell little of
    it."""
    return EFFECTS[name].memory in OF_THE_SESSION


def _rivals(name: str, best: Scored, scored: Sequence[Scored], data: Data, seed: int) -> list[str]:
    """Effects that do as well in the place of `name`: within the tolerance for form, or not told apart from
    it on records left out (model confidence set) while they explain nearly as much."""
    others = set(best.trial.names) - {name}
    alone = [s.share for s in scored if set(s.trial.names) == others]
    # what it adds to the rest of the set is what a rival must add as well
    own = float(np.clip(best.share - max(alone, default=0.0), LEAST_OWN, 1.0))
    options: list[tuple[str, Scored]] = []
    for s in scored:
        extra = set(s.trial.names) - others
        if len(s.trial.names) == len(best.trial.names) and others <= set(s.trial.names) and len(extra) == 1:
            rival = extra.pop()
            if rival != name and s.share >= best.share - TOLERANCE * own:
                options.append((rival, s))
    losses = np.stack([best.errors.blocks, *(s.errors.blocks for _, s in options)])
    kept, _ = confidence_set(np.log(losses + 1e-12 * losses.max() + 1e-300), MCS_LEVEL, seed)
    found: dict[str, float] = {}
    for place, (rival, s) in enumerate(options, 1):
        form = min(TOLERANCE, 0.01 + 2.0 * max(1.0 - best.share, 0.0))
        if s.share >= best.share - form * own or place in kept:
            found[rival] = max(found.get(rival, -1.0), s.share)
    if name == "temperature" and data.temperature is None:
        for mate in EFFECTS[name].classmates:
            found.setdefault(mate, 0.0)
    return sorted(found, key=lambda r: -found[r])
