"""The process behind `host.Host`: takes a function and a task from its input, gives back what came of it.

    python -m fem_spa.engine.worker

When its input ends, the process that started it is gone: it ends at once, whatever it is doing, so that no
worker outlives a run. SIGTERM is a polite end of the task: KeyboardInterrupt inside the function.
"""

from __future__ import annotations

import os
import pickle
import signal
import struct
import threading
from queue import SimpleQueue
from typing import Any

HEAD = struct.Struct(">Q")
"""Length of the message that follows."""


def read(source: int) -> bytes | None:
    """One message from a file descriptor; None where it has ended."""
    head = _read(source, HEAD.size)
    return None if head is None else _read(source, HEAD.unpack(head)[0])


def write(target: int, message: bytes) -> None:
    """One message to a file descriptor."""
    rest = memoryview(HEAD.pack(len(message)) + message)
    while rest:
        rest = rest[os.write(target, rest) :]


def _read(source: int, size: int) -> bytes | None:
    parts = []
    while size:
        part = os.read(source, min(size, 1 << 20))
        if not part:
            return None
        parts.append(part)
        size -= len(part)
    return b"".join(parts)


def main() -> None:
    """Work until the input ends."""
    source, target = os.dup(0), os.dup(1)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)  # what functions print is not an answer
    waiting: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(source, waiting), daemon=True).start()
    while True:
        try:
            message = waiting.get()
            signal.signal(signal.SIGTERM, _interrupt)  # anew for each: gmsh takes the system's own handler
            answer = _answer(message)
        except KeyboardInterrupt:  # between two tasks, or before the function had begun
            answer = pickle.dumps(("interrupted", None))
        write(target, answer)


def _receive(source: int, waiting: SimpleQueue[bytes]) -> None:
    while True:
        message = read(source)
        if message is None:
            os._exit(0)
        waiting.put(message)


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _answer(message: bytes) -> bytes:
    """What the function returned or raised, pickled."""
    try:
        function, task = pickle.loads(message)
        value = function(task)
        return pickle.dumps(("value", value))
    except KeyboardInterrupt:
        return pickle.dumps(("interrupted", None))
    except BaseException as error:  # SystemExit too: the worker has more tasks to come
        return _error(error)


def _error(error: BaseException) -> bytes:
    """An exception that the other side can read; one that cannot travel becomes a RuntimeError."""
    try:
        message = pickle.dumps(("error", error))
        found: Any = pickle.loads(message)[1]
        if isinstance(error, Exception) and str(found) == str(error):
            return message
    except Exception:  # whatever its class makes of being copied
        pass
    return pickle.dumps(("error", RuntimeError(f"{type(error).__name__}: {error}")))


if __name__ == "__main__":
    main()
