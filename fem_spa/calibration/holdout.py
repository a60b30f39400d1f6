"""Which data are held out: never used to fit, and the error on them is the calibration's error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fem_spa.calibration.observation import Run

EVERY = 3
"""Of a single curve, every third inner row is held out; of a single record, its last third."""


def split(runs: Sequence[Run], held: Sequence[Run] = (), seed: int = 0) -> tuple[list[Run], list[Run]]:
    """Training and held-out runs.

    Parameters
    ----------
    runs : to be split, unless `held` are given
    held : held-out runs that the caller names
    seed : chooses among several records

    Returns
    -------
    Several runs: max(1, round(n/3)) are held out, among them the one that goes furthest beyond the others in
    pressure. A single static curve: every third row but its ends, pressures that are not used in the fit. A
    single record: its last third.
    """
    if held:
        return list(runs), list(held)
    if len(runs) == 1:
        return _within(runs[0])
    count = max(1, round(len(runs) / 3))
    reach = [float(np.abs(run.drive.pressure[run.use]).max(initial=0.0)) for run in runs]
    order = list(np.argsort(-np.array(reach), kind="stable"))
    chosen = [int(order[0])]
    rest = [i for i in range(len(runs)) if i not in chosen]
    rng = np.random.default_rng(seed)
    chosen += [int(i) for i in rng.permutation(rest)[: count - 1]]
    train = [run for i, run in enumerate(runs) if i not in chosen]
    return train, [run for i, run in enumerate(runs) if i in chosen]


def _within(run: Run) -> tuple[list[Run], list[Run]]:
    n = len(run.use)
    row = np.arange(n)
    if run.static:
        held = (row % EVERY == EVERY - 1) & (row < n - 1)
        if not held.any():
            held[n // 2] = True
    else:
        held = row >= n - n // 3
    return [run.only(~held)], [run.only(held)]
