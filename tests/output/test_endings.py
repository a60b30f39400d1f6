"""However a run ends, what was reached is on disk and whole."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from fem_spa.cli import main
from fem_spa.prepare import Setup
from fem_spa.solid.problem import StepControl

Make = Callable[..., Any]


@pytest.fixture
def run(
    tmp_path: Path,
    make_problem: Make,
    make_rows: Make,
    make_state: Make,
    space: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> Iterator[Callable[[BaseException], int]]:
    """A run whose solver converges three steps and then raises what it is given."""
    path = ModuleType("fem_spa.solid.path")
    setup = Setup(
        make_problem(), StepControl(), {"loads": {"pressure": "10 kPa"}}, {"body": "a test"}, [], 0.0
    )
    monkeypatch.setitem(sys.modules, "fem_spa.solid.path", path)
    monkeypatch.setattr("fem_spa.run.prepare", lambda deck: setup)
    monkeypatch.delenv("FEM_SPA_DEBUG", raising=False)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "deck.toml").write_text('[geometry]\nshape = "pneunet"\n[loads]\npressure = "10 kPa"\n')
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}

    def ends_with(error: BaseException) -> int:
        def solve(problem: Any, steps: Any, observers: Any, **_: Any) -> Any:
            for observer in observers:
                observer.start(problem, space)
            for row in make_rows(5)[:3]:
                for observer in observers:
                    observer.iteration(row.step, row.pressure, 1, 1e-3)
                    observer.converged(make_state(row), row, 0.2 * row.step)
            raise error

        path.solve = solve  # type: ignore[attr-defined]
        return main(["solve", "deck.toml"])

    yield ends_with
    for number, handler in before.items():
        signal.signal(number, handler)


def reached() -> dict[str, Any]:
    """result.json, after the other files were found whole."""
    folder = Path("out/deck")
    assert len((folder / "curve.csv").read_text().splitlines()) == 4
    assert len(list((folder / "fields").glob("*.vtu"))) == 3
    assert (folder / "fields.pvd").read_text().count("DataSet ") == 3
    for name in ("curve.png", "shape.png", "report.html"):
        assert (folder / name).stat().st_size > 1000
    assert not [path for path in folder.rglob(".*")]
    return json.loads((folder / "result.json").read_text())


def test_interrupted(run: Callable[[BaseException], int], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(KeyboardInterrupt()) == 1
    assert reached()["status"] == "interrupted"
    assert "Traceback" not in capsys.readouterr().err


def test_fault_of_the_program(
    run: Callable[[BaseException], int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(ZeroDivisionError("in the dark")) == 1
    assert "in the dark" in reached()["message"]
    assert "Traceback" in Path("out/deck/error.log").read_text()
    assert "Traceback" not in capsys.readouterr().err


def test_fields_that_cannot_be_written_leave_the_curve(
    run: Callable[[BaseException], int], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A fault on the writing thread ends the run as any other: what was reached is there, with a reason."""

    def fails(self: Any, state: Any, row: Any) -> bytes:
        raise RuntimeError("no fields today")

    monkeypatch.setattr("fem_spa.output.folder.ResultFolder._fields", fails)
    assert run(KeyboardInterrupt()) == 1
    result = json.loads(Path("out/deck/result.json").read_text())
    assert result["status"] == "diverged" and "no fields today" in result["message"]
    assert len(Path("out/deck/curve.csv").read_text().splitlines()) > 1
    assert "Traceback" not in capsys.readouterr().err


def test_fault_before_the_start_writes_nothing(
    run: Callable[[BaseException], int], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fails(deck: Any) -> Any:
        raise RuntimeError("early")

    monkeypatch.setattr("fem_spa.run.prepare", fails)
    assert run(RuntimeError()) == 1
    assert capsys.readouterr().err.count("\n") == 1 and not Path("out").exists()


@pytest.mark.parametrize(
    "late,missing",
    [
        ("fem_spa.output.curve_plot.write_curve", "curve.png"),
        ("fem_spa.output.report.write_report", "report.html"),
    ],
)
def test_interrupted_after_the_solver_has_ended(
    run: Callable[[BaseException], int],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    late: str,
    missing: str,
) -> None:
    """Ctrl-C while pictures or the report are made costs these; the run's status stays its own."""

    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(late, interrupted)
    assert run(ZeroDivisionError("in the dark")) == 1
    result = json.loads(Path("out/deck/result.json").read_text())
    assert result["status"] == "diverged"
    assert any("left out: interrupted" in warning for warning in result["warnings"])
    assert not (Path("out/deck") / missing).exists()
    captured = capsys.readouterr()
    assert "no result" not in captured.err and "before there was" not in captured.err
