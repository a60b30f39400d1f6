"""What an engine is, and the choice between the two that there are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self


class WorkerLost(RuntimeError):
    """The process that worked on a task died, and so did the one that tried it again; the text says how."""


class EngineGone(RuntimeError):
    """Nothing can be run any more: the connection to the scheduler is lost."""


@dataclass(frozen=True)
class Ended:
    """One task that came to its end.

    Attributes
    ----------
    number : its place in the tasks that were given
    value : what the function returned
    error : what it raised instead, or a `WorkerLost`
    """

    number: int
    value: Any = None
    error: Exception | None = None


class Engine(Protocol):
    """Runs a function over tasks, several at a time, each in a process where nothing else is going on.

    Function and tasks are pickled: the function is one that a module holds, the tasks are plain data. A
    process that dies takes nothing with it: its task is tried once more, then it is a `WorkerLost`.

    Attributes
    ----------
    workers : tasks at a time
    words : what it is, for a report
    """

    @property
    def workers(self) -> int: ...

    @property
    def words(self) -> str: ...

    def run(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[Ended]:
        """Every task as it ends, in no order. One call at a time.

        Raises
        ------
        EngineGone
            The scheduler cannot be reached any more.
        """
        ...

    def refuse_blind(self, folder: Path) -> None:
        """Refuse workers that do not see a folder of this machine, or have another fem_spa.

        Raises
        ------
        InputError
        """
        ...

    def close(self) -> None:
        """End it. What still runs is interrupted (KeyboardInterrupt inside the function) and given
        `host.GRACE` seconds to put its results in order; then no process of the engine is left."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


def open_engine(scheduler: str | None = None, workers: int | None = None, most: int | None = None) -> Engine:
    """The engine that is asked for.

    Parameters
    ----------
    scheduler : address of a Dask scheduler; None: processes on this machine
    workers : of this machine's processes; default one a core
    most : tasks there will be at most; more processes are not started

    Raises
    ------
    InputError
        The scheduler is not there, Dask is not installed, or a number of workers that cannot be.
    """
    from fem_spa.errors import InputError

    if scheduler is not None:
        if workers is not None:
            raise InputError(
                "given --workers with --scheduler: the scheduler knows its workers; leave --workers out"
            )
        from fem_spa.engine.cluster import Cluster

        return Cluster(scheduler)
    from fem_spa.engine.pool import Pool

    return Pool(workers, most)
