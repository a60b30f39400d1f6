"""From the deck of a short piece to the law of its chamber: what `fem-spa calibrate --segment` does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.calibration.segment import SegmentLaw, chamber_law
from fem_spa.deck import read_deck
from fem_spa.errors import InputError
from fem_spa.output.claim import claimed, refused
from fem_spa.output.files import write_whole
from fem_spa.prepare import prepare
from fem_spa.reduced.tables import toml_text
from fem_spa.solid.problem import Problem
from fem_spa.units import show

WRITTEN = ("law.csv", "segments.toml", "law.png")


@dataclass(frozen=True)
class SegmentJob:
    """What was asked for.

    cavity : the pressurised one;  near, far : m, the two sections, from the base
    reach : m, half the thickness of a section; None: a tenth of the gauge
    count, pitch : of the row of chambers that is to be written, or None
    """

    deck: Path
    cavity: str
    near: float
    far: float
    reach: float | None = None
    count: int | None = None
    pitch: float | None = None
    overrides: tuple[str, ...] = ()


def run_segment(
    job: SegmentJob,
    folder: Path,
    say: Callable[[str], None] = lambda text: None,
    observers: Sequence[Any] = (),
) -> SegmentLaw:
    """Solve the piece; write law.csv (for a rod), segments.toml (with count and pitch) and law.png.

    Raises
    ------
    InputError
        The input is wrong, in one line; nothing was written. Or the folder cannot be, or another run has it.
    """
    if (job.count is None) != (job.pitch is None):
        raise InputError("a row of chambers needs --count and --pitch, both or neither")
    with claimed(folder):
        law, problem = _solved(job, say, observers)
        with refused(folder):
            for name in WRITTEN:
                (folder / name).unlink(missing_ok=True)
            write_whole(folder / "law.csv", law_csv(law))
        if job.count is not None and job.pitch is not None:
            row = law.segments(job.count, job.pitch, _mass_of_one(problem, job.pitch))
            write_whole(folder / "segments.toml", toml_text(row.table()))
        draw(law, folder / "law.png")
    return law


def _solved(
    job: SegmentJob, say: Callable[[str], None], observers: Sequence[Any]
) -> tuple[SegmentLaw, Problem]:
    """The law, and the piece that it is of."""
    setup = prepare(read_deck(job.deck, job.overrides))
    problem = setup.problem
    if job.cavity not in problem.mesh.cavities:
        raise InputError(
            f"given --segment {job.cavity}: the piece has the cavities {', '.join(problem.mesh.cavities)}"
        )
    if problem.loads.control != "pressure":
        raise InputError(f'given control = "{problem.loads.control}": a law is over pressure; set "pressure"')
    top = float(problem.loads.points[-1][job.cavity])
    if top == 0.0:
        raise InputError(f"loads.pressure of {job.cavity} is zero: give the largest one that the law is for")
    from fem_spa.run import listen

    listen()
    reach = job.reach if job.reach is not None else 0.1 * (job.far - job.near)
    law = chamber_law(
        problem, job.cavity, top, job.near, job.far, reach, layer_line(problem), setup.steps, observers
    )
    say(f"{len(law.pressure)} states up to {show(float(law.pressure[-1]), 'Pa')}")
    return law, problem


def _mass_of_one(problem: Problem, pitch: float) -> float:
    """kg of a chamber of the row; 0 where a density is not known."""
    if any(m.density is None for m in problem.materials.values()):
        return 0.0
    return _mass(problem) * pitch / float(np.ptp(problem.mesh.points @ _along(problem)))


def layer_line(problem: Problem) -> np.ndarray | None:
    """(2, 3): a point of the line along a membrane, which keeps its length, and its direction; or None."""
    mesh = problem.mesh
    if not problem.layers:
        return None
    faces = mesh.surfaces[f"layer {next(iter(problem.layers))}"]
    middle = mesh.points[np.unique(faces[:, :3])].mean(axis=0)
    along = _along(problem)
    base = mesh.points[np.unique(mesh.surfaces[problem.fixed[0]][:, :3])].mean(axis=0)
    point = middle + ((base - middle) @ along) * along
    for name, axis in problem.symmetry.items():
        i = "xyz".index(axis)
        point[i] = float(mesh.points[mesh.surfaces[name][:, :3], i].mean())
    return np.array([point, along])


def _along(problem: Problem) -> np.ndarray:
    """(3,) unit vector, the coordinate axis nearest to the line from base to tip."""
    mesh = problem.mesh
    ends = [mesh.points[np.unique(mesh.surfaces[n][:, :3])].mean(axis=0) for n in (problem.fixed[0], "tip")]
    way = ends[1] - ends[0]
    i = int(np.argmax(np.abs(way)))
    return np.eye(3)[i] * np.sign(way[i])


def _mass(problem: Problem) -> float:
    """kg of the whole piece."""
    mesh = problem.mesh
    X = mesh.points[mesh.tets[:, :4]]
    volume = np.abs(np.linalg.det(X[:, 1:] - X[:, :1])) / 6.0
    total = sum(
        float(volume[mesh.volumes[n]].sum()) * float(m.density or 0.0) for n, m in problem.materials.items()
    )
    return total * 2.0 ** len(set(problem.symmetry.values()))


def law_csv(law: SegmentLaw) -> str:
    """The law as `fem_spa.reduced.rod_law` reads it."""
    lines = [
        f"# bending stiffness: {law.bending_stiffness:.8g} N*m^2",
        *([f"# axial stiffness: {law.axial_stiffness:.8g} N"] if law.axial_stiffness else []),
        f"# source: {' '.join(law.source.split())}",
        "pressure [kPa],curvature [1/m],stretch,moment [N*m]",
    ]
    for row in zip(law.pressure / 1e3, law.curvature, law.stretch, law.moment, strict=True):
        lines.append(",".join(f"{number:.10g}" for number in row))
    return "\n".join(lines) + "\n"


def draw(law: SegmentLaw, path: Path) -> None:
    """Curvature, the moment that would hold the piece straight, and stretch over pressure."""
    from fem_spa.output.style import ACCENT, SECOND, figure, tidy, write_picture

    picture = figure(10.0, 4.0)
    left, right = picture.subplots(1, 2)
    left.plot(law.pressure / 1e3, law.curvature, "o-", ms=3, color=ACCENT)
    left.set(title="Curvature and moment", xlabel="pressure [kPa]", ylabel="curvature [1/m]")
    EI = law.bending_stiffness
    left.secondary_yaxis("right", functions=(lambda k: EI * k, lambda m: m / EI)).set_ylabel("moment [N m]")
    right.plot(law.pressure / 1e3, 100 * law.stretch, "o-", ms=3, color=SECOND)
    right.set(title="Stretch", xlabel="pressure [kPa]", ylabel="axial strain [%]")
    for axes in (left, right):
        tidy(axes)
    write_picture(path, picture, 110)
