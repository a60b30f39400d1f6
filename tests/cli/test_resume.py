"""A run that is cut off goes on with --resume as if nothing had been; a folder belongs to one run."""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from fem_spa import prepare
from fem_spa.checkpoint import FORMAT
from fem_spa.cli import main
from fem_spa.errors import InputError
from fem_spa.output.claim import Claim, refuse_busy
from fem_spa.run import run_deck
from fem_spa.solid.observe import Silent
from geometry.tagged import TaggedMesh

Deck = Callable[..., str]


class Killed(BaseException):
    """What no part of the program catches, as it cannot catch kill -9."""


class At(Silent):
    """Does something when step `step` is being solved, or, -1, when the solver begins."""

    def __init__(self, step: int, what: Callable[[], None]) -> None:
        self.step, self.what = step, what

    def start(self, problem: Any, space: Any) -> None:
        if self.step < 0:
            self.what()

    def iteration(self, step: int, pressure: Any, iteration: int, error: float) -> None:
        if step == self.step and iteration == 0:
            self.what()


def die() -> None:
    raise Killed


@pytest.fixture(autouse=True)
def without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fem_spa.run._pictures", lambda *_: None)


@pytest.fixture
def whole(long_deck: Deck) -> dict[str, bytes]:
    """What an undisturbed run leaves; the deck is there as deck.toml."""
    assert main(["solve", long_deck(), "--out", "whole"]) == 0
    return results("whole")


def results(folder: str) -> dict[str, bytes]:
    """Everything that a run leaves, without what tells of its time: pictures and report come from it."""
    kept = [path for path in Path(folder).rglob("*") if path.is_file()]
    out = {str(path.relative_to(folder)): path.read_bytes() for path in kept}
    record = json.loads(out.pop("result.json"))
    for name in ("seconds", "peak_rss_mb"):
        record.pop(name)
    out.pop("report.html", None)
    return {**out, "result.json": json.dumps(record).encode()}


def cut(step: int) -> None:
    """A run into `out` that dies while it solves a step."""
    with pytest.raises(Killed):
        run_deck("deck.toml", "out", observers=[At(step, die)], quiet=True)
    assert not (Path("out") / "result.json").exists()


@pytest.mark.parametrize("steps", [[1], [4, 7]])
def test_goes_on_where_it_was_killed(whole: dict[str, bytes], steps: list[int], capsys: Any) -> None:
    """Also when killed twice; all files are to the last byte those of an undisturbed run."""
    cut(steps[0])
    for step in steps[1:]:
        with pytest.raises(Killed):
            run_deck("deck.toml", "out", observers=[At(step, die)], quiet=True, resume=True)
    assert main(["solve", "deck.toml", "--out", "out", "--resume"]) == 0
    assert f"going on after step {steps[-1] - 1}" in capsys.readouterr().err
    assert results("out") == whole


def test_killed_before_its_first_step(whole: dict[str, bytes], capsys: Any) -> None:
    cut(-1)
    assert main(["solve", "deck.toml", "--out", "out", "--resume"]) == 0
    assert "a new run" in capsys.readouterr().err
    assert results("out") == whole


@pytest.mark.parametrize("end", [".json", ".npy"])
def test_a_damaged_checkpoint_gives_way_to_the_one_before(
    whole: dict[str, bytes], capsys: Any, end: str
) -> None:
    """A power cut may leave a file of the right name and wrong content."""
    cut(5)
    last = sorted(Path("out/checkpoint").glob(f"*[0-9]{end}"))[-1]
    data = bytearray(last.read_bytes())
    data[-20:] = bytes(20)
    last.write_bytes(data)
    assert main(["solve", "deck.toml", "--out", "out", "--resume"]) == 0
    assert "going on after step 3" in capsys.readouterr().err
    assert results("out") == whole


def test_a_checkpoint_of_an_earlier_version_is_one_line(whole: dict[str, bytes], capsys: Any) -> None:
    """What a checkpoint holds changes between versions; going on from an older one would be a KeyError."""
    cut(5)
    for path in Path("out/checkpoint").glob("checkpoint_*.json"):
        path.write_text(path.read_text().replace(f'"format": {FORMAT}', f'"format": {FORMAT - 1}'))
    kept = {path.name for path in Path("out/checkpoint").iterdir()}
    capsys.readouterr()
    assert main(["solve", "deck.toml", "--out", "out", "--resume"]) == 2
    told = [line for line in capsys.readouterr().err.splitlines() if "meshing" not in line]
    assert len(told) == 1 and f"format {FORMAT - 1}" in told[0] and "leave out --resume" in told[0]
    assert {path.name for path in Path("out/checkpoint").iterdir()} == kept
    assert main(["solve", "deck.toml", "--out", "out"]) == 0
    assert results("out") == whole


def test_without_resume_a_run_begins_anew(whole: dict[str, bytes]) -> None:
    cut(5)
    assert main(["solve", "deck.toml", "--out", "out"]) == 0
    assert results("out") == whole


def test_a_run_that_has_ended_is_not_run_again(whole: dict[str, bytes], capsys: Any) -> None:
    seen = At(1, die)
    assert run_deck("deck.toml", "whole", observers=[seen], quiet=True, resume=True).exit_status == 0
    assert main(["solve", "deck.toml", "--out", "whole", "--resume"]) == 0
    assert "Nothing to do" in capsys.readouterr().out and results("whole") == whole
    assert main(["solve", "deck.toml", "--out", "whole", "--resume", "--set", "loads.pressure='7 kPa'"]) == 2
    line = capsys.readouterr().err
    assert "'7 kPa'" in line.replace('"', "'") and "6 kPa" in line and results("whole") == whole


@pytest.mark.parametrize(
    "change,word",
    [
        ("loads.pressure='7 kPa'", "loads.pressure"),
        ("materials.body.C10='0.2 MPa'", "materials.body.C10"),
        ("solver.imposed_steps=5", "solver.imposed_steps"),
    ],
)
def test_another_deck_is_refused_with_the_difference(
    long_deck: Deck, capsys: Any, change: str, word: str
) -> None:
    long_deck()
    cut(3)
    before = {path: path.read_bytes() for path in Path("out").rglob("*") if path.is_file()}
    assert main(["solve", "deck.toml", "--out", "out", "--resume", "--set", change]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and f"{word} was" in lines[0]
    after = {path: path.read_bytes() for path in Path("out").rglob("*") if path.is_file()}
    assert {k: v for k, v in after.items() if k.name != ".lock"} == before


def test_another_mesh_is_refused(long_deck: Deck, block: TaggedMesh, capsys: Any) -> None:
    long_deck()
    cut(3)
    long_deck(points=block.points * 1.0001)
    assert main(["solve", "deck.toml", "--out", "out", "--resume"]) == 2
    assert "mesh" in capsys.readouterr().err


def test_the_mesh_of_the_run_is_kept(long_deck: Deck, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    """Meshing anew gives points that differ in the last bits: the run goes on, and has ended, on its own."""
    long_deck()
    new, times = prepare._new_mesh, itertools.count(1)

    def meshed(*words: Any) -> TaggedMesh:
        mesh = new(*words)
        return replace(mesh, points=mesh.points * (1.0 + 1e-15 * next(times)))

    monkeypatch.setattr(prepare, "_new_mesh", meshed)
    cut(3)
    assert main(["solve", "deck.toml", "--out", "out", "--resume"]) == 0
    assert "going on after step 2" in capsys.readouterr().err
    assert main(["solve", "deck.toml", "--out", "out", "--resume"]) == 0
    assert "Nothing to do" in capsys.readouterr().out
    assert next(times) == 2
    assert main(["solve", "deck.toml", "--out", "out"]) == 0  # anew: its own mesh, which is then the one kept
    assert main(["solve", "deck.toml", "--out", "out", "--resume"]) == 0
    assert len(list(Path("out/mesh").iterdir())) == 1


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_ctrl_c_ends_after_the_iteration(whole: dict[str, bytes], name: str, capsys: Any) -> None:
    """Status 1, everything whole; --resume then gives what an undisturbed run gives."""
    before = signal.getsignal(getattr(signal, name))
    stop = At(5, lambda: signal.raise_signal(getattr(signal, name)))
    outcome = run_deck("deck.toml", "out", observers=[stop], quiet=True)
    assert signal.getsignal(getattr(signal, name)) == before
    assert outcome.exit_status == 1 and len(outcome.result.rows) == 5
    record = json.loads(Path("out/result.json").read_text())
    assert record["status"] == "interrupted" and Path("out/report.html").is_file()
    assert whole["curve.csv"].startswith(Path("out/curve.csv").read_bytes())
    assert len(list(Path("out/fields").iterdir())) == 5
    assert main(["solve", "deck.toml", "--out", "out", "--resume"]) == 0
    assert results("out") == whole


@pytest.mark.parametrize("room", [2, 20, 46])
def test_a_full_disk_is_one_line_and_loses_nothing(
    whole: dict[str, bytes], monkeypatch: pytest.MonkeyPatch, capsys: Any, full_disk: Any, room: int
) -> None:
    """Full from the so-many-th file on: at the beginning, on the way, while the result is written."""
    with monkeypatch.context() as full:
        full_disk(full, room)
        assert main(["solve", "deck.toml", "--out", "out"]) == (2 if room < 3 else 1)
    lines = [line for line in capsys.readouterr().err.splitlines() if "No space" in line]
    assert len(lines) == 1 and "Traceback" not in lines[0]
    assert whole["curve.csv"].startswith(Path("out/curve.csv").read_bytes())
    assert main(["solve", "deck.toml", "--out", "out", "--resume"]) == 0
    assert results("out") == whole


def test_a_folder_belongs_to_one_run(long_deck: Deck, capsys: Any, tmp_path: Path) -> None:
    """Refused before it meshes; what the other has written stays. Its lock does not outlive it."""
    long_deck()
    Path("out").mkdir()
    Path("out/curve.csv").write_text("the other's\n")
    with Claim(Path("out")):
        assert main(["solve", "deck.toml", "--out", "out"]) == 2
        line = capsys.readouterr().err
        assert "another run" in line and f"process {os.getpid()}" in line and line.count("\n") == 1
        with pytest.raises(InputError, match="another run"), Claim(Path("out")):
            pass
        assert Path("out/curve.csv").read_text() == "the other's\n"
    assert not Path("out/.lock").exists()
    refuse_busy(Path("out"))


def test_a_killed_run_leaves_no_lock(tmp_path: Path) -> None:
    """The file `.lock` of a process that was killed keeps no one out."""
    code = "import sys, time; from pathlib import Path; from fem_spa.output.claim import Claim\n"
    code += f"with Claim(Path({str(tmp_path)!r})): print('held', flush=True); time.sleep(60)"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, env=environment) as other:
        assert other.stdout is not None and other.stdout.readline() == b"held\n"
        with pytest.raises(InputError, match=f"process {other.pid}"):
            refuse_busy(tmp_path)
        other.kill()
        other.wait()
    assert (tmp_path / ".lock").exists()
    refuse_busy(tmp_path)
    with Claim(tmp_path):
        pass
