"""What is read off a state: rigid motions and a bent bar, whose numbers are known beforehand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fem_spa.solid.centre_line import CentreLine
from fem_spa.solid.motion import MotionWatch
from fem_spa.solid.problem import Loads, Problem
from fem_spa.solid.space import build_space

MM = 1e-3
LENGTH = 60 * MM


@pytest.fixture(scope="module")
def bar(verification):
    """A solid bar along x, 60 x 6 x 4 mm, from the plane x = 0, about the x axis."""
    v = verification
    return v.box(
        [v.even(0, LENGTH, 12), v.even(-3 * MM, 3 * MM, 2), v.even(-2 * MM, 2 * MM, 2)],
        names={"x0": "base", "x1": "tip"},
    )


@pytest.fixture(scope="module")
def half_bar(verification):
    """Its half y >= 0."""
    v = verification
    return v.box(
        [v.even(0, LENGTH, 12), v.even(0, 3 * MM, 1), v.even(-2 * MM, 2 * MM, 2)],
        names={"x0": "base", "x1": "tip", "y0": "symmetry"},
    )


def watch(kind, verification, mesh, *displacements, **options):
    """An observer that has seen the states made of functions of the rest positions."""
    v = verification
    problem = Problem(mesh, {"body": v.material("yeoh")}, Loads([]), **options)
    space = build_space(mesh)
    observer = kind()
    observer.start(problem, space)
    for f in (lambda X: X, *displacements):
        observer.converged(SimpleNamespace(displacement=f(space.points) - space.points), None)
    return observer


def arc(total, direction):
    """The bar bent to a circular arc of a total angle, towards `direction` (rad from +y to +z)."""
    out = np.array([0.0, np.cos(direction), np.sin(direction)])
    side = np.array([0.0, -np.sin(direction), np.cos(direction)])

    def move(X):
        radius, turn = LENGTH / total, X[:, 0] / LENGTH * total
        reach = radius - X @ out
        return (
            np.outer(reach * np.sin(turn), [1.0, 0, 0])
            + np.outer(radius - reach * np.cos(turn), out)
            + np.outer(X @ side, side)
        )

    return move


@pytest.mark.parametrize("direction", [-170.0, -60.0, 0.0, 90.0, 135.0])
def test_arc_in_any_direction(verification, bar, direction):
    """tilt = total angle, chord angle half of it, chord 2 R sin(a / 2); a wrong frame turns the direction."""
    total = np.radians(50.0)
    motion = watch(MotionWatch, verification, bar, arc(total, np.radians(direction))).motions[-1]
    assert np.degrees(motion.tilt) == pytest.approx(50.0, abs=1e-6)
    assert np.degrees(motion.direction) == pytest.approx(direction, abs=1e-6)
    assert abs(motion.tip_face) == pytest.approx(total, rel=1e-6)
    assert abs(motion.chord) == pytest.approx(total / 2, rel=1e-6)
    radius = LENGTH / total
    assert motion.chord_length == pytest.approx(2 * radius * np.sin(total / 2), rel=1e-9)
    assert motion.extension == pytest.approx(radius * np.sin(total) - LENGTH, rel=1e-9)


@pytest.mark.parametrize("direction", [-90.0, 90.0])
def test_a_half_leans_in_its_plane(verification, half_bar, direction):
    """Its mirror image counts, too: no other side's share of the tip turns the direction."""
    bent = arc(np.radians(50.0), np.radians(direction))
    motion = watch(MotionWatch, verification, half_bar, bent, symmetry={"symmetry": "y"}).motions[-1]
    assert np.degrees(motion.tilt) == pytest.approx(50.0, abs=1e-6) == abs(np.degrees(motion.tip_face))
    assert np.degrees(motion.direction) == pytest.approx(direction, abs=1e-9)


def test_stroke_of_a_linear_actuator(verification, bar):
    def longer(X):
        return X * [1.25, 0.9, 0.9]

    motion = watch(MotionWatch, verification, bar, longer).motions[-1]
    assert motion.extension == pytest.approx(0.25 * LENGTH)
    assert motion.tilt == pytest.approx(0.0, abs=1e-9) and np.isnan(motion.direction)


def test_twist_about_the_axis_is_no_tilt(verification, bar):
    def twist(X):
        c, s = np.cos(0.7), np.sin(0.7)
        return X @ np.array([[1.0, 0, 0], [0, c, s], [0, -s, c]])

    motion = watch(MotionWatch, verification, bar, twist).motions[-1]
    assert motion.tilt == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("cut", [False, True], ids=["whole", "half"])
def test_centre_line_of_an_arc(verification, bar, half_bar, cut):
    """It lies on the circle; without the mirror images a half bar's line would leave the plane."""
    total = np.radians(80.0)
    mesh, symmetry = (half_bar, {"symmetry": "y"}) if cut else (bar, {})
    line = watch(CentreLine, verification, mesh, arc(total, np.radians(90.0)), symmetry=symmetry)
    radius, turn = LENGTH / total, line.arc / LENGTH * total
    circle = np.column_stack([radius * np.sin(turn), 0 * turn, radius * (1 - np.cos(turn))])
    assert line.lines[0] == pytest.approx(np.outer(line.arc, [1.0, 0, 0]), abs=1e-12)
    # sections are as long as the distance of two points at least: second order in that
    assert np.abs(line.lines[1] - circle).max() < 2e-3 * LENGTH
    out = np.abs(line.lines[1][:, 1]).max()
    assert out < (1e-12 if cut else 1e-4 * LENGTH)  # the whole mesh is not its own mirror image


def test_no_base_no_line(verification, bar):
    from dataclasses import replace

    mesh = replace(bar, surfaces={k: f for k, f in bar.surfaces.items() if k != "tip"})
    line = watch(CentreLine, verification, mesh)
    motion = watch(MotionWatch, verification, mesh).motions[-1]
    assert len(line.arc) == 0 and np.isnan(motion.tip_face) and np.isnan(motion.extension)
