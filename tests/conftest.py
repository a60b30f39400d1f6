"""What several rooms need."""

from __future__ import annotations

import errno
import importlib
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

BENCHMARKS = str(Path(__file__).resolve().parents[1] / "benchmarks")


@pytest.fixture(scope="session")
def verification():
    """benchmarks/verification: structured meshes, loads that no deck has, closed forms."""
    if BENCHMARKS not in sys.path:
        sys.path.append(BENCHMARKS)
    return importlib.import_module("verification")


@pytest.fixture
def full_disk() -> Callable[[pytest.MonkeyPatch, int], None]:
    """Function that fills the disk: no file can be begun after the first `room`."""
    from fem_spa.output import files

    def fill(patch: pytest.MonkeyPatch, room: int) -> None:
        made, left = files.tempfile.mkstemp, [room]

        def mkstemp(*words: Any, **more: Any) -> Any:
            left[0] -= 1
            if left[0] < 0:
                raise OSError(errno.ENOSPC, "No space left on device")
            return made(*words, **more)

        patch.setattr(files.tempfile, "mkstemp", mkstemp)

    return fill


@pytest.fixture(scope="session", autouse=True)
def ctrl_c_is_heard() -> Iterator[None]:
    """A shell that starts tests in the background has Ctrl-C ignored, and so would the program, rightly."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
