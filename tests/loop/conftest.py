"""Diagnoses that several tests look at, made once."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from loop_bench import duhem, nothing, write_case


def run(model: Path, files: list[Path], out: Path, **more: Any) -> dict[str, Any]:
    from fem_spa.loop.diagnose import diagnose

    diagnose(model, files, more.pop("holdout", []), more.pop("seed", 0), out, page=more.pop("page", False))
    return json.loads((out / "report.json").read_text())


@pytest.fixture(scope="session")
def diagnosed() -> Any:
    """Function that runs a diagnosis and reads its report."""
    return run


@pytest.fixture(scope="session")
def loops(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Path], Path, dict[str, Any]]:
    """Model, records, folder and report of a case with hysteresis."""
    folder = tmp_path_factory.mktemp("loops")
    model, files = write_case(folder / "case", duhem)
    return model, files, folder / "out", run(model, files, folder / "out", page=True)


@pytest.fixture(scope="session")
def null(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Report of a case with nothing in it but noise."""
    folder = tmp_path_factory.mktemp("null")
    model, files = write_case(folder / "case", nothing)
    return run(model, files, folder / "out")
