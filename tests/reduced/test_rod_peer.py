"""The rod's time loop against PyElastica, on the same discretization."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from fem_spa.reduced.rod import GRID, arm
from fem_spa.reduced.rod_protocols import PROTOCOLS
from fem_spa.reduced.valve import valve_pressure

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.slow
def test_tip_of_babbling_is_pyelasticas(monkeypatch: pytest.MonkeyPatch) -> None:
    """10 s at 20 Hz, with the valve: 1 % of the motion is asked, 0.1 % held; a wrong factor is far off."""
    if importlib.util.find_spec("elastica") is None:
        pytest.skip('PyElastica is not installed: pip install "fem-spa[benchmarks]"')
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    from rod_peer import peer_tip

    model = arm()
    drive = next(p for p in PROTOCOLS if p.name == "Babbling 20 Hz").drive(10.0)
    grid = np.arange(9990) * GRID
    strain = model.strains(valve_pressure(drive.time, drive.pressure, model.supply(), at=grid))
    theirs, _ = peer_tip(model, strain, GRID, 2e-4)
    sys.modules.pop("rod_peer")
    ours = model.march(strain, GRID, 0.0, 0.0)
    span = np.ptp(theirs, axis=0).max()
    assert span > 0.01
    assert np.linalg.norm(ours - theirs, axis=1).max() < 1e-3 * span
