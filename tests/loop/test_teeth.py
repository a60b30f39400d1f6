"""Readings on a lattice are known by their own phase, and their saw is averaged out without what it hides."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from loop_bench import SPAN, curve, drives, holds, nothing, rich, threshold, write_case

from fem_spa.loop.compose import Chain
from fem_spa.loop.data import Data
from fem_spa.loop.model_file import read_source
from fem_spa.loop.prepare import prepare
from fem_spa.loop.records import read_records
from fem_spa.loop.split import split
from fem_spa.loop.teeth import lattice_step, resting_step, without_teeth

Body = Callable[[list[np.ndarray]], list[np.ndarray]]
PITCH = 0.035 * SPAN


def bent(shares: list[np.ndarray]) -> list[np.ndarray]:
    """A wave of 3 % over the pressure, which a refit of the curve does not take."""
    return [curve(q) + 0.03 * SPAN * np.sin(3.0 * np.pi * q) for q in shares]


def rounded(body: Body) -> Body:
    """What the sensor makes of it, before its noise."""
    return lambda shares: [PITCH * np.round((y - 0.3) / PITCH) + 0.3 for y in body(shares)]


def built(folder: Path, body: Body, shares: list[np.ndarray] | None = None) -> tuple[Chain, Data]:
    model, files = write_case(folder, body, shares=rich() if shares is None else shares)
    case = prepare(read_source(model), split(read_records(files), [], 0))
    return case.chain, case.data


def test_step_is_found_beside_an_effect_that_is_as_large(tmp_path: Path) -> None:
    chain, data = built(tmp_path, rounded(bent))
    step = lattice_step(chain, data)
    assert step == pytest.approx(np.radians(0.95 * PITCH), rel=0.01)


@pytest.mark.parametrize("body", [nothing, bent])
def test_smooth_readings_stand_on_none(tmp_path: Path, body: Body) -> None:
    assert lattice_step(*built(tmp_path, body)) is None


def test_few_places_of_rest_are_no_lattice(tmp_path: Path) -> None:
    stairs = [holds([0.2, 0.4, 0.6, 0.8, 1.0, 0.5, 0.0], 10.0)] * 4
    assert lattice_step(*built(tmp_path, nothing, stairs)) is None


def staircase() -> list[np.ndarray]:
    """Holds of ten seconds with two or three rows on the way from one to the next."""
    levels = (0.2, 0.4, 0.6, 0.8, 1.0, 0.8, 0.6, 0.4, 0.2, 0.0)
    points, last = [np.zeros(5)], 0.0
    for level in levels:
        points += [last + (level - last) * np.array([0.15, 0.5, 0.85]), np.full(100, level)]
        last = level
    return [np.concatenate(points)] * 4


def test_places_of_rest_on_a_lattice_are_known(tmp_path: Path) -> None:
    chain, data = built(tmp_path, rounded(nothing), staircase())
    assert lattice_step(chain, data) is None
    assert resting_step(chain, data) == pytest.approx(np.radians(0.95 * PITCH), rel=0.02)


@pytest.mark.parametrize("body", [nothing, bent, threshold])
def test_smooth_places_of_rest_stand_on_none(tmp_path: Path, body: Body) -> None:
    assert resting_step(*built(tmp_path, body, staircase())) is None


def test_a_command_of_equal_steps_is_no_lattice_of_the_readings(tmp_path: Path) -> None:
    # a straight curve turns equal steps of the command into equal steps of the output
    equal = [np.round(20.0 * q) / 20.0 for q in staircase()]
    chain, data = built(tmp_path, nothing, equal)
    straight = replace(chain.base, respond=lambda d, pressure, _: SPAN * pressure / d.p_max)
    chain = replace(chain, base=straight, gain=1.0, offset=np.zeros(1))
    noise = 0.002 * SPAN * np.random.default_rng(2).standard_normal(data.output.shape)
    assert resting_step(chain, replace(data, output=chain.predict(data) + noise)) is None


def test_a_part_of_a_tooth_is_no_lattice(tmp_path: Path) -> None:
    # fast ramps, of which only the slow beginnings below a threshold are looked at
    assert lattice_step(*built(tmp_path, threshold, drives())) is None


def test_saw_goes_and_the_effect_stays(tmp_path: Path) -> None:
    chain, data = built(tmp_path / "rounded", rounded(bent))
    _, clean = built(tmp_path / "clean", bent)
    step = lattice_step(chain, data)
    assert step is not None
    smooth = without_teeth(chain, data, step)
    assert smooth is not None
    rows = smooth.known & data.train
    before = np.std((data.output - clean.output)[rows])
    after = np.std((smooth.output - clean.output)[rows])
    assert after < 0.5 * before
    effect = np.std((clean.output - chain.predict(clean))[rows])
    assert np.std((smooth.output - chain.predict(smooth))[rows]) == pytest.approx(effect, rel=0.15)
    # at rest nothing is known within a tooth
    rest = np.abs(np.gradient(data.pressure[:, 0])) < 1e-6 * data.p_max
    assert not smooth.known[rest].any()
