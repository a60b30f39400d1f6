"""A short set of the random inputs of benchmarks/bad_input.py, and sizes that nobody can mean."""

from __future__ import annotations

import importlib
import resource
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from fem_spa.cli import main

Deck = Callable[..., str]
BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def bad_input(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    yield importlib.import_module("bad_input")
    for name in ("bad_input", "bad_input_draws", "bad_input_files", "bad_input_words", "faults"):
        sys.modules.pop(name, None)


@pytest.mark.parametrize("kind", ["deck", "card", "mesh", "model", "curve", "command line"])
def test_random_input_is_refused_or_makes_sense(bad_input: Any, kind: str) -> None:
    """No traceback, no fault, no hang, nothing written where it is refused, no nonsense where it is not."""
    told: list[str] = []
    wrong = bad_input.run(5, 7, (kind,), told.append)
    assert not wrong, "\n".join(told)


def test_the_judge_sees_what_is_wrong(
    bad_input: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A program that fails in each way that is looked for is found out."""
    monkeypatch.chdir(tmp_path)
    draw = bad_input.Draw("deck", ("solve", "deck.toml"), {"deck.toml": b""})

    def judged(program: Callable[[list[str]], int]) -> str | None:
        monkeypatch.setattr(bad_input, "program", program)
        return bad_input.judge(draw, tmp_path)[1]

    def says(text: str, status: int, file: str | None = None) -> Callable[[list[str]], int]:
        def program(_: list[str]) -> int:
            sys.stderr.write(text)
            if file is not None:
                (tmp_path / file).write_text("x")
            return status

        return program

    def raises(_: list[str]) -> int:
        raise ZeroDivisionError("oh")

    assert judged(says("fem-spa: no\n", 2)) is None
    assert "oh" in (judged(raises) or "")
    assert "2 lines" in (judged(says("fem-spa: no\nmore\n", 2)) or "")
    assert "fault" in (judged(says("fem-spa: a fault of the program: X\n", 1)) or "")
    assert "status 3" in (judged(says("", 3)) or "")
    assert "wrote" in (judged(says("fem-spa: no\n", 2, "left")) or "")


@pytest.fixture
def little_memory() -> Iterator[None]:
    """Four gigabytes of addresses more than what is in use now: who takes more is found out."""
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + 4_000_000_000, hard))
    yield
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


HUGE = [
    "geometry={ shape = 'pneunet', size = '1e-9 m' }",
    "geometry={ shape = 'pneunet', size = '0.02 mm' }",
    "geometry={ shape = 'pneunet', slow_chambers = 1000000000 }",
    "geometry={ shape = 'tube', length = '1e9 m' }",
    "loads.points=1000000000000",
    "solver.imposed_steps=1000000000000",
    "solver.max_iterations=1000000000000",
    "loads.path=" + "[" * 400 + "]" * 400,
    ".".join("a" * 3000) + "=1",
]


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc and RLIMIT_AS")
@pytest.mark.parametrize("setting", HUGE, ids=[setting[:50] for setting in HUGE])
def test_huge_sizes_and_counts(deck: Deck, little_memory: None, capsys: Any, setting: str) -> None:
    text = '[materials.body]\ncard = "dragon-skin-30"\n[loads]\n'
    text += "pressure = '1 kPa'\n" if "tube" in setting else 'pressure = { slow = "4 kPa", fast = "2 kPa" }\n'
    path = deck(text)
    words = ["solve", path, "--set", setting]
    if not setting.startswith("geometry"):
        words += ["--set", "geometry.shape=pneunet"]
    assert main(words) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and len(lines[0]) < 600


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc and RLIMIT_AS")
@pytest.mark.parametrize("name", ["deck.toml", "block.msh", "model.toml", "run.csv", "test.csv", "card.toml"])
def test_a_file_of_ten_gigabytes(deck: Deck, little_memory: None, capsys: Any, name: str) -> None:
    """A sparse one, which takes no room on the disk: refused by its size, not after reading."""
    path = deck()
    Path("run.csv").write_text("time [s],pressure [kPa],angle [deg]\n0,0,0\n")
    Path("model.toml").write_text('[model]\nkind = "kelvin-voigt"\nk1 = "1 kPa/mm"\n')
    with open(name, "wb") as file:
        file.truncate(10_000_000_000)
    words = {
        "model.toml": ["simulate", "model.toml", "run.csv"],
        "run.csv": ["diagnose", "model.toml", "run.csv"],
        "test.csv": ["fit", "test.csv"],
        "card.toml": ["solve", path, "--set", "materials.body={ card = 'card.toml' }"],
    }.get(name, ["solve", path])
    if name == "run.csv":
        Path("line.csv").write_text("pressure [kPa],angle [deg]\n0,0\n50,40\n")
        Path("model.toml").write_text('[model]\nkind = "curve"\nfile = "line.csv"\n')
    assert main(words) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and name in lines[0]
    assert "larger than" in lines[0] or "GB" in lines[0]


def test_an_endless_file(deck: Deck, capsys: Any) -> None:
    deck()
    for words in (["solve", "/dev/zero"], ["fit", "/dev/zero"], ["simulate", "/dev/zero", "run.csv"]):
        assert main(words) == 2
        assert capsys.readouterr().err.count("\n") == 1
