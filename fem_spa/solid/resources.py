"""How much memory is free, and folders on disk for what does not fit."""

from __future__ import annotations

import ctypes
import math
import os
import platform
import shutil
import sys
import tempfile
import weakref
from pathlib import Path

_PREFIX = "fem-spa-factors-"
_GROUPS = (  # limit, use, and the part of the use that can be given back; of control groups 2 and 1
    ("memory.max", "memory.current", "inactive_file"),
    ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes", "total_inactive_file"),
)


def free_memory(proc: Path = Path("/proc"), groups: Path = Path("/sys/fs/cgroup")) -> float:
    """Bytes that this process may still take without swapping; `inf` where the system does not tell.

    The least of what the machine has and what a control group (container, SLURM job) leaves.
    """
    if sys.platform == "win32":
        return _free_on_windows()
    found = math.inf
    try:
        for line in (proc / "meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                found = 1024.0 * float(line.split()[1])
    except (OSError, ValueError, IndexError):
        pass
    for limit, use, back in _GROUPS:
        try:
            allowed = (groups / limit).read_text(encoding="ascii").strip()
            if allowed == "max":
                continue
            used = float((groups / use).read_text(encoding="ascii"))
            lines = ((groups / use).parent / "memory.stat").read_text(encoding="ascii").splitlines()
            given_back = sum(float(line.split()[1]) for line in lines if line.split()[0] == back)
            found = min(found, max(float(allowed) - used + given_back, 0.0))
        except (OSError, ValueError, IndexError):
            continue
    return found


def _free_on_windows() -> float:
    class Status(ctypes.Structure):
        _fields_ = (
            ("length", ctypes.c_ulong),
            ("load", ctypes.c_ulong),
            *((name, ctypes.c_ulonglong) for name in ("total", "free", "c", "d", "e", "f", "g")),
        )

    status = Status()
    status.length = ctypes.sizeof(Status)
    kernel = getattr(ctypes, "windll").kernel32  # noqa: B009, the name is there on Windows only
    return float(status.free) if kernel.GlobalMemoryStatusEx(ctypes.byref(status)) else math.inf


class Scratch:
    """A folder of its own among the temporary files (TMPDIR), gone when this object or the process is.

    A process that is killed leaves its folder; the next one that makes a folder removes it.
    """

    def __init__(self) -> None:
        place = Path(tempfile.gettempdir())
        _remove_orphans(place)
        self.path = Path(tempfile.mkdtemp(prefix=f"{_prefix()}{os.getpid()}-", dir=place))
        self._end = weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)

    def remove(self) -> None:
        """Now; nothing happens the second time."""
        self._end()


def free_disk() -> float:
    """Bytes free where `Scratch` makes its folders."""
    return float(shutil.disk_usage(tempfile.gettempdir()).free)


def _prefix() -> str:
    """With the machine's name: a process number says nothing where several machines share a disk."""
    return f"{_PREFIX}{platform.node()}-"


def _remove_orphans(place: Path) -> None:
    if sys.platform == "win32":  # signal 0 ends a process there
        return
    for folder in place.iterdir():
        if not folder.name.startswith(_prefix()):
            continue
        owner = folder.name.removeprefix(_prefix()).partition("-")[0]
        try:
            os.kill(int(owner), 0)
        except ProcessLookupError:
            shutil.rmtree(folder, ignore_errors=True)
        except (OSError, ValueError, OverflowError):  # another user's, or not ours at all
            continue
