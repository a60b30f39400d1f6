"""Dask: a real scheduler and two real workers, each a process of its own; one of them is killed."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import jobs
import pytest

from fem_spa.engine import EngineGone, WorkerLost, cluster, open_engine
from fem_spa.errors import InputError

pytest.importorskip("distributed", reason='Dask is not installed: pip install "fem-spa[cluster]"')


@dataclass
class Machines:
    """A scheduler's address and its two workers."""

    address: str
    workers: list[subprocess.Popen[bytes]]


def wait_for(path: Path, what: str, seconds: float = 90.0) -> None:
    until = time.monotonic() + seconds
    while not path.exists():
        assert time.monotonic() < until, f"no {what} after {seconds:g} s"
        time.sleep(0.05)


def alive(pid: str) -> bool:
    return Path(f"/proc/{pid}").exists()


@pytest.fixture(scope="module")
def machines(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Machines]:
    with started(tmp_path_factory.mktemp("machines")) as found:
        yield found


@contextlib.contextmanager
def started(folder: Path) -> Iterator[Machines]:
    """`dask scheduler` and two `dask worker --no-nanny --nthreads 1`, as on a cluster."""
    file = folder / "scheduler.json"
    path = os.pathsep.join([str(Path(jobs.__file__).parent), *filter(None, sys.path)])
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    quiet["env"] = {**os.environ, "PYTHONPATH": path, "DASK_TEMPORARY_DIRECTORY": str(folder)}
    head = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    work = [sys.executable, "-m", "distributed.cli.dask_worker", "--nthreads", "1", "--no-nanny"]
    head += ["--no-dashboard", "--scheduler-file", str(file)]
    work += ["--no-dashboard", "--local-directory", str(folder), "--scheduler-file", str(file)]
    scheduler = subprocess.Popen(head, **quiet)
    workers: list[subprocess.Popen[bytes]] = []
    try:
        wait_for(file, "scheduler")
        workers += [subprocess.Popen(work, **quiet) for _ in range(2)]
        from distributed import Client

        address = json.loads(file.read_text())["address"]
        with Client(address, timeout=60, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=90)
        yield Machines(address, workers)
    finally:
        for process in [*workers, scheduler]:
            process.kill()
            process.wait()


def test_exceptions_and_deaths_are_rows(machines: Machines) -> None:
    with open_engine(machines.address) as engine:
        ended = {e.number: e for e in engine.run(jobs.refuse_odd, [0, 1])}
        assert ended[0].value == 0
        assert isinstance(ended[1].error, ValueError) and str(ended[1].error) == "1 is odd"
        killed = next(iter(engine.run(jobs.die, [0])))
        assert isinstance(killed.error, WorkerLost) and "SIGKILL" in str(killed.error)
        assert [e.value for e in engine.run(jobs.square, [3.0])] == [9.0]


def test_closing_interrupts_what_runs_on_the_cluster(machines: Machines, tmp_path: Path) -> None:
    begun = tmp_path / "job"
    with open_engine(machines.address) as engine:

        def run() -> None:
            with contextlib.suppress(EngineGone):
                list(engine.run(jobs.wait, [str(begun)]))

        threading.Thread(target=run, daemon=True).start()
        wait_for(begun, "task")
        time.sleep(0.3)
    assert begun.with_suffix(".kept").read_text() == "kept"


def test_tasks_go_on_when_one_of_two_workers_is_killed(machines: Machines, tmp_path: Path) -> None:
    """The last one with these machines: one of them is not there afterwards."""
    place = tmp_path / "begun"
    place.mkdir()
    with open_engine(machines.address) as engine:
        assert engine.workers == 2
        found: dict[int, int] = {}
        for ended in engine.run(jobs.slowly, [(str(place), k) for k in range(10)]):
            assert ended.error is None
            found[ended.number] = ended.value[1]
            if len(found) == 2:
                machines.workers[0].send_signal(signal.SIGKILL)
        assert engine.workers == 1
    assert found == {k: k for k in range(10)}
    begun = [path.name.split("-") for path in place.iterdir()]
    pids = {pid for _, pid in begun}
    assert len(pids) == 2
    assert len(begun) <= 12  # what was lost, once more: a task, and a value not fetched
    until = time.monotonic() + 20
    while all(alive(pid) for pid in pids) and time.monotonic() < until:
        time.sleep(0.05)
    assert sum(alive(pid) for pid in pids) == 1  # the process beside a killed worker goes with it


DECK = """\
[geometry]
shape = "tube"
share = 4
size = "10 mm"

[materials.body]
law = "neo-hooke"
C10 = "0.1 MPa"

[loads]
pressure = "4 kPa"

[solver]
imposed_steps = 30
"""


@pytest.mark.slow
def test_a_sweep_goes_on_when_one_of_two_workers_is_killed(tmp_path: Path) -> None:
    """Finite elements, from the command line: every case is solved, one of them from its checkpoint on."""
    import csv

    deck, out = tmp_path / "tube.toml", tmp_path / "out"
    deck.write_text(DECK, encoding="utf-8")
    words = [sys.executable, "-m", "fem_spa.cli", "sweep", str(deck), "--out", str(out)]
    words += ["--vary", "loads.pressure=2kPa:4kPa:3", "materials.body.C10=0.1MPa,0.12MPa"]
    with started(tmp_path) as machines:
        sweep = subprocess.Popen([*words, "--scheduler", machines.address], stderr=subprocess.PIPE, text=True)
        until = time.monotonic() + 200
        while sum(curve.read_text().count("\n") > 3 for curve in out.glob("cases/*/curve.csv")) < 2:
            assert time.monotonic() < until and sweep.poll() is None
            time.sleep(0.05)
        machines.workers[1].kill()
        _, said = sweep.communicate(timeout=400)
    assert sweep.returncode == 0, said
    with (out / "sweep.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == ["done"] * 6
    assert all(float(row["steps"]) == 30 for row in rows)


def test_no_scheduler_there_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "PATIENCE", 0.5)
    with pytest.raises(InputError, match=r"tcp://127.0.0.1:9 for --scheduler: no Dask scheduler answers"):
        open_engine("tcp://127.0.0.1:9")
    with pytest.raises(InputError, match=r"nowhere.json for --scheduler: there is no such scheduler file"):
        open_engine("nowhere.json")
    with pytest.raises(InputError, match="--workers with --scheduler"):
        open_engine("tcp://127.0.0.1:9", workers=2)
