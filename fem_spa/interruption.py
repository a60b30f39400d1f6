"""Ctrl-C and a polite end from outside, heeded where nothing is half done."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator, Mapping
from typing import Any

from fem_spa.solid.observe import Silent


class Interruption(Silent):
    """Ctrl-C and a polite end from outside: a run ends after its current iteration, all else at once.

    As a context manager it listens to SIGINT and SIGTERM, from after meshing on: gmsh takes the system's own
    handlers of both. A second signal does not wait for the iteration. A signal that the caller's shell
    ignores stays ignored; outside the main thread nothing is set.
    """

    def __init__(self) -> None:
        self._waits = self._asked = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Interruption:
        if threading.current_thread() is threading.main_thread():
            for name in ("SIGINT", "SIGTERM"):
                number = getattr(signal, name, None)
                if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
                    self._before[number] = signal.signal(number, self._hear)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            if handler is not None:
                signal.signal(number, handler)

    @contextlib.contextmanager
    def after_an_iteration(self) -> Iterator[None]:
        """Inside, the first signal is heeded after the current iteration."""
        self._waits = True
        try:
            yield
        finally:
            self._waits = False

    def iteration(self, step: int, pressure: Mapping[str, float], iteration: int, error: float) -> None:
        """Between two iterations nothing is half done."""
        if self._asked:
            raise KeyboardInterrupt

    def _hear(self, *_: object) -> None:
        if not self._waits or self._asked:
            raise KeyboardInterrupt
        self._asked = True
