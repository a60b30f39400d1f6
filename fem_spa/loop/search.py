"""Search: which effects, at most three, account for the residual. Screen, noise path, fits, pairs, swaps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.effects.effect import Effect
from fem_spa.loop.fit import Fit, fit, linear_columns
from fem_spa.loop.folds import folds
from fem_spa.loop.form import form_columns, theta_columns
from fem_spa.loop.noise import Noise, Whitener, between, fit_noise, repeating, scattered
from fem_spa.loop.screen import (
    Atoms,
    Group,
    base_columns,
    left_out,
    make_atoms,
    reduced,
    solve,
    start_of,
    sums,
)
from fem_spa.loop.threshold import null_quantile, scores

SINGLES, PAIRS, MOST = 8, 8, 3
INNER = 3
"""Sets whose parameters are tried again with one effect less."""
BLOCKS = 4
"""Parts of a fold whose left-out errors are told apart."""
Say = Callable[[str], None]


@dataclass(frozen=True)
class Trial:
    """A fitted set of effects.

    Attributes
    ----------
    names : in causal order
    cost : -2 log likelihood with its own noise, which is `noise`
    """

    names: tuple[str, ...]
    fit: Fit
    noise: Noise
    cost: float


@dataclass(frozen=True)
class Found:
    """Everything the search has seen.

    Attributes
    ----------
    base : the base alone
    trials : names -> trial, the base alone under ()
    score, limit : largest score over all atoms, and what chance reaches in one of fifty null data
    drop : by how much -2 log likelihood falls with the best single effect
    atoms : of the screen
    """

    trials: dict[tuple[str, ...], Trial]
    score: float
    limit: float
    drop: float
    atoms: Atoms

    @property
    def base(self) -> Trial:
        return self.trials[()]


@dataclass
class _Work:
    """What the search passes around."""

    chain: Chain
    data: Data
    runs: tuple[int, ...]
    level: np.ndarray
    trials: dict[tuple[str, ...], Trial]

    def whiten(self, noise: Noise) -> Whitener:
        return Whitener(self.data, noise, self.level, self.runs)

    def noise(self, residual: np.ndarray, start: Noise | None) -> tuple[Noise, float]:
        return fit_noise(self.data, residual, self.level, self.runs, start)

    def try_set(
        self, effects: Sequence[Effect], starts: Sequence[np.ndarray], noise: Noise, steps: int = 10
    ) -> Trial:
        """Fit a set, then its noise; the better of this and an earlier fit of the same set is kept."""
        found = fit(self.chain, self.data, self.whiten(repeating(noise, self.level)), effects, starts, steps)
        own, cost = self.noise(found.residual, noise)
        names = tuple(e.name for e in found.chain.effects)
        trial = Trial(names, found, own, cost)
        old = self.trials.get(names)
        if old is None or trial.cost < old.cost:
            self.trials[names] = trial
        return self.trials[names]


def search(chain: Chain, data: Data, effects: Sequence[Effect], seed: int, say: Say) -> Found:
    """Find sets of effects; `chain` is the refitted base alone."""
    runs = tuple(i for i, run in enumerate(data.runs) if run.train)
    plain = chain.response(data, chain.thetas, chain.base.values)
    work = _Work(chain, data, runs, chain.gain * plain - chain.gain * chain.rest, {})
    residual = data.output - (chain.gain * plain + chain.offset)
    noise, cost = work.noise(residual, None)
    work.trials[()] = Trial((), Fit(chain, 0.0, residual, ()), noise, cost)
    if len(chain.base.values):
        # its own numbers under this noise, as with every effect: no effect is credited with them
        chain = work.try_set([], [], noise, 40).fit.chain
        work.chain = chain
        noise, cost = work.trials[()].noise, work.trials[()].cost
        residual = work.trials[()].fit.residual
    say("screening")
    atoms = make_atoms(chain, data, effects)
    whiten = work.whiten(noise)
    first = sums(atoms, whiten)
    whole = np.diag(first.total)[: atoms.count]
    score = float(scores(reduced(first.total, atoms.count), whole).max())
    limit = null_quantile(atoms, whiten, seed)
    best, drop = _noise_path(work, atoms, noise, cost, residual, limit)
    say("fitting single effects")
    ranked = _singles(work, atoms, best)
    for effect, starts in ranked[:SINGLES]:
        for start in starts:
            work.try_set([effect], [start], best)
    single = min((t for n, t in work.trials.items() if len(n) == 1), key=lambda t: t.cost)
    drop = max(drop, cost - single.cost)
    if max(score, drop) > limit:
        say("fitting pairs")
        _pairs(work, atoms, ranked, single, effects)
    return Found(work.trials, score, limit, drop, atoms)


def _noise_path(
    work: _Work, atoms: Atoms, noise: Noise, cost: float, residual: np.ndarray, limit: float
) -> tuple[Noise, float]:
    """Noise once the largest effects are taken off, linearly; and the first fall of -2 log likelihood."""
    chosen: list[Group] = []
    drop = 0.0
    size = noise.sample
    for step in range(MOST):
        picks: dict[str, Group] = {}
        held = repeating(noise, work.level)
        candidates = [noise, Noise(size, 1e-3 * size, noise.tau, noise.offset, noise.gain)]
        for candidate in candidates + ([held] if held != noise else []):
            small = reduced(sums(atoms, work.whiten(candidate)).total, atoms.count)
            before = np.concatenate([g.columns for g in chosen]).astype(int) if chosen else np.zeros(0, int)
            gains = [(solve(small, np.concatenate([before, g.columns]))[1], g) for g in atoms.groups]
            gains.sort(key=lambda pair: -pair[0])
            for _, group in gains[:12]:
                if len(picks) < {id(noise): 3, id(held): 7}.get(id(candidate), 5):
                    picks.setdefault(group.effect.name, group)
        tried = []
        for group in picks.values():
            columns = np.concatenate([g.columns for g in (*chosen, group)])
            rest = _without(work, atoms, columns, held)
            own, value = work.noise(rest, noise)
            tried.append((value, own, group))
        value, own, group = min(tried, key=lambda item: item[0])
        columns = np.concatenate([g.columns for g in (*chosen, group)])
        rest = _without(work, atoms, columns, repeating(own, work.level))
        own, value = work.noise(rest, own)
        if step == 0:
            drop = cost - value
        if cost - value < max(limit, 20.0):
            break
        chosen.append(group)
        noise, cost, size = own, value, own.sample
    return noise, drop


def _without(work: _Work, atoms: Atoms, columns: np.ndarray, noise: Noise) -> np.ndarray:
    """(n, d) residual with atoms and nuisance fitted linearly under a noise."""
    kept = np.concatenate([columns, np.arange(atoms.count, atoms.rows.shape[2])])
    few = Atoms((), atoms.rows[:, :, kept], len(columns))
    gram = sums(few, work.whiten(noise)).total
    factors, _ = solve(reduced(gram, few.count), np.arange(few.count))
    nuisance = np.arange(few.count, gram.shape[0] - 1)
    right = gram[nuisance, -1] - gram[np.ix_(nuisance, np.arange(few.count))] @ factors
    beta = np.linalg.lstsq(gram[np.ix_(nuisance, nuisance)], right, rcond=1e-12)[0]
    return np.asarray(few.rows[:, :, -1] - few.rows[:, :, :-1] @ np.concatenate([factors, beta]))


def _singles(work: _Work, atoms: Atoms, noise: Noise) -> list[tuple[Effect, list[np.ndarray]]]:
    """Effects by what their best group takes off left-out folds, those that take most of all rows among the
    first ones; and starts from their two best groups."""
    found = sums(atoms, work.whiten(repeating(noise, work.level)))
    small = reduced(found.total, atoms.count)
    by_effect: dict[str, list[tuple[float, Group, np.ndarray]]] = {}
    for group in atoms.groups:
        factors, gain = solve(small, group.columns)
        by_effect.setdefault(group.effect.name, []).append((gain, group, factors))
    ranked = []
    for entries in by_effect.values():
        entries.sort(key=lambda item: -item[0])
        error = left_out(found, entries[0][1].columns).sum()
        starts = [start_of(group, factors) for _, group, factors in entries[:2]]
        ranked.append((float(error), entries[0][0], entries[0][1].effect, starts))
    ranked.sort(key=lambda item: item[0])
    # what one record alone shows cannot be foretold from the others, and is fitted all the same
    most = sorted(ranked, key=lambda item: -item[1])[:3]
    ranked = [
        *ranked[:2],
        *(m for m in most if m not in ranked[:2]),
        *(r for r in ranked[2:] if r not in most),
    ]
    out = []
    for place, (_, _, effect, starts) in enumerate(ranked):
        out.append((effect, starts if place < 3 else starts[:1]))
    return out


def _pairs(
    work: _Work,
    atoms: Atoms,
    ranked: Sequence[tuple[Effect, list[np.ndarray]]],
    single: Trial,
    effects: Sequence[Effect],
) -> None:
    """Pairs: the best on top of the best singles, and the best of all pairs of the screen; then swaps, a
    third."""
    noise = single.noise
    for first in sorted((t for n, t in work.trials.items() if len(n) == 1), key=lambda t: t.cost)[:3]:
        _extend(work, first, effects, 5)
    _screened_pairs(work, atoms, noise)
    pairs = sorted((t for n, t in work.trials.items() if len(n) == 2), key=lambda t: t.cost)
    if not pairs:
        return
    for name in pairs[0].names:
        kept = tuple(n for n in pairs[0].names if n != name)
        if kept in work.trials:
            _extend(work, work.trials[kept], effects, 5, diverse=False)
    _inner(work, 2)
    single = min((t for n, t in work.trials.items() if len(n) == 1), key=lambda t: t.cost)
    best_pair = min((t for n, t in work.trials.items() if len(n) == 2), key=lambda t: t.cost)
    if single.cost - best_pair.cost > 30.0:
        _extend(work, best_pair, effects, 3)
        _inner(work, 3)


def _inner(work: _Work, size: int) -> None:
    """What the best sets of a size have found for each effect, tried again with one effect less.

    A smaller set may have been fitted into another valley; then it would seem to need the effect more.
    """
    largest = sorted((t for n, t in work.trials.items() if len(n) == size), key=lambda t: t.cost)
    tried: set[tuple[str, ...]] = set()
    for trial in largest[:INNER]:
        chain = trial.fit.chain
        for leave in range(size):
            kept = [i for i in range(size) if i != leave]
            names = tuple(chain.effects[i].name for i in kept)
            if names not in tried:
                tried.add(names)
                work.try_set([chain.effects[i] for i in kept], [chain.thetas[i] for i in kept], trial.noise)


def _screened_pairs(work: _Work, atoms: Atoms, noise: Noise) -> None:
    """The best of all pairs of atoms, those of one class left out: one output cannot show both."""
    lead = min(work.trials.values(), key=lambda t: t.cost).noise
    found = sums(atoms, work.whiten(repeating(lead, work.level)))
    small = reduced(found.total, atoms.count)
    best: dict[str, list[tuple[float, Group]]] = {}
    for group in atoms.groups:
        best.setdefault(group.effect.name, []).append((solve(small, group.columns)[1], group))
    top = {name: [g for _, g in sorted(v, key=lambda i: -i[0])[:2]] for name, v in best.items()}
    options = []
    for a, b in combinations(top, 2):
        if b in top[a][0].effect.classmates:
            continue
        for ga in top[a]:
            for gb in top[b]:
                factors, gain = solve(small, np.concatenate([ga.columns, gb.columns]))
                if (factors[: len(ga.columns)] > 0).any() and (factors[len(ga.columns) :] > 0).any():
                    options.append((gain, ga, gb, factors))
    options.sort(key=lambda item: -item[0])
    tried: set[tuple[str, ...]] = set()
    for _, ga, gb, factors in options:
        key = tuple(sorted((ga.effect.name, gb.effect.name)))
        if key in tried or any(tuple(sorted(n)) == key for n in work.trials):
            continue
        tried.add(key)
        k = len(ga.columns)
        starts = [start_of(ga, factors[:k]), start_of(gb, factors[k:])]
        work.try_set([ga.effect, gb.effect], starts, noise)
        if len(tried) >= PAIRS:
            break


def _extend(work: _Work, trial: Trial, effects: Sequence[Effect], count: int, diverse: bool = True) -> None:
    """One effect more on top of a fitted set, whose own parameters and form give way in the screen;
    `diverse`: one a class."""
    chain = trial.fit.chain
    others = [e for e in effects if e.name not in trial.names]
    atoms = make_atoms(chain, work.data, others)
    slopes = theta_columns(chain, work.data)
    form, sizes = form_columns(chain, work.data)
    rows = np.concatenate([atoms.rows[:, :, :-1], slopes, form, atoms.rows[:, :, -1:]], axis=2)
    atoms = Atoms(atoms.groups, rows, atoms.count)
    metrics = [(repeating(trial.noise, work.level), count)]
    if several_records(work.data) and scattered(trial.noise, work.level):
        metrics.append((between(trial.noise, work.level, work.data), 1))
    for noise, most in metrics:
        gram = sums(atoms, work.whiten(noise)).total
        random = np.arange(len(gram) - 1 - len(sizes), len(gram) - 1)
        gram[random, random] += 1.0 / np.maximum(sizes, 1e-12) ** 2
        small = reduced(gram, atoms.count)
        best: dict[str, tuple[float, Group, np.ndarray]] = {}
        for group in atoms.groups:
            factors, gain = solve(small, group.columns)
            name = group.effect.name
            if name not in best or gain > best[name][0]:
                best[name] = (gain, group, factors)
        taken: list[Effect] = list(chain.effects)
        for _, group, factors in sorted(best.values(), key=lambda item: -item[0]):
            if len(taken) == len(chain.effects) + most:
                break
            if diverse and any(group.effect.name in other.classmates for other in taken):
                continue
            taken.append(group.effect)
            names = tuple(sorted((*trial.names, group.effect.name)))
            if any(tuple(sorted(n)) == names for n in work.trials):
                continue
            starts = [*chain.thetas, start_of(group, factors)]
            work.try_set([*chain.effects, group.effect], starts, trial.noise)


def several_records(data: Data) -> bool:
    """Whether there are records enough for a trend between them."""
    return sum(run.train for run in data.runs) > 2


@dataclass(frozen=True)
class FoldErrors:
    """Squared whitened errors of each fold.

    Attributes
    ----------
    fitted : all folds fitted together
    left_out : each fold predicted from the others
    parameters : number of parameters fitted
    leverage : (folds,) largest share that a fold has in what is known of one of the effects' parameters
    blocks : (BLOCKS folds,) left-out errors of parts of the folds
    """

    fitted: np.ndarray
    left_out: np.ndarray
    parameters: int
    leverage: np.ndarray
    blocks: np.ndarray


def fold_errors(
    trial: Trial, data: Data, whiten: Whitener, groups: Sequence[np.ndarray] | None = None
) -> FoldErrors:
    """Errors under the noise of `whiten`, by one Gauss-Newton step from the fit; parameters at bounds
    stay."""
    chain = trial.fit.chain
    plain = chain.response(data, chain.thetas, chain.base.values)
    columns = np.concatenate([base_columns(chain, data, plain), theta_columns(chain, data, True)], axis=2)
    residual = data.output - (chain.gain * plain + chain.offset)
    turned = whiten(np.concatenate([columns, residual[:, :, None]], axis=2))
    grams = []
    groups = folds(data) if groups is None else groups
    for rows in groups:
        flat = turned[rows].reshape(-1, turned.shape[2])
        grams.append(flat.T @ flat)
    total = np.sum(grams, axis=0)
    whole = _step(total)
    own = columns.shape[2] - theta_columns(chain, data, True).shape[2]
    at = np.arange(own, columns.shape[2])
    known = np.stack([_information(gram, at, own) for gram in [*grams, total]])
    leverage = (known[:-1] / np.maximum(known[-1], 1e-300)).max(axis=1) if len(at) else np.zeros(len(grams))
    fitted = np.array([whole @ gram @ whole for gram in grams])
    left = [_step(total - gram) for gram in grams]
    blocks = []
    for rows, v in zip(groups, left, strict=True):
        squares = np.sum((turned[rows] @ v) ** 2, axis=1)
        blocks += [float(part.sum()) for part in np.array_split(squares, BLOCKS)]
    return FoldErrors(
        fitted,
        np.array([v @ gram @ v for v, gram in zip(left, grams, strict=True)]),
        columns.shape[2],
        leverage,
        np.array(blocks),
    )


def _information(gram: np.ndarray, at: np.ndarray, free: int) -> np.ndarray:
    """Diagonal of the information on the columns `at`, the first `free` columns being free."""
    base = gram[:free, :free]
    size = np.sqrt(np.maximum(np.diag(base), 1e-300))
    inverse = np.linalg.pinv(base / np.outer(size, size), rcond=1e-9, hermitian=True)
    cross = gram[:free][:, at] / size[:, None]
    return np.asarray(np.diag(gram)[at] - np.einsum("ij,ik,kj->j", cross, inverse, cross))


def _step(gram: np.ndarray) -> np.ndarray:
    """(-move, 1) of the Gauss-Newton step for sums of squares of (columns, residual)."""
    size = np.sqrt(np.maximum(np.diag(gram)[:-1], 1e-300))
    inner = gram[:-1, :-1] / np.outer(size, size) + 1e-6 * np.eye(len(size))
    move = np.linalg.solve(inner, gram[:-1, -1] / size) / size
    return np.concatenate([-move, [1.0]])


__all__ = ["FoldErrors", "Found", "Trial", "fold_errors", "linear_columns", "search", "theta_columns"]
