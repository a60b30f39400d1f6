"""Localisation: the slot at fault is found where the physics is written otherwise than the knobs are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from loop_bench import duhem, soften, threshold, wander, write_case

from fem_spa.loop.localise import Place, localise, place_words
from fem_spa.loop.model_file import read_source
from fem_spa.loop.prepare import Case, prepare
from fem_spa.loop.records import read_records
from fem_spa.loop.split import split

Body = Callable[[list[np.ndarray]], list[np.ndarray]]


def prepared(folder: Path, body: Body) -> Case:
    model, files = write_case(folder, body)
    return prepare(read_source(model), split(read_records(files), [], 0))


@pytest.mark.parametrize(
    ("body", "slot", "steady", "along"),
    [
        (duhem, "state", True, set()),
        (threshold, "actuation", True, set()),
        (soften, "stiffness", False, {"the time", "the number of cycles"}),
    ],
)
def test_slot_at_fault_comes_first(
    tmp_path: Path, body: Body, slot: str, steady: bool, along: set[str]
) -> None:
    case = prepared(tmp_path, body)
    places = localise(case.chain, case.data)
    best = places[0]
    assert best.slot == slot and best.steady is steady and {name for name, _ in best.along} == along
    assert best.explained > 0.6 and slot in place_words(places)


def test_no_slot_is_blamed_for_what_none_can_do(tmp_path: Path) -> None:
    case = prepared(tmp_path, wander)
    words = place_words(localise(case.chain, case.data))
    assert words.startswith("no number of the chain")
    assert place_words([]) == ""
    assert place_words([Place("state", "a state", 0.9, (("the time", 0.8),), False)]).count("the time") == 1


def test_held_out_rows_are_not_looked_at(tmp_path: Path) -> None:
    case = prepared(tmp_path, duhem)
    output = case.data.output.copy()
    output[~case.data.train] = 7.0
    assert localise(case.chain, replace(case.data, output=output)) == localise(case.chain, case.data)


def test_missing_rows_change_little(tmp_path: Path) -> None:
    """A tenth of the rows missing."""
    case = prepared(tmp_path, soften)
    rng = np.random.default_rng(0)
    holes = replace(case.data, known=case.data.known & (rng.random(len(case.data.known)) > 0.1))
    found, full = localise(case.chain, holes)[0], localise(case.chain, case.data)[0]
    assert found.slot == full.slot and found.explained == pytest.approx(full.explained, abs=0.02)
