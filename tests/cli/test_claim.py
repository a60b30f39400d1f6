"""`diagnose` and `calibrate` have their folder to themselves, and say at once where they cannot have it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fem_spa.cli import main
from fem_spa.errors import InputError
from fem_spa.output.claim import Claim, claimed

MODEL = '[model]\nkind = "curve"\ncolumns = ["pressure [kPa]", "angle [deg]"]\nrows = [[0, 0], [50, 40]]\n'
WORK = {  # what takes long in each, and how it is called
    "fem_spa.loop.diagnose.prepare": ["diagnose", "model.toml", "run.csv"],
    "fem_spa.calibration.reduced.calibrate": ["calibrate", "model.toml", "run.csv", "--vary", "scale"],
    "fem_spa.calibration.segment_job.prepare": [
        *("calibrate", "deck.toml", "--segment", "main", "--gauge", "2 mm", "8 mm"),
    ],
}


@pytest.fixture
def inputs(deck: Callable[..., str]) -> None:
    deck()
    Path("model.toml").write_text(MODEL)
    rows = "".join(f"{0.1 * k:.1f},{k % 50},{0.8 * (k % 50) + 0.01 * (k % 7)}\n" for k in range(200))
    Path("run.csv").write_text("time [s],pressure [kPa],angle [deg]\n" + rows)


@pytest.mark.parametrize("work", WORK)
def test_a_second_run_is_refused_while_the_first_works(
    inputs: None, monkeypatch: pytest.MonkeyPatch, capsys: Any, work: str
) -> None:
    """One line, before it has read its files; the first one, which fails, leaves no folder."""
    call = [*WORK[work], "--out", "results/here"]
    said = []

    def meanwhile(*_: Any, **__: Any) -> Any:
        capsys.readouterr()
        assert main([call[0], "none.toml", *call[2:]]) == 2
        said.append(capsys.readouterr().err)
        raise InputError("that will do")

    monkeypatch.setattr(work, meanwhile)
    assert main(call) == 2
    assert len(said) == 1 and said[0].count("\n") == 1
    assert "another run is writing there" in said[0] and "results/here" in said[0]
    assert not Path("results").exists()


@pytest.mark.parametrize("work", WORK)
@pytest.mark.parametrize("place", ["file", "file/below", "closed/here"])
def test_a_folder_that_cannot_be_is_refused_before_the_work(
    inputs: None, monkeypatch: pytest.MonkeyPatch, capsys: Any, work: str, place: str
) -> None:
    monkeypatch.setattr(work, lambda *_, **__: pytest.fail("it was begun"))
    Path("file").write_text("mine")
    mkdir = Path.mkdir

    def refuse(self: Path, *args: Any, **kinds: Any) -> None:
        if self.parts[0] == "closed":
            raise PermissionError(13, "Permission denied")
        mkdir(self, *args, **kinds)

    monkeypatch.setattr(Path, "mkdir", refuse)
    before = sorted(Path().iterdir())
    assert main([*WORK[work], "--out", place]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and place in lines[0]
    assert sorted(Path().iterdir()) == before and Path("file").read_text() == "mine"


def test_what_was_made_and_stays_empty_goes_again(tmp_path: Path) -> None:
    """Neither a folder that was there nor one that something is in."""
    with claimed(tmp_path / "a" / "b"):
        assert (tmp_path / "a" / "b" / ".lock").exists()
        with pytest.raises(InputError, match="another run"), claimed(tmp_path / "a" / "b"):
            pass
        (tmp_path / "a" / "kept").touch()
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["a", "kept"]
    with pytest.raises(ZeroDivisionError), claimed(tmp_path / "a"):
        raise ZeroDivisionError
    with Claim(tmp_path / "a"):
        pass
