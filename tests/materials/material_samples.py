"""What the tests of this room share: a believable parameter set a law, synthetic tests, the data folder."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from materials.laws import LAWS
from materials.registry import resolve
from materials.response import nominal_stress
from materials.specimen import Specimen

SAMPLES: dict[str, dict[str, float]] = {
    "neo-hooke": {"C10": 2e5},
    "mooney-rivlin": {"C10": 1.1e5, "C01": 1e4},
    "yeoh": {"C10": 1.1e5, "C20": 2e4, "C30": 3e3},
    "ogden": {"mu1": 0.63e6, "alpha1": 1.3, "mu2": 0.0012e6, "alpha2": 5.0, "mu3": -0.01e6, "alpha3": -2.0},
    "gent": {"mu": 2e5, "Jm": 30.0},
    "arruda-boyce": {"mu": 2e5, "N": 8.0},
    "extended-tube": {"Gc": 2e5, "delta": 0.1, "Ge": 1e5, "beta": 0.3},
    "linear": {"E": 3.1e6, "nu": 0.5},
}


def parameters(name: str) -> dict[str, float]:
    """The sample of law `name`, every parameter of it."""
    assert name in SAMPLES, f"give a sample of law {name} in SAMPLES, so that it is tested"
    return resolve(LAWS[name], SAMPLES[name])


def specimen(
    law: str,
    values: dict[str, float],
    mode: str,
    low: float,
    high: float,
    rows: int = 40,
    noise: float = 0.0,
    seed: int = 0,
) -> Specimen:
    """A synthetic test: the law's own nominal stress, with Gaussian noise of `noise` Pa."""
    stretch = np.linspace(low, high, rows)
    stress = nominal_stress(LAWS[law], resolve(LAWS[law], values), mode, stretch)
    stress = stress + noise * np.random.default_rng(seed).standard_normal(rows)
    return Specimen(f"{law} {mode}", mode, "pull", stretch, stress)


def csv(path: Path, columns: dict[str, object], head: str = "") -> Path:
    """Write columns (header cell -> values) as a test file."""
    names = list(columns)
    rows = zip(*(columns[n] for n in names), strict=True)  # type: ignore[call-overload]
    lines = [",".join(v if isinstance(v, str) else f"{v:.9g}" for v in row) for row in rows]
    path.write_text(head + "\n".join([",".join(names), *lines]) + "\n")
    return path


def data_folder() -> Path | None:
    """The measured data: FEM_SPA_DATA, or ../shared/data beside the repository; None where absent."""
    named = os.environ.get("FEM_SPA_DATA")
    folder = Path(named) if named else Path(__file__).parents[3] / "shared" / "data"
    return folder if (folder / "silicone_tensile_marechal").is_dir() else None


NEEDS_DATA = pytest.mark.skipif(
    data_folder() is None,
    reason="needs the measured data: name their folder in FEM_SPA_DATA (see docs/materials.md)",
)
