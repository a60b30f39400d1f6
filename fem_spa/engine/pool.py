"""Processes on this machine, one task at a time in each."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from queue import SimpleQueue
from types import TracebackType
from typing import Any, Self

from fem_spa.engine.cores import MOST_WORKERS, cores, share
from fem_spa.engine.host import GRACE, Host, Interrupted, call_twice
from fem_spa.engine.interface import Ended
from fem_spa.errors import InputError


class Pool:
    """An engine on this machine: see `interface.Engine`.

    The processes stay from one `run` to the next, so that each loads and compiles once. The cores are divided
    among them: two processes on eight cores solve with four threads each.

    Parameters
    ----------
    workers : processes; default one a core
    most : tasks there will be at most
    """

    def __init__(self, workers: int | None = None, most: int | None = None) -> None:
        if workers is not None and not 1 <= workers <= MOST_WORKERS:
            raise InputError(
                f"given {workers} for --workers: 1 to {MOST_WORKERS} is allowed; this machine has {cores()} "
                "cores"
            )
        self._workers = max(1, min(workers or cores(), most or MOST_WORKERS, MOST_WORKERS))
        self.threads = share(self._workers)
        self._hosts: dict[int, Host] = {}
        self._drivers: list[threading.Thread] = []
        self._stopping = False
        self._guard = threading.Lock()

    @property
    def workers(self) -> int:
        """Tasks at a time."""
        return self._workers

    @property
    def words(self) -> str:
        """For a report."""
        processes = "1 process" if self._workers == 1 else f"{self._workers} processes"
        threads = "1 thread" if self.threads == 1 else f"{self.threads} threads"
        each = " each" if self._workers > 1 else ""
        return f"{processes} on this machine with {threads}{each}"

    @property
    def pids(self) -> list[int]:
        """Numbers of the living processes."""
        return [host.pid for host in self._hosts.values() if host.alive]

    def run(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[Ended]:
        """See `interface.Engine.run`."""
        ended: SimpleQueue[Ended] = SimpleQueue()
        left = iter(range(len(tasks)))
        guard = threading.Lock()

        def drive(place: int) -> None:
            while not self._stopping:
                with guard:
                    number = next(left, None)
                if number is None:
                    return
                ended.put(self._one(place, function, number, tasks[number]))

        self._drivers = [
            threading.Thread(target=drive, args=(place,), daemon=True)
            for place in range(min(self._workers, len(tasks)))
        ]
        for driver in self._drivers:
            driver.start()
        for _ in tasks:
            yield ended.get()

    def _one(self, place: int, function: Callable[[Any], Any], number: int, task: Any) -> Ended:
        try:
            value = call_twice(lambda: self._host(place), function, task, lambda: self._stopping)
            return Ended(number, value)
        except Exception as error:
            return Ended(number, error=error)

    def _host(self, place: int) -> Host:
        """The living process of a place."""
        with self._guard:
            if self._stopping:
                raise Interrupted
            host = self._hosts.get(place)
            if host is None or not host.alive:
                host = self._hosts[place] = Host(self.threads)
            return host

    def refuse_blind(self, folder: Path) -> None:
        """See `interface.Engine.refuse_blind`: processes of this machine see what it sees."""

    def close(self) -> None:
        """See `interface.Engine.close`; a second Ctrl-C meanwhile ends what runs at once."""
        with self._guard:
            self._stopping = True
            hosts = list(self._hosts.values())
        try:
            for host in hosts:
                if host.busy:
                    host.interrupt()
            until = time.monotonic() + GRACE
            for driver in self._drivers:
                while driver.is_alive() and time.monotonic() < until:
                    driver.join(0.1)  # in short pieces, so that Ctrl-C is heard
            for host in hosts:
                if not host.busy:
                    host.close()
        finally:
            for host in hosts:
                if host.busy or not host.gone(time.monotonic() + 1.0):
                    host.kill()
            for host in hosts:
                host.gone(time.monotonic() + GRACE)
            self._hosts = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
