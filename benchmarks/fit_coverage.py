"""How often the 95 % intervals of a fit hold the truth, over 500 draws of noise; and the 19 silicones' time.

Run: python benchmarks/fit_coverage.py [DATA]      with DATA, the folder of measured tests, the time too
"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "materials")]

from test_fitting import coverage  # noqa: E402

NAMES = (
    "neo-hooke",
    "mooney-rivlin",
    "yeoh-2",
    "yeoh-3",
    "ogden-1",
    "ogden-2",
    "ogden-3",
    "gent",
    "arruda-boyce",
    "extended-tube",
    "linear",
)


def main() -> None:
    """Print the shares; 500 draws have a standard error of 1 % about 95 %."""
    print(f"Python {platform.python_version()}, numpy {np.__version__}, {os.cpu_count()} cores")
    print(
        "Three modes of 20 rows, noise of 3 kPa, 500 draws: share of the 95 % intervals that hold the truth"
    )
    print("(ogden-3: Ogden's constants of 1972 over Treloar's ranges)")
    for name in NAMES:
        shares = coverage(name, 500)
        print(f"  {name:14s} " + ", ".join(f"{key} {100 * share:.1f} %" for key, share in shares.items()))
    if len(sys.argv) > 1:
        time_silicones(Path(sys.argv[1]))


def time_silicones(data: Path) -> None:
    """The whole command, from the shell."""
    with tempfile.TemporaryDirectory() as out:
        command = [sys.executable, "-m", "fem_spa.cli", "fit", "silicone_tensile_marechal", "--each"]
        command += ["--data", str(data), "--out", out]
        start, before = time.perf_counter(), os.times()
        subprocess.run(
            command,
            cwd=ROOT,
            check=True,
            stdout=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
        wall, after = time.perf_counter() - start, os.times()
        cpu = after.children_user - before.children_user
        load = f", load average {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
        print(f"19 silicones, ten laws each, cards and page: {wall:.1f} s ({cpu:.1f} s of one core{load})")


if __name__ == "__main__":
    main()
