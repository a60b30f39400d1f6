"""A worker process as an object: call a function in it, interrupt it, end it."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

from fem_spa.engine.cores import environment
from fem_spa.engine.interface import WorkerLost
from fem_spa.engine.worker import read, write

GRACE = 20.0
"""s that an interrupted function has for putting its results in order."""


class Died(RuntimeError):
    """The process ended before it answered; the text says how."""


class Interrupted(RuntimeError):
    """The function was interrupted."""


class Host:
    """A process in which one function runs at a time.

    Its input is held open by this process alone, so that it ends when this process does, however that
    ends. It has a session of its own: Ctrl-C reaches it through `interrupt` only, and once.

    Parameters
    ----------
    threads : of the linear solver and of compiled loops in it
    """

    def __init__(self, threads: int) -> None:
        path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "fem_spa.engine.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            env={**environment(threads), "PYTHONPATH": path},
            start_new_session=True,
        )
        assert self._process.stdin is not None and self._process.stdout is not None
        self._to, self._from = self._process.stdin, self._process.stdout
        self.busy = False

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether the process is there."""
        return self._process.poll() is None

    def call(self, function: Callable[[Any], Any], task: Any) -> Any:
        """The function's value; what it raises is raised here.

        Raises
        ------
        Died, Interrupted
        """
        message = pickle.dumps((function, task))
        self.busy = True
        try:
            try:
                write(self._to.fileno(), message)
                answer = read(self._from.fileno())
            except (OSError, ValueError):  # ValueError: closed by another thread
                answer = None
            if answer is None:
                raise Died(self._how())
        finally:
            self.busy = False
        kind, value = pickle.loads(answer)
        if kind == "error":
            raise value
        if kind == "interrupted":
            raise Interrupted
        return value

    def _how(self) -> str:
        """How the process ended."""
        try:
            status = self._process.wait(GRACE)
        except subprocess.TimeoutExpired:
            self.kill()
            return "it closed its output"
        if status >= 0:
            return f"it ended with status {status}"
        try:
            name = signal.Signals(-status).name
        except ValueError:
            name = f"signal {-status}"
        memory = ", as the system does where memory runs out" if name == "SIGKILL" else ""
        return f"it was ended by {name}{memory}"

    def interrupt(self) -> None:
        """KeyboardInterrupt inside the function, where the system can do that; else the end."""
        if self.alive:
            self._process.terminate()

    def close(self) -> None:
        """The end of an idle process: its input ends."""
        self._to.close()

    def kill(self) -> None:
        """The end, now."""
        self._process.kill()

    def gone(self, until: float) -> bool:
        """Wait until `time.monotonic()` is `until`, or the process has ended; whether it has."""
        try:
            self._process.wait(max(0.0, until - time.monotonic()))
        except subprocess.TimeoutExpired:
            return False
        return True


def call_twice(
    host: Callable[[], Host],
    function: Callable[[Any], Any],
    task: Any,
    stopped: Callable[[], bool] = lambda: False,
) -> Any:
    """`Host.call`, once more in a new process where the first one dies.

    Parameters
    ----------
    host : gives a living one
    stopped : whether a death was wanted

    Raises
    ------
    WorkerLost
        Both processes died.
    """
    how: list[str] = []
    while len(how) < 2:
        try:
            return host().call(function, task)
        except Died as death:
            if stopped():
                raise Interrupted from None
            how.append(str(death))
    first, second = how
    both = first if first == second else f"{first}; then {second}"
    raise WorkerLost(f"the process that worked on it died twice: {both}")
