"""The whole of `fem-spa diagnose`: read, split, refit, search, decide, write."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.errors import InputError
from fem_spa.loop.audit import insufficient, remarks, stranger
from fem_spa.loop.certificate import Certificate, certificate, limits
from fem_spa.loop.compose import Chain, around
from fem_spa.loop.data import Data
from fem_spa.loop.decide import LEAST_SHARE, Decision, decide
from fem_spa.loop.deck_forms import Solved, Work
from fem_spa.loop.deck_word import beaten, in_the_deck, in_the_deck_parameters, table_of, used
from fem_spa.loop.effects.effect import Effect
from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.fit import polished
from fem_spa.loop.form import form_share, freedom
from fem_spa.loop.intervals import shown_parameters
from fem_spa.loop.lattice import quantised
from fem_spa.loop.learner import learn
from fem_spa.loop.localise import Place, localise, place_table, place_words
from fem_spa.loop.model_file import Source, read_source, source_tables
from fem_spa.loop.noise import Whitener
from fem_spa.loop.physical import forms, last_word
from fem_spa.loop.pneumatic import SETTLED_BY_PRESSURE, Pneumatics, beyond, pneumatics
from fem_spa.loop.prepare import Case, base_for, before, outputs_of, own_chain, prepare, train_runs
from fem_spa.loop.records import NoTime, Record, read_records
from fem_spa.loop.repeats import repeat_floor
from fem_spa.loop.report_json import (
    clean,
    errors,
    inputs,
    prediction_table,
    unit_size,
    versions,
)
from fem_spa.loop.search import Found, search
from fem_spa.loop.signatures.told import signature_of
from fem_spa.loop.split import split, unseen
from fem_spa.loop.teeth import lattice_step, resting_step, without_teeth
from fem_spa.loop.told import figures, progress, sentence
from fem_spa.loop.unable import unable
from fem_spa.loop.words import LEAST_TONE, SENTENCE, periodic, signature
from fem_spa.output.claim import claimed
from fem_spa.output.files import write_whole
from fem_spa.output.toml import to_toml

MISSED = (4.0, 0.025)
"""Error on records held out, over that on those to fit and over the span, from which there is no `none`."""
ALIKE = 0.01
"""Share by which a rival that explains less loses a factor e of its weight: set on 32 cases of the benchmark
(seeds 801, 803); how often names of a probability were right since: docs/loop.md."""
LEAST_OTHER = 0.09
"""Weight of "none of these" beside a set that explains everything that is predictable."""


@dataclass(frozen=True)
class Outcome:
    """What the command line says."""

    report: dict[str, Any]
    sentence: str
    figures: str


@dataclass(frozen=True)
class Study:
    """Everything that the report and its page are made from."""

    source: Source
    case: Case
    found: Found
    decision: Decision
    pneumatics: Pneumatics | None
    after: Chain
    certificate: Certificate
    limits: dict[str, float]
    untestable: dict[str, str]
    before_rows: list[np.ndarray]
    after_rows: list[np.ndarray]
    floor_rows: list[np.ndarray]
    places: list[Place]
    again: tuple[Solved, ...] = ()


def diagnose(
    model: Path, paths: Sequence[Path], holdout: Sequence[Path], seed: int, out: Path, page: bool = True
) -> Outcome:
    """Diagnose and write everything into `out`.

    Raises
    ------
    InputError
        for wrong input, before anything is written; for a folder that cannot be, or that another run has
    """
    with claimed(out):
        return _diagnose(model, paths, holdout, seed, out, page)


def _diagnose(
    model: Path, paths: Sequence[Path], holdout: Sequence[Path], seed: int, out: Path, page: bool
) -> Outcome:
    """In a folder that is this run's."""
    say = progress()
    both = _together(paths, holdout)
    files = [model, *both]
    records: list[Record] = []
    timeless = ""
    try:
        records = read_records(both)
    except NoTime as reason:
        timeless = str(reason)
    source = read_source(model, out, say)
    if timeless:
        return _unable(timeless, [], (), source, files, seed, out, page)
    parted = split(records, holdout, seed)
    names = outputs_of(source.model, parted.records)
    fitted = parted.train[: len(records)]
    why = insufficient(parted.records, parted.train, names)
    if why is not None:
        return _unable(why, records, fitted, source, files, seed, out, page)
    say("refitting the base model")
    case = prepare(source, parted)
    rows, chain = case.data.train, case.chain
    start = base_for(source, names, case.data)
    nominal = start.respond(case.data, case.data.pressure, start.values)[rows]
    why = stranger(nominal, chain.predict(case.data)[rows], case.data.output[rows])
    if why is not None:
        return _unable(why, records, fitted, source, files, seed, out, page, chain)
    study = _study(source, case, seed, say)
    report = _report(study, files, seed)
    say("writing")
    _write(study, report, out, page)
    say.done()  # type: ignore[attr-defined]
    return Outcome(report, sentence(report), figures(report))


def _unable(why: str, *given: Any) -> Outcome:
    """A report that says why nothing can be told."""
    return Outcome(unable(why, *given), SENTENCE["insufficient"].format(why=why), "no figures")


def _together(paths: Sequence[Path], holdout: Sequence[Path]) -> list[Path]:
    """Records and held-out ones, each once, in the order given."""
    seen: dict[Path, Path] = {}
    for path in [*paths, *holdout]:
        seen.setdefault(path.resolve(), path)
    twice = [p for p in paths if sum(p.resolve() == q.resolve() for q in paths) > 1]
    if twice:
        raise InputError(f"record {twice[0]} is given twice; give each once")
    return list(seen.values())


def _study(source: Source, case: Case, seed: int, say: Callable[[str], None]) -> Study:
    """Search and decide."""
    data, chain, parted = case.data, case.chain, case.split
    context = chain.context(data)
    untestable: dict[str, str] = {}
    effects: list[Effect] = []
    have = {e.name for e in source.effects}
    for effect in EFFECTS.values():
        why = "the model has it already" if effect.name in have else effect.untestable(context)
        if why is None and effect.starts(context):
            effects.append(effect)
        elif why is not None:
            untestable[effect.name] = why
    untestable.setdefault("quantisation", "the readings stand on no lattice of coarse steps")
    air = pneumatics(source.model, data, effects, seed, say)
    inner = chain
    held: Chain | None = None
    if air is not None:
        effects = [e for e in effects if e.name not in SETTLED_BY_PRESSURE]
        if air.effects:
            held = chain.with_effects(air.effects, air.thetas)
            inner = before(around(held), data)
            inner = replace(inner, scale=chain.scale, rest=chain.rest)
            effects = [e for e in effects if e not in air.effects]
            if not _better(chain, inner, data):
                inner, held = chain, None
    moved = data
    if air is not None:
        moved = replace(data, output=data.output - beyond(air, chain, data, held is not None))
        inner = polished(inner, moved)
    step = lattice_step(inner, moved)
    smooth = None if step is None else without_teeth(inner, moved, step)
    searched, step = (moved, None) if smooth is None else (smooth, step)
    resting = resting_step(inner, moved) if step is None else None
    found = search(inner, searched, effects, seed, say)
    report_card = certificate(found.atoms, searched, train_runs(searched), [e.name for e in effects])
    say("deciding")
    decision = decide(inner, searched, found, parted.provisional, seed)
    if source.effects and decision.verdict not in ("none", "insufficient"):
        decision = _of_the_model(decision, own_chain(source, chain, searched), searched)
    best = decision.best.trial.fit.chain
    after = last_word(polished(best, data), data) if decision.chosen else polished(inner, data)
    if decision.chosen and _mean_square(after, data) > 1.02 * _mean_square(inner, data):
        # whitened noise with free offsets can hide a misfit that plain least squares shows
        decision, after = replace(decision, verdict="unexplained", chosen=(), rivals={}), inner
    if held is not None and air is not None:
        decision = _joined(decision, air, parted.provisional)
        if decision.verdict in ("unexplained", "none"):
            after = chain
    elif not decision.chosen:
        after = chain
    plain = inner.response(data, inner.thetas, inner.base.values)
    whiten = Whitener(data, decision.noise, inner.gain * (plain - inner.rest), train_runs(data))
    again: tuple[Solved, ...] = ()
    if source.forms != "none" and held is None:
        work = Work(source, data, case.full, whiten, parted.provisional)
        word = in_the_deck(work, chain, after, decision, found)
        after, source, decision, again = word.chain, word.source, word.decision, word.told
    decision, after = quantised(decision, after, case, step, resting)
    if decision.verdict == "none":
        residual = data.output - chain.predict(data)
        rows = data.train & data.known
        share = float(np.sqrt(np.mean(residual[rows] ** 2)) / np.max(np.ptp(data.output[rows], axis=0)))
        if share > LEAST_TONE and periodic(chain.context(data), residual) is not None:
            decision = replace(decision, verdict="unexplained", detected=True)
        decision = _missed(decision, residual, data)
    named = [best] if decision.chosen else []
    named += [own_chain(source, chain, searched)] if source.effects else []
    free = [freedom(c, searched) for c in named]
    seen_from = limits(report_card, found.atoms, replace(whiten, data=searched), found.limit, free)
    floor = _floor(after, data, whiten)
    full = case.full
    rows = [_at(case, c.predict(full)) for c in (chain, after)]
    correction = _at(replace(case, full=data), floor)
    return Study(
        source,
        case,
        found,
        decision,
        air if held is not None else None,
        after,
        report_card,
        seen_from,
        untestable,
        rows[0],
        rows[1],
        [a + c for a, c in zip(rows[1], correction, strict=True)],
        [] if decision.verdict == "none" else localise(chain, data),
        again,
    )


def _missed(decision: Decision, residual: np.ndarray, data: Data) -> Decision:
    """Not `none` where records held out show what no record to fit does."""
    fitted, held = (data.known & data.train, data.known & ~data.train)
    if not held.any():
        return decision
    inside, outside = (float(np.sqrt(np.mean(residual[rows] ** 2))) for rows in (fitted, held))
    extent = float(np.max(np.ptp(data.output[fitted], axis=0)))
    if outside < MISSED[0] * inside or outside < MISSED[1] * extent:
        return decision
    words = (
        f"records held out are missed {outside / inside:.0f} times as far as those to fit, which show "
        "nothing; hold others out"
    )
    return replace(decision, verdict="unexplained", detected=True, reasons=(words,))


def _of_the_model(decision: Decision, own: Chain, data: Data) -> Decision:
    """None where what is left is no more than another form of the laws that the model has already."""
    plain = own.response(data, own.thetas, own.base.values)
    whiten = Whitener(data, decision.noise, own.gain * (plain - own.rest), train_runs(data))
    if form_share(own, data, whiten, float(decision.learned.after.sum())) < LEAST_SHARE:
        return decision
    names = " and ".join(e.name for e in own.effects)
    words = f"what is left is no more than another form of the law of {names}, which the model has already"
    return replace(decision, verdict="none", chosen=(), rivals={}, detected=False, reasons=(words,))


def _better(chain: Chain, inner: Chain, data: Any) -> bool:
    """Whether the output is the better for what the measured pressure shows, on the training rows."""
    return _mean_square(inner, data) < 0.98 * _mean_square(chain, data)


def _mean_square(chain: Chain, data: Any) -> float:
    """Mean square of what a chain leaves on the training rows."""
    rows = data.train & data.known
    return float(np.mean((data.output - chain.predict(data))[rows] ** 2))


def _joined(decision: Decision, air: Pneumatics, provisional: bool) -> Decision:
    """The output's decision with what the measured pressure has shown beside it."""
    if decision.verdict == "unexplained":
        return decision
    chosen = tuple(e.name for e in air.effects) + decision.chosen
    rivals = {**{n: air.decision.rivals.get(n, []) for n in air.decision.chosen}, **decision.rivals}
    odd = any(r not in EFFECTS[n].classmates for n, rs in rivals.items() for r in rs)
    verdict = "ambiguous" if odd or provisional else "attributed"
    return replace(decision, verdict=verdict, chosen=chosen, rivals=rivals, detected=True)


def _floor(after: Chain, data: Any, whiten: Whitener) -> np.ndarray:
    """(n, d) what the reference learner would still correct; zero where it does harm on left-out folds."""
    residual = data.output - after.predict(data)
    learned = learn(after.context(data), residual, whiten)
    return learned.prediction if learned.gain > 0.02 else np.zeros_like(residual)


def _at(case: Case, rows: np.ndarray) -> list[np.ndarray]:
    """Rows of the grid at every record's own sample times."""
    out = []
    for record, run in zip(case.split.records, case.full.runs, strict=True):
        n = run.part.stop - run.part.start
        sample = float(np.median(np.diff(record.time)))
        grid = record.time[0] + run.step * np.arange(n) + 0.5 * (run.step - sample)
        columns = [np.interp(record.time, grid, rows[run.part, j]) for j in range(rows.shape[1])]
        out.append(np.stack(columns, axis=1))
    return out


def _report(study: Study, files: Sequence[Path], seed: int) -> dict[str, Any]:
    """report.json."""
    d, case = study.decision, study.case
    records, train = case.split.records, case.split.train
    names = list(study.after.base.names)
    alone = {file: [words] for file, words in unseen(case.split).items()}
    sizes = unit_size(records[0].units[names[0]], names[0])
    table = errors(
        records,
        train,
        names,
        study.before_rows,
        study.after_rows,
        study.floor_rows,
        "reference learner on top of what is reported",
    )
    excluded = [
        {"name": n, "limit": limit / sizes, "unit": records[0].units[names[0]]}
        for n, limit in study.limits.items()
        if n not in d.chosen and not any(n in r for r in d.rivals.values()) and d.verdict != "unexplained"
    ]
    words = ""
    if d.verdict == "unexplained":
        base = case.chain
        words = signature(base.context(case.data), case.data.output - base.predict(case.data), d.learned)
        words = "; ".join(w for w in (words, place_words(study.places)) if w)
    effects = []
    for name in d.chosen:
        effects.append(
            {
                "name": name,
                "family": EFFECTS[name].family,
                "probability": _probability(name, d, beaten(study.again, d)),
                "rivals": d.rivals.get(name, []),
                "parameters": in_the_deck_parameters(name, study.again)
                or shown_parameters(name, study, sizes, records[0].units[names[0]]),
                "signature": signature_of(name, study, sizes, records[0].units[names[0]]),
            }
        )
    candidates = list(d.chosen)
    for name in d.chosen:
        candidates += [r for r in d.rivals.get(name, []) if r not in candidates]
    held = table["heldout"]
    again = repeat_floor(records, train, names, study.after_rows)
    if again is not None:
        held["floor"], held["floor_from"] = again[0] / sizes, again[1]
    known = [v for v in (held["before"], held["after"], held["floor"]) if v is not None]
    held["floor"] = min(known) if known else None
    report = {
        "verdict": d.verdict,
        "effects": effects,
        "candidates": candidates,
        "error": table,
        "signature": words,
        "excluded": excluded,
        "untestable": [{"name": n, "why": w} for n, w in study.untestable.items() if n not in d.chosen],
        "next_experiment": None,
        "seed": seed,
        "versions": versions(),
        "inputs": inputs(files),
        "explained": d.share if d.chosen else 0.0,
        "forms": {**forms(study.after), **used(study.again)} if d.chosen else {},
        "solved_again": table_of(study.again, sizes),
        "reasons": list(d.reasons),
        "localisation": place_table(study.places),
        "provisional": case.split.provisional,
        "audit": [
            {"file": r.path.name, "notes": [*remarks(r), *alone.get(r.path.name, [])]} for r in records
        ],
    }
    return clean(report)  # type: ignore[no-any-return]


def _probability(name: str, d: Decision, beaten: set[str]) -> float:
    """Weight of an effect among those that could stand in its place, none of these included."""
    others = set(d.chosen) - {name}
    best = max(d.best.share, 1e-6)
    weights = {"none of these": LEAST_OTHER + 0.5 * max(1.0 - best, 0.0)}
    for s in d.scored:
        extra = set(s.trial.names) - others
        if others <= set(s.trial.names) and len(extra) == 1 and len(s.trial.names) == len(d.best.trial.names):
            key = extra.pop()
            if key in beaten:
                continue
            weights[key] = max(weights.get(key, 0.0), float(np.exp(-max(best - s.share, 0.0) / ALIKE)))
    weights.setdefault(name, 1.0)
    return weights[name] / sum(weights.values())


def _write(study: Study, report: dict[str, Any], out: Path, page: bool) -> None:
    """Everything into the folder; report.json last."""
    from fem_spa.loop.experiment import propose

    (out / "predictions").mkdir(parents=True, exist_ok=True)
    names = list(study.after.base.names)
    for record, b, a in zip(study.case.split.records, study.before_rows, study.after_rows, strict=True):
        if study.case.split.provisional and record is not study.case.split.records[0]:
            continue
        whole = record
        if study.case.split.provisional:
            whole, b, a = _whole(study)
        write_whole(out / "predictions" / f"{record.name}.csv", prediction_table(whole, names, b, a))
    report["next_experiment"] = propose(study, out)
    if study.decision.chosen:
        chain = study.after
        if study.pneumatics is not None:
            chain = chain.with_effects(
                (*study.pneumatics.effects, *chain.effects), (*study.pneumatics.thetas, *chain.thetas)
            )
        write_whole(out / "model_next.toml", to_toml(source_tables(study.source, chain, out)))
    if page:
        from fem_spa.loop.page import write_page

        write_page(study, report, out)
    write_whole(out / "report.json", json.dumps(report, indent=1) + "\n")


def _whole(study: Study) -> tuple[Record, np.ndarray, np.ndarray]:
    """A record that was cut for the hold-out, put together again."""
    first, second = study.case.split.records
    joined = replace(
        first,
        time=np.concatenate([first.time, second.time]),
        outputs={n: np.concatenate([first.outputs[n], second.outputs[n]]) for n in first.outputs},
    )
    return joined, np.concatenate(study.before_rows), np.concatenate(study.after_rows)
