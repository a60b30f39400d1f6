"""The study of two cards for one rubber, on two chambers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fem_spa.cli import main
from studies import dragon_skin_30


def test_the_fitted_card_bends_further(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """At low pressure the angles are about as the shear moduli, 220 to 184 kPa; then the gap grows."""
    whole = dragon_skin_30.run_deck

    def small(deck: Any, out: Path, changes: list[str]) -> Any:
        return whole(deck, out, [*changes, "geometry.slow_chambers=2"])

    monkeypatch.setattr(dragon_skin_30, "run_deck", small)
    monkeypatch.setattr(dragon_skin_30, "PRESSURE", "20 kPa")
    monkeypatch.setattr(dragon_skin_30, "POINTS", 4)
    assert main(["study", "dragon_skin_30", "--out", str(tmp_path / "o")]) == 0
    said = capsys.readouterr().out
    assert "220 kPa (paper), 184 kPa (fitted)" in said
    table = np.loadtxt(tmp_path / "o" / "curve.csv", delimiter=",", skiprows=1)
    assert table[1:, 0] == pytest.approx([5, 10, 15, 20])
    ratio = table[1:, 2] / table[1:, 1]
    assert ratio[0] == pytest.approx(220 / 184, rel=0.05)
    assert all(np.diff(ratio) > 0)
    assert sorted(p.name for p in (tmp_path / "o").iterdir()) == ["curve.csv", "curve.png", "fitted", "paper"]
