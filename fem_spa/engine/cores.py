"""Cores, divided among processes."""

from __future__ import annotations

import os

MOST_WORKERS = 256
THREAD_VARIABLES = (
    *("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"),
    *("NUMBA_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"),
)
"""What linear solvers and compiled loops read when they start."""


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def share(workers: int) -> int:
    """Threads of each of `workers` processes: the cores divided, not more than OMP_NUM_THREADS says."""
    threads = max(1, cores() // max(1, workers))
    given = os.environ.get("OMP_NUM_THREADS", "")
    return min(threads, int(given)) if given.isdigit() and int(given) > 0 else threads


def environment(threads: int) -> dict[str, str]:
    """This process's environment, for a process with so many threads."""
    return {**os.environ, **dict.fromkeys(THREAD_VARIABLES, str(threads))}
