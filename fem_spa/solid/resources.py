"""How much memory is free."""

from __future__ import annotations

import ctypes
import math
import sys
from pathlib import Path

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
