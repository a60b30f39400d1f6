"""What studies cost as a user runs them, one after the other; prints a Markdown table.

    python benchmarks/study_cost.py [--out FOLDER] [NAME ...]

What the studies write is thrown away, or kept in FOLDER/NAME.
CPU is user and system time of the whole process, mesh, files, pictures and report counted; beside other
programs it is larger than on a quiet machine, and wall time much larger.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ACTUATORS = (
    *("zigzag_linear", "zigzag_bending", "bellow", "tripod", "fast_module", "composite_finger"),
    *("grasp_sphere", "arm_segment", "contact_onset", "finger_on_plate"),
)


def main() -> None:
    """Run every study asked for, one after the other."""
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--out", type=Path)
    words = parser.parse_args()
    print("| study | CPU [s] | wall [s] | memory [MB] | exit |\n| --- | ---: | ---: | ---: | ---: |")
    for name in words.names or ACTUATORS:
        with tempfile.TemporaryDirectory() as folder:
            begun = time.perf_counter()
            place = str(words.out / name) if words.out else folder
            command = [sys.executable, "-m", "fem_spa.cli", "study", name, "--out", place]
            child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            _, status, used = os.wait4(child.pid, 0)
            wall = time.perf_counter() - begun
        cpu, memory = used.ru_utime + used.ru_stime, used.ru_maxrss / 1024
        code = os.waitstatus_to_exitcode(status)
        print(f"| `{name}` | {cpu:.0f} | {wall:.0f} | {memory:.0f} | {code} |", flush=True)


if __name__ == "__main__":
    main()
