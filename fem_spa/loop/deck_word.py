"""Which effects a deck is solved again for, one after another, and what the report says of it."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from fem_spa.loop.compose import Chain
from fem_spa.loop.deck_forms import STRUCTURAL, Solved, Work, deck_word, mean_square
from fem_spa.loop.effects.registry import EFFECTS
from fem_spa.loop.fit import polished
from fem_spa.loop.gates import gates
from fem_spa.loop.model_file import Source

if TYPE_CHECKING:
    from fem_spa.loop.decide import Decision
    from fem_spa.loop.search import Found, Trial

WITH_RIVALS = ("auto", "set")
THROUGH = ("chamber-gain", "cross-coupling")
"""Effects of the structure that a deck is not solved again for; the report says why."""


QUICK = 600.0
"""s that all solves of a diagnosis may be expected to take where the model's file says nothing."""
LEAST_SHARE = 0.85
"""Share of the predictable squared error that a deck must explain where blocks did not do so."""
CLEARLY = 0.8
"""Squared training error, over that of what is named, below which a rival's deck takes its place."""


BEATEN = 0.5
"""The same below which a rival is none any more: the deck tells them apart where blocks do not."""


@dataclass(frozen=True)
class Word:
    """What comes out: chain, the source it is of, the decision, and the comparisons."""

    chain: Chain
    source: Source
    decision: Decision
    told: tuple[Solved, ...] = ()


def in_the_deck(work: Work, before: Chain, after: Chain, decision: Decision, found: Found) -> Word:
    """What is named in the deck, where the deck carries it as well as the block does, one after another.

    But with `forms = "named"` the deck is solved for structural rivals too, each in the place of what is
    named. One whose deck does clearly better than that, as block and in the deck, takes its place: they are
    of a kind that blocks cannot tell apart. With "auto" all solves together stay within `QUICK`.
    """
    if work.source.forms == "auto":
        work = replace(work, until=time.perf_counter() + QUICK)
    if not decision.chosen:
        return _after_all(work, before, decision, found)
    word = _each(work, Word(after, work.source, decision), found)
    share = _share(work, before, word)
    if share > decision.share and any(s.used for s in word.told):
        return _explaining(word, share)
    return word


def _share(work: Work, before: Chain, word: Word) -> float:
    """Share of the predictable squared error that is gone, at most one."""
    noise = word.decision.noise
    floor = noise.white**2 + noise.coloured**2 + noise.offset**2
    whole, left = (mean_square(c, work.data) for c in (before, word.chain))
    return min((whole - left) / max(whole - floor, 1e-300), 1.0)


def _explaining(word: Word, share: float) -> Word:
    return replace(word, decision=replace(word.decision, share=share, left=1.0 - share))


def _after_all(work: Work, before: Chain, decision: Decision, found: Found) -> Word:
    """What blocks do not explain, but the deck does: the best set's block may be too rough a stand-in.

    Rough or not, it must be there on records left out and do worse with the history of others.
    """
    plain = Word(before, work.source, decision)
    names = decision.best.trial.names
    if decision.verdict != "unexplained" or not {*names} & {*STRUCTURAL}:
        return plain
    if gates(decision.best.trial, found.base, work.whiten):
        return plain
    rivals = {n: [r for r in EFFECTS[n].classmates if _trial(found, names, n, r) is not None] for n in names}
    verdict = "ambiguous" if work.provisional else "attributed"
    given = replace(decision, verdict=verdict, chosen=names, rivals=rivals, reasons=())
    chain = polished(decision.best.trial.fit.chain, work.data)
    word = _each(work, Word(chain, work.source, given), found)
    share = _share(work, before, word)
    if not any(s.used for s in word.told) or share < LEAST_SHARE:
        return replace(plain, told=tuple(replace(s, used=False) for s in word.told))
    return _explaining(word, share)


def _each(work: Work, word: Word, found: Found) -> Word:
    """One name after another."""
    decision = word.decision
    for name in decision.chosen:
        rivals = decision.rivals.get(name, []) if word.source.forms in WITH_RIVALS else []
        if {name, *rivals} & {*STRUCTURAL, *THROUGH}:
            word = _one(work, word, name, found)
    return word


def _trial(found: Found, chosen: Sequence[str], name: str, rival: str) -> Trial | None:
    """The fitted set with `rival` in the place of `name`."""
    wanted = set(chosen) - {name} | {rival}
    return next((t for n, t in found.trials.items() if set(n) == wanted), None)


def _one(work: Work, word: Word, name: str, found: Found) -> Word:
    """The same for one name."""
    here = replace(work, source=word.source)
    chain, source, told = deck_word(here, word.chain, name)
    tried = {name: (chain, source, told)}
    blocks: dict[str, float] = {}
    rivals = word.decision.rivals.get(name, [])
    if word.source.forms in WITH_RIVALS and word.source is work.source:
        for rival in rivals:
            trial = _trial(found, word.decision.chosen, name, rival)
            if trial is None:
                continue
            block = polished(trial.fit.chain, work.data)
            blocks[rival] = mean_square(block, work.data)
            if rival in STRUCTURAL:
                tried[rival] = deck_word(here, block, rival)
    sizes = {n: mean_square(c, work.data) for n, (c, _, _) in tried.items()}
    decks = {n: size for n, size in sizes.items() if tried[n][2].used and n != name}
    best = min(decks, key=lambda n: decks[n], default=name)
    if best != name and sizes[best] > CLEARLY * sizes[name]:
        best = name
    chain, source, _ = tried[best]
    others = [n for n in (name, *rivals) if n != best]
    if tried[best][2].used:
        left = {**blocks, **{n: min(sizes[n], blocks.get(n, sizes[n])) for n in sizes}}
        others = [n for n in others if n not in left or sizes[best] > BEATEN * left[n]]
    rows = [
        replace(s, role="named" if n == best else "rival", used=s.used and n == best)
        for n, (_, _, s) in tried.items()
    ]
    decision = _renamed(word.decision, name, best, others, work.provisional)
    return Word(chain, source, decision, (*word.told, *rows))


def _renamed(decision: Decision, name: str, best: str, others: list[str], provisional: bool) -> Decision:
    """The decision with `best` in the place of a name, and what are its rivals now."""
    if best == name and others == decision.rivals.get(name, []):
        return decision
    chosen = tuple(best if n == name else n for n in decision.chosen)
    rivals = {n: r for n, r in decision.rivals.items() if n != name} | {best: others}
    odd = any(r not in EFFECTS[n].classmates for n, rs in rivals.items() for r in rs)
    verdict = "ambiguous" if odd or provisional else "attributed"
    return replace(decision, chosen=chosen, rivals=rivals, verdict=verdict)


def beaten(again: Sequence[Solved], decision: Decision) -> set[str]:
    """What was solved in the deck, or stood beside it, and is no rival any more."""
    if not any(s.used for s in again):
        return set()
    kept = {r for rs in decision.rivals.values() for r in rs} | set(decision.chosen)
    return {s.name for s in again} - kept


def used(again: Sequence[Solved]) -> dict[str, str]:
    """Effect -> the deck that carries it."""
    return {s.name: s.words for s in again if s.used}


def in_the_deck_parameters(name: str, again: Sequence[Solved]) -> dict[str, Any] | None:
    """The contract's `parameters` of an effect that is in the deck; None where it is not."""
    for s in again:
        if s.name == name and s.used and s.parameter is not None:
            return {s.parameter["name"]: {k: s.parameter[k] for k in ("value", "unit", "low", "high")}}
    return None


def table_of(again: Sequence[Solved], size: float) -> list[Mapping[str, Any]]:
    """Rows of the report; `size` is SI in one unit of the output."""

    def pair(given: tuple[float, float] | None) -> dict[str, float | None]:
        train, held = given or (None, None)
        return {
            "train": None if train is None else train / size,
            "heldout": None if held is None else held / size,
        }

    return [
        {
            "name": s.name,
            "role": s.role,
            "form": s.words,
            "parameter": s.parameter,
            "block": pair(s.block),
            "deck": pair(s.deck),
            "used": s.used,
        }
        for s in again
    ]
