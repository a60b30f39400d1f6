"""The floor from repeats: the scatter that was put in, of whole records and of samples."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fem_spa.loop.records import Record
from fem_spa.loop.repeats import repeat_floor, repeats

N = 400


def record(k: int, scatter: float = 0.0, top: float = 5e4, rng: np.random.Generator | None = None) -> Record:
    """A triangle; angle of its pressure with an offset and white noise, each of size `scatter`."""
    t = 0.05 * np.arange(N)
    p = top * (1.0 - np.abs(1.0 - t / 10.0))
    y = p / 1e5
    if rng is not None:
        y = y + scatter * (rng.standard_normal() + rng.standard_normal(N))
    path = Path(f"{k}.csv")
    return Record(path, str(k), t, p[:, None], None, None, {"angle": y}, {"angle": "rad"})


def test_floor_is_the_scatter_of_samples_and_records() -> None:
    """Two hundred pairs: the mean square is that of noise and offset together, sqrt(2) times either."""
    rng = np.random.default_rng(0)
    squares = []
    for _ in range(200):
        pair = [record(k, 0.01, rng=rng) for k in range(2)]
        found = repeat_floor(pair, (True, False), ["angle"], [np.zeros((N, 1))] * 2)
        assert found is not None and found[1] == "repeats"
        squares.append(found[0] ** 2)
    assert np.sqrt(np.mean(squares)) == pytest.approx(np.sqrt(2.0) * 0.01, rel=0.08)


def test_only_the_same_command_in_the_same_place_is_a_repeat() -> None:
    a = record(0)
    steps = replace(a, pressures=np.where(a.time[:, None] > 7.0, 5e4, 0.0))
    a_sample_late = replace(steps, pressures=np.roll(steps.pressures, 1, axis=0))
    turned = replace(a, orientation=3.14)
    assert repeats([a, record(1), record(2, top=4.9e4), turned, steps]) == [[0, 1]]
    assert repeats([steps, a_sample_late]) == [[0, 1]]
    cut = replace(a, time=a.time[:300], pressures=a.pressures[:300])
    assert repeats([a, cut]) == [] and repeat_floor([a, cut], (True, False), ["angle"], []) is None


def test_what_the_model_foretells_and_missing_samples_are_no_scatter() -> None:
    a, b = record(0), record(1)
    y = b.outputs["angle"] * 0.9
    y[50:80] = np.nan
    b = replace(b, outputs={"angle": y})
    none = [np.zeros((N, 1))] * 2
    own = [a.outputs["angle"][:, None], 0.9 * a.outputs["angle"][:, None]]
    plain = repeat_floor([a, b], (True, False), ["angle"], none)
    told = repeat_floor([a, b], (True, False), ["angle"], own)
    assert plain is not None and plain[0] > 0.01
    assert told is not None and told[0] == pytest.approx(0.0, abs=1e-12)


def test_a_held_out_record_without_repeat_takes_the_others() -> None:
    rng = np.random.default_rng(3)
    three = [record(0, 0.01, rng=rng), record(1, 0.01, rng=rng), record(2, top=3e4)]
    found = repeat_floor(three, (True, True, False), ["angle"], [np.zeros((N, 1))] * 3)
    assert found is not None and found[1] == "repeats among the training records"
    assert found[0] == repeat_floor(three, (True, False, True), ["angle"], [np.zeros((N, 1))] * 3)[0]  # type: ignore[index]
