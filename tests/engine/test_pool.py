"""The process pool: every task once, deaths survived, ends politely, leaves nothing behind."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import jobs
import pytest

from fem_spa.engine import WorkerLost, cores, open_engine
from fem_spa.engine.cores import share
from fem_spa.engine.pool import Pool
from fem_spa.errors import InputError


def gone(pid: int, seconds: float = 20.0) -> bool:
    """Whether a process ends within a time (a zombie that nobody has waited for counts as ended)."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            return True
        if state == "Z":
            return True
        time.sleep(0.05)
    return False


def test_every_task_ends_once_with_its_own_value() -> None:
    with Pool(2) as pool:
        ended = list(pool.run(jobs.square, [0.5 * k for k in range(12)]))
        again = list(pool.run(math.sqrt, [4.0]))
    assert sorted((e.number, e.value) for e in ended) == [(k, 0.25 * k * k) for k in range(12)]
    assert again[0].value == 2.0


def test_an_exception_is_the_tasks_own() -> None:
    with Pool(1) as pool:
        ended = {e.number: e for e in pool.run(jobs.refuse_odd, [0, 1, 2])}
    assert ended[0].value == 0 and ended[2].value == 2
    assert isinstance(ended[1].error, ValueError) and str(ended[1].error) == "1 is odd"


def test_what_a_function_prints_does_not_spoil_its_answer(capfd: pytest.CaptureFixture[str]) -> None:
    with Pool(1) as pool:
        assert [e.value for e in pool.run(jobs.talk, [7, 8])] == [7, 8]
    assert "noise" not in capfd.readouterr().out


def test_processes_stay_from_one_run_to_the_next() -> None:
    with Pool(1) as pool:
        first, second = (next(iter(pool.run(jobs.process, [None]))).value for _ in range(2))
    assert first == second != os.getpid()


def test_a_death_is_tried_once_more_in_a_new_process(tmp_path: Path) -> None:
    with Pool(1) as pool:
        assert [e.value for e in pool.run(jobs.die_once, [str(tmp_path / "tries")])] == [2]


def test_a_task_that_kills_twice_is_told_and_the_others_go_on() -> None:
    with Pool(2) as pool:
        ended = {e.number: e for e in pool.run(jobs.die_at_three, range(6))}
    assert [ended[k].value for k in (0, 1, 2, 4, 5)] == [0, 1, 2, 4, 5]
    assert isinstance(ended[3].error, WorkerLost)
    assert "died twice" in str(ended[3].error) and "SIGKILL" in str(ended[3].error)


def test_closing_interrupts_what_runs_and_waits_for_it(tmp_path: Path) -> None:
    place = tmp_path / "job"
    with Pool(1) as pool:
        running = pool.run(jobs.wait, [str(place), str(tmp_path / "never")])
        threading.Thread(target=lambda: next(running, None), daemon=True).start()
        until = time.monotonic() + 30
        while not (place.exists() and place.read_text()) and time.monotonic() < until:
            time.sleep(0.02)
        pid = pool.pids[0]
    assert place.with_suffix(".kept").read_text() == "kept"
    assert not (tmp_path / "never").exists()
    assert gone(pid)


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="reads /proc")
def test_no_worker_outlives_a_parent_that_is_killed(tmp_path: Path) -> None:
    program = f"""
        import sys
        sys.path.insert(0, {str(Path(jobs.__file__).parent)!r})
        import jobs
        from fem_spa.engine.pool import Pool
        list(Pool(2).run(jobs.wait, [{str(tmp_path / "a")!r}, {str(tmp_path / "b")!r}]))
    """
    parent = subprocess.Popen([sys.executable, "-c", textwrap.dedent(program)])
    until = time.monotonic() + 60
    begun = [tmp_path / "a", tmp_path / "b"]
    while not all(p.exists() and p.read_text() for p in begun) and time.monotonic() < until:
        time.sleep(0.05)
    parent.kill()
    parent.wait()
    assert all(gone(int(p.read_text())) for p in begun)


def test_threads_are_divided_among_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.setattr(cores, "cores", lambda: 8)
    assert [share(n) for n in (1, 2, 3, 8, 20)] == [8, 4, 2, 1, 1]
    with Pool(2) as pool:
        assert {e.value for e in pool.run(jobs.threads, [0, 1])} == {"44"}
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    assert [share(n) for n in (1, 2, 8)] == [3, 3, 1]


def test_no_more_processes_than_tasks() -> None:
    assert Pool(5, most=3).workers == 3


@pytest.mark.parametrize("workers", [0, -1, 257])
def test_a_number_of_workers_that_cannot_be_is_refused(workers: int) -> None:
    with pytest.raises(InputError, match="--workers: 1 to 256"):
        open_engine(workers=workers)
