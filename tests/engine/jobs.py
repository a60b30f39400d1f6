"""What the tests of the engine let workers do. Imported by name, as a worker does."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path


def square(x: float) -> float:
    return x * x


def refuse_odd(x: int) -> int:
    if x % 2:
        raise ValueError(f"{x} is odd")
    return x


def process(_: object) -> int:
    return os.getpid()


def threads(_: object) -> str:
    return os.environ["OMP_NUM_THREADS"] + os.environ["MKL_NUM_THREADS"]


def talk(x: int) -> int:
    """Prints on the descriptor that answers go through elsewhere."""
    os.write(1, b"noise")
    print("more noise")
    return x


def die_once(place: str) -> int:
    """The first process that gets here kills itself; how often it was tried."""
    tries = Path(place)
    count = len(tries.read_text()) + 1 if tries.exists() else 1
    tries.write_text("x" * count)
    if count == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return count


def die(_: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def die_at_three(x: int) -> int:
    if x == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return x


def wait(place: str) -> None:
    """Tells that it has begun, waits, and when it is interrupted puts its results in order."""
    begun = Path(place)
    begun.write_text(str(os.getpid()))
    try:
        time.sleep(60)
    except KeyboardInterrupt:
        begun.with_suffix(".kept").write_text("kept")
        raise


def slowly(task: tuple[str, int]) -> tuple[int, int]:
    """Says which process is at it, takes a moment; process and number."""
    place, number = task
    Path(place, f"{number}-{os.getpid()}").touch()
    time.sleep(0.4)
    return os.getpid(), number
