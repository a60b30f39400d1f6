"""Data of known parameters: records and curves written as files, for models and for a small FE body."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fem_spa.reduced.viscoelastic import KelvinVoigt, kelvin_voigt


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str, str], Path]:
    def to(name: str, text: str) -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return to


@pytest.fixture
def creeping() -> KelvinVoigt:
    """A bellow with two elements, 10 s and 0.3 s."""
    return kelvin_voigt([80e6, 12e6], [80e7, 12e6 * 0.3])
