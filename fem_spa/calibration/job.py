"""From a deck or model file and records to a folder: what `fem-spa calibrate` does."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fem_spa.calibration.holdout import split
from fem_spa.calibration.observation import Run, read_runs
from fem_spa.calibration.outcome import Outcome
from fem_spa.calibration.words import record
from fem_spa.errors import InputError
from fem_spa.output.claim import claimed, refused
from fem_spa.output.files import write_whole
from materials.bounded import read_toml

WRITTEN = ("calibrated.toml", "calibration.json", "calibration.png", "report.html", "mesh.msh")


@dataclass(frozen=True)
class Job:
    """What was asked for; `name` is the stem of the deck or model file."""

    given: Path
    records: tuple[Path, ...]
    holdout: tuple[Path, ...]
    vary: tuple[str, ...]
    overrides: tuple[str, ...] = ()
    seed: int = 0
    output: str | None = None


def run_job(
    job: Job,
    folder: Path,
    say: Callable[[str], None] = lambda text: None,
    observers: Sequence[Any] = (),
    command: str = "fem-spa calibrate ...",
) -> Outcome:
    """Calibrate and write calibrated.toml, calibration.json, calibration.png and report.html into `folder`.

    Raises
    ------
    InputError
        The input is wrong, in one line; nothing was written. Or the folder cannot be, or another run has it.
    """
    with claimed(folder):
        is_model = _is_model(job.given)
        runs = read_runs([*job.records, *job.holdout])
        if is_model:
            outcome, text, mesh = _model(job, runs, say)
        else:
            outcome, text, mesh = _deck(job, *_split(job, runs), say, observers)
        _write(job, folder, outcome, text, mesh, command)
    return outcome


def _is_model(path: Path) -> bool:
    """Whether a file is a model's and not a deck."""
    try:
        tables = read_toml(path)
    except OSError as error:
        raise InputError(
            f"given {path}: it cannot be read ({error.strerror}); give a deck or a model file (.toml)"
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"given {path}: this is not TOML: {' '.join(str(error).split())}") from None
    if "model" in tables and "geometry" in tables:
        raise InputError(f"given {path}: it has [model] and [geometry]; give a model file or a deck")
    model = tables.get("model")
    if isinstance(model, dict) and model.get("kind") == "fem":
        deck = model.get("deck", "")
        if tables.get("effects"):
            raise InputError(
                f"given {path}: kind 'fem' stands for a deck, and a deck is not fitted through [effects]; "
                f"give that deck itself ({deck}), or its curve.csv as kind 'curve' with these [effects] and "
                "[scales]"
            )
        raise InputError(f"given {path}: kind 'fem' stands for a deck; give that deck itself ({deck})")
    if "model" not in tables and "effects" in tables:
        raise InputError(
            f"given {path}: [effects] stand beside [model] in a model file, a deck has none; leave [effects] "
            "and [scales] out, or give the model file"
        )
    return "model" in tables


def _split(job: Job, runs: Sequence[Run]) -> tuple[list[Run], list[Run]]:
    """Training and held-out runs, as the call names them."""
    named = {path.resolve() for path in job.holdout}
    held = [run for run in runs if run.path.resolve() in named]
    return split([run for run in runs if run not in held], held, job.seed)


def _model(
    job: Job, runs: Sequence[Run], say: Callable[[str], None]
) -> tuple[Outcome, str, Callable[[Path], None] | None]:
    from fem_spa.calibration.carried import carried, kept_tables
    from fem_spa.calibration.reduced import calibrate, model_table
    from fem_spa.loop.model_file import read_source
    from fem_spa.output.toml import to_toml
    from fem_spa.reduced.tables import toml_text

    if job.overrides:
        raise InputError("given --set with a model file: it changes decks; edit the model file instead")
    source = read_source(job.given)
    through, runs = carried(source, job.given, runs)
    train, held = _split(job, runs)
    fitted, outcome = calibrate(source.model, train, held, job.vary, say, output=job.output, through=through)
    kept = to_toml(kept_tables(read_toml(job.given)))
    return outcome, toml_text(model_table(fitted, outcome)) + kept, None


def _deck(
    job: Job,
    train: Sequence[Run],
    held: Sequence[Run],
    say: Callable[[str], None],
    observers: Sequence[Any],
) -> tuple[Outcome, str, Callable[[Path], None] | None]:
    from fem_spa.calibration.deck_numbers import moved_mesh
    from fem_spa.calibration.finite_elements import calibrate_deck
    from fem_spa.deck import read_deck
    from fem_spa.output.toml import to_toml

    deck = read_deck(job.given, job.overrides)
    found, values, outcome, _ = calibrate_deck(deck, train, held, job.vary, say, observers, output=job.output)
    mesh = (lambda path: moved_mesh(found, values, path)) if found.mode is not None else None
    low, high = outcome.valid.low, outcome.valid.high
    error = outcome.valid.error
    told = (
        f", error {outcome.shown(error):.3g} {outcome.unit} on data held out"
        if error is not None and math.isfinite(error)
        else ""
    )
    ends = ", ".join(f"{a / 1e3:.4g} to {b / 1e3:.4g} kPa" for a, b in zip(low, high, strict=True))
    head = f"# Calibrated from {outcome.valid.source}: {ends}{told}. Beyond that it is extrapolation.\n"
    return outcome, head + to_toml(found.tables(values, "mesh.msh")), mesh


def _write(
    job: Job,
    folder: Path,
    outcome: Outcome,
    text: str,
    mesh: Callable[[Path], None] | None,
    command: str,
) -> None:
    from fem_spa.calibration.page import write_page
    from fem_spa.calibration.picture import draw

    with refused(folder):
        for name in WRITTEN:
            (folder / name).unlink(missing_ok=True)
        write_whole(folder / "calibrated.toml", text)
    if mesh is not None:
        mesh(folder / "mesh.msh")
    table = record(outcome, job.given.name, job.seed)
    write_whole(folder / "calibration.json", json.dumps(table, indent=1, ensure_ascii=False) + "\n")
    draw(outcome, folder / "calibration.png")
    write_page(folder / "report.html", outcome, job.given.name, text, command)
