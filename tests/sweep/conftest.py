"""A deck that is solved fast, and workers that find `stand_ins` by its name."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

DECK = """\
[geometry]
shape = "tube"
share = 4
size = "10 mm"
end_wall = "3 mm"

[materials.body]
law = "neo-hooke"
C10 = "0.1 MPa"

[loads]
pressure = "4 kPa"
contact = false

[solver]
imposed_steps = 1
"""


@pytest.fixture
def deck(tmp_path: Path) -> Path:
    path = tmp_path / "tube.toml"
    path.write_text(DECK, encoding="utf-8")
    return path
