"""What a sweep says of its cases."""

from __future__ import annotations

from pathlib import Path

import pytest

from fem_spa.sweep.axes import read_axis
from fem_spa.sweep.case import Line
from fem_spa.sweep.cases import Case, Plan
from fem_spa.sweep.state import Sweep
from fem_spa.sweep.words import best, failures, verdict


@pytest.fixture
def sweep() -> Sweep:
    axis = read_axis("loads.pressure=1kPa,2kPa,3kPa,4kPa,5kPa")
    cases = tuple(Case(f"c{k}", (value,), None) for k, value in enumerate(axis.values))
    return Sweep(Plan((axis,), cases), Path())


def test_reasons_that_differ_in_their_numbers_are_one(sweep: Sweep) -> None:
    """A sweep of a thousand limit points would else have a page of a thousand reasons."""
    words = "no equilibrium beyond {} kPa, element {}"
    sweep.lines = {
        "c0": Line("done"),
        "c1": Line("refused", "the mesh has no tip"),
        "c2": Line("limit", words.format("2.985", 503)),
        "c3": Line("limit", words.format("3.1", 7)),
        "c4": Line("diverged", words.format("3.1", 7)),
    }
    found = [(status, reason, [case.name for case in cases]) for status, reason, cases in failures(sweep)]
    assert found == [
        ("limit", words.format("2.985", 503) + " (the first of them)", ["c2", "c3"]),
        ("refused", "the mesh has no tip", ["c1"]),
        ("diverged", words.format("3.1", 7), ["c4"]),
    ]


def test_only_solved_cases_are_the_best(sweep: Sweep) -> None:
    """One that ended on the way has a larger angle at another pressure."""
    sweep.lines = {
        "c0": Line("done", end={"angle [deg]": 10.0, "volume [mm^3]": 9.0}),
        "c1": Line("limit", "buckled", end={"angle [deg]": 99.0}),
        "c2": Line("done", end={"angle [deg]": 30.0}),
    }
    assert verdict(sweep) == "Done: 2 of 5 designs are solved; bending angle at the end from 10° to 30°."
    assert best(sweep) == [
        "Smallest bending angle 10°: loads.pressure 1 kPa.",
        "Largest bending angle 30°: loads.pressure 3 kPa.",
    ]
