"""Stand-ins for the finite-element run of a case: they leave a folder as `solve` does, in no time."""

from __future__ import annotations

import json
import os
import signal
from typing import Any

from fem_spa.sweep.case import Line, Task, read_line


def quick(task: Task) -> Line | None:
    """angle = pressure / C10, in a folder like that of a run; tells in `tried` that it was called."""
    C10 = task.deck.materials["body"].parameters["C10"]
    number = float(C10.split()[0])
    pressure = task.deck.loads.pressure[""].si / 1e3
    task.folder.mkdir(parents=True, exist_ok=True)
    with (task.folder / "tried").open("a") as file:
        file.write("x")
    leave(task, "done", [(0.0, 0.0), (pressure, pressure / number)])
    return read_line(task.folder)


def leave(task: Task, status: str, rows: list[tuple[float, float]], message: str = "") -> None:
    text = "step,pressure [kPa],angle [deg]\n"
    text += "".join(f"{k},{p!r},{a!r}\n" for k, (p, a) in enumerate(rows))
    (task.folder / "curve.csv").write_text(text)
    record: dict[str, Any] = {"status": status, "message": message, "dofs": 10, "elements": 2}
    record |= {"newton_iterations": 5, "seconds": {"total": 1.5}, "peak_rss_mb": 100.0}
    record["first touch [kPa]"] = None
    (task.folder / "result.json").write_text(json.dumps(record))


def troubled(task: Task) -> Line | None:
    """Pressures of 1 to 5 kPa: well, limit, a fault, death, refused."""
    from fem_spa.errors import InputError

    pressure = round(task.deck.loads.pressure[""].si / 1e3)
    line = quick(task)
    if pressure == 2:
        leave(task, "limit", [(0.0, 0.0), (1.0, 9.0)], "the volume grows without bound")
        return read_line(task.folder)
    if pressure == 3:
        (task.folder / "result.json").unlink()
        raise ZeroDivisionError("by\nzero")
    if pressure == 4:
        (task.folder / "result.json").unlink()
        os.kill(os.getpid(), signal.SIGKILL)
    if pressure == 5:
        (task.folder / "result.json").unlink()
        raise InputError("the mesh has no tip")
    return line


def dies_once(task: Task) -> Line | None:
    """Every case kills its first process."""
    tries = task.folder.with_suffix(".tries")
    tries.parent.mkdir(parents=True, exist_ok=True)
    if not tries.exists():
        tries.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return quick(task)


def interrupts_its_sweep(task: Task) -> Line | None:
    """The second case sends the sweep what Ctrl-C sends, and waits to be ended."""
    import time

    if round(task.deck.loads.pressure[""].si / 1e3) != 2:
        return quick(task)
    try:
        os.kill(os.getppid(), signal.SIGINT)
        time.sleep(30)
    except KeyboardInterrupt:
        task.folder.mkdir(parents=True, exist_ok=True)
        leave(task, "interrupted", [(0.0, 0.0)], "interrupted by the user")
        raise
    return None
