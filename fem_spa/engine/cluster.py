"""Workers of a Dask scheduler, on this machine or on a cluster.

A task does not run in a Dask worker's thread (gmsh and the solver want a process's main thread, and can be
neither interrupted nor survived elsewhere) but in a process beside it, started once a thread: `host.Host`. A
Dask worker that dies takes that process with it, and the scheduler gives its task to another. So may a task
that had ended, if its value was not fetched yet: functions whose results are files see that they are there.
"""

from __future__ import annotations

import asyncio
import os
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from fem_spa import __version__
from fem_spa.engine.cores import share
from fem_spa.engine.host import GRACE, Host, Interrupted, call_twice
from fem_spa.engine.interface import Ended, EngineGone, WorkerLost
from fem_spa.errors import InputError

PATIENCE = 20.0
"""s within which a scheduler must answer."""

_THREAD = threading.local()  # this Dask worker's process beside each of its threads
_BUSY: dict[str, set[Host]] = {}
_STOPPED: set[str] = set()


class Cluster:
    """An engine on Dask's workers: see `interface.Engine`.

    Each Dask worker runs as many tasks at a time as it has threads; the cores that it may use are divided
    among them, and what its OMP_NUM_THREADS says is never exceeded (a nanny sets it to 1).

    Parameters
    ----------
    address : "tcp://HOST:8786", or the path of a scheduler file (.json) that Dask has written
    """

    def __init__(self, address: str) -> None:
        try:
            from distributed import Client
        except ImportError:
            raise InputError(
                'given --scheduler: Dask is not installed; pip install "fem-spa[cluster]", or leave it out '
                "to use this machine's cores"
            ) from None
        self._address = address
        where: dict[str, Any] = {"address": address}
        if address.endswith(".json"):
            if not Path(address).is_file():
                raise InputError(f"given {address} for --scheduler: there is no such scheduler file")
            where = {"scheduler_file": address}
        try:
            self._client = Client(**where, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            why = " ".join(str(error).split())[:120] or type(error).__name__
            raise InputError(
                f"given {address} for --scheduler: no Dask scheduler answers there ({why}); give what "
                "'dask scheduler' prints, such as tcp://10.0.0.5:8786"
            ) from None
        self._token = uuid.uuid4().hex
        self._futures: set[Any] = set()

    @property
    def workers(self) -> int:
        """Tasks at a time, now; workers may come and go."""
        return max(1, sum(self._client.ncores().values()))

    @property
    def words(self) -> str:
        """For a report."""
        count = len(self._client.ncores())
        workers = "no worker yet" if not count else f"{count} worker{'' if count == 1 else 's'}"
        return f"the Dask scheduler {self._address} with {workers}"

    def refuse_blind(self, folder: Path) -> None:
        """See `interface.Engine.refuse_blind`."""
        marker = folder / f".seen.{self._token}"
        marker.touch()
        try:
            found = self._client.run(_sees, str(marker))
        finally:
            marker.unlink(missing_ok=True)
        for worker, (seen, version) in found.items():
            if version != __version__:
                raise InputError(
                    f"the Dask worker {worker} has fem_spa {version}, this machine {__version__}; install one"
                )
            if not seen:
                raise InputError(
                    f"the Dask worker {worker} does not see {folder}: results are files; give --out a folder "
                    "that all workers share"
                )

    def run(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[Ended]:
        """See `interface.Engine.run`."""
        from distributed import as_completed

        name = f"fem-spa-{self._token}-{uuid.uuid4().hex}"
        keys = {f"{name}-{number}": number for number in range(len(tasks))}
        self._futures = {
            self._client.submit(_on_worker, self._token, function, tasks[number], key=key, pure=False)
            for key, number in keys.items()
        }
        for future in as_completed(set(self._futures), loop=self._client.loop):
            ended = _ended(future, keys[future.key], self._address)
            self._futures.discard(future)
            future.release()  # or its value would be calculated again, should its worker die
            yield ended

    def close(self) -> None:
        """See `interface.Engine.close`."""
        try:
            running = [future for future in self._futures if not future.done()]
            if running:
                self._client.cancel(running)
                self._client.run(_stop, self._token)
        except (OSError, RuntimeError, TimeoutError):
            pass  # the scheduler is gone, and its workers end by themselves
        finally:
            self._client.close(timeout=PATIENCE)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _ended(future: Any, number: int, address: str) -> Ended:
    from distributed.scheduler import KilledWorker

    if future.status in ("cancelled", "lost"):
        raise EngineGone(f"the connection to the Dask scheduler {address} is lost")
    if future.status == "finished":
        return Ended(number, future.result())
    error = future.exception()
    if isinstance(error, KilledWorker):
        words = "the Dask workers that worked on it died, one after the other"
        return Ended(number, error=WorkerLost(words))
    return Ended(number, error=error if isinstance(error, Exception) else RuntimeError(repr(error)))


def _sees(marker: str) -> tuple[bool, str]:
    """On a worker: whether it sees a file, and its fem_spa."""
    return os.path.exists(marker), __version__


def _on_worker(token: str, function: Callable[[Any], Any], task: Any) -> Any:
    """On a worker: the task, in the process beside this thread."""
    used: list[Host] = []

    def host() -> Host:
        if token in _STOPPED:
            raise Interrupted
        found = getattr(_THREAD, "host", None)
        if found is None or not found.alive:
            from distributed import get_worker

            found = _THREAD.host = Host(share(get_worker().state.nthreads))
        used.append(found)
        _BUSY.setdefault(token, set()).add(found)
        return found

    try:
        return call_twice(host, function, task, lambda: token in _STOPPED)
    finally:
        for each in used:
            _BUSY[token].discard(each)


async def _stop(token: str) -> None:
    """On a worker: interrupt the tasks of a run; after a while end their processes."""
    _STOPPED.add(token)
    for host in list(_BUSY.get(token, ())):
        host.interrupt()
    until = time.monotonic() + GRACE
    while _BUSY.get(token) and time.monotonic() < until:
        await asyncio.sleep(0.05)
    for host in list(_BUSY.get(token, ())):
        host.kill()
