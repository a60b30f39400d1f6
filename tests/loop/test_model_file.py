"""Model files with effects: what is wrong is said in a line, with what is allowed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fem_spa.cli import main

HEAD = '[model]\nkind = "curve"\nfile = "curve.csv"\n'
SCALES = '[scales]\npressure = "50 kPa"\nresponse = [0.7]\nrest = [0.0]\ncycles = 20.0\nseconds = 400.0\n'
FRICTION = "[effects.friction]\nstick = 0.02\nrub = 0.0\nhold = 0.9\nspread = 0.4\n"


def write(folder: Path, model: str) -> None:
    """The model file, its curve and a record."""
    (folder / "curve.csv").write_text("pressure [kPa],angle [deg]\n0,0\n25,15\n50,40\n")
    (folder / "model.toml").write_text(model)
    (folder / "run.csv").write_text("time [s],pressure [kPa],angle [deg]\n0,0,0\n1,25,15\n2,50,39\n")


def simulate(folder: Path) -> int:
    """Exit status of `fem-spa simulate` on them, into `folder`/o."""
    given = [str(folder / name) for name in ("model.toml", "run.csv")]
    return main(["simulate", *given, "--out", str(folder / "o")])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("hold = 0.9\nspread = 0.4", "way = 0.02", "known are stick, rub, hold, spread"),
        ("hold = 0.9\n", "", "'hold' is missing"),
        ("hold = 0.9", "hold = 90", "from 0.1 to 3 is allowed"),
        (FRICTION, "[effects]\nfriction = 3\n", "a table is needed, with stick, rub, hold, spread"),
        ("cycles = 20.0", 'cycles = "x"', "1 plain number(s) are needed"),
        ("cycles = 20.0", "cycles = 0.0", "must be above 0"),
        ("response = [0.7]", 'response = ["a"]', "1 plain number(s) are needed"),
        ("response = [0.7]", "response = [0.0]", "response may not be 0"),
        ("response = [0.7]", "response = [nan]", "1 plain number(s) are needed"),
        ("rest = [0.0]", "rest = [0.0, 0.0]", "1 plain number(s) are needed"),
    ],
)
def test_a_wrong_model_file_is_one_line(tmp_path: Path, capsys: Any, old: str, new: str, words: str) -> None:
    text = HEAD + SCALES + FRICTION
    assert old in text
    write(tmp_path, text.replace(old, new))
    assert simulate(tmp_path) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and words in lines[0], lines
    assert not (tmp_path / "o").exists()


def test_the_file_as_it_is_passes(tmp_path: Path) -> None:
    write(tmp_path, HEAD + SCALES + FRICTION)
    assert simulate(tmp_path) == 0


def test_scales_may_be_of_some_of_the_outputs(tmp_path: Path, capsys: Any) -> None:
    """A chain has four outputs; what was diagnosed by its angle has the scales of one."""
    chain = HEAD.replace('"curve"\nfile = "curve.csv"', '"chain"\nsegments = 5')
    (tmp_path / "model.toml").write_text(chain + SCALES + FRICTION)
    rows = "time [s],pressure [kPa],{}\n0,0,0\n1,25,1\n2,50,3\n"
    for name in ("angle [deg]", "x [mm],y [mm]"):
        text = rows.format(name)
        if "," in name:
            text = text.replace(",0\n", ",0,0\n").replace(",1\n", ",1,1\n").replace(",3\n", ",3,3\n")
        (tmp_path / "run.csv").write_text(text)
        assert simulate(tmp_path) == (0 if "angle" in name else 2)
    assert "are of 1 output(s), the records have x, y" in capsys.readouterr().err
