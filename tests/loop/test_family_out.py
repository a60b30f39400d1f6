"""An effect whose family is taken out of the library: no twin of another family is named instead."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from loop_bench import creeping, rich, soften, write_case

from fem_spa.loop.effects.registry import EFFECTS


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "family", "fits", "slot"),
    [
        (creeping, "viscoelastic", "time that has passed", "state"),
        (partial(soften, size=0.26), "history", "cycle or the time", "stiffness"),
    ],
    ids=["creep", "softening"],
)
def test_without_its_family_an_effect_is_unexplained(
    tmp_path: Path,
    diagnosed: Any,
    monkeypatch: pytest.MonkeyPatch,
    body: Callable[[list[np.ndarray]], list[np.ndarray]],
    family: str,
    fits: str,
    slot: str,
) -> None:
    model, files = write_case(tmp_path / "case", body, shares=rich())
    kept = {name: effect for name, effect in EFFECTS.items() if effect.family != family}
    assert len(kept) < len(EFFECTS)
    with monkeypatch.context() as patch:
        patch.setattr("fem_spa.loop.diagnose.EFFECTS", kept)
        report = diagnosed(model, files, tmp_path / "out")
    assert report["verdict"] == "unexplained" and not report["effects"]
    assert report["error"]["heldout"]["after"] == report["error"]["heldout"]["before"]
    assert fits in report["signature"] and report["localisation"][0]["slot"] == slot
    assert report["localisation"][0]["knob"] in report["signature"]
    # with the family in, it is one of it that is named: there was something to be found
    whole = diagnosed(model, files, tmp_path / "whole")
    assert EFFECTS[whole["effects"][0]["name"]].family == family
