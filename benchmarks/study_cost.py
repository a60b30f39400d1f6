"""What studies cost as a user runs them, one after the other; prints a Markdown table.

    python benchmarks/study_cost.py [NAME ...]

CPU is user and system time of the whole process, mesh, files, pictures and report counted; beside other
programs it is larger than on a quiet machine, and wall time much larger.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

ACTUATORS = (
    *("zigzag_linear", "zigzag_bending", "bellow", "tripod", "fast_module", "composite_finger"),
    *("grasp_sphere", "arm_segment", "contact_onset", "finger_on_plate"),
)


def main() -> None:
    """Run every study asked for in a folder that is thrown away."""
    print("| study | CPU [s] | wall [s] | memory [MB] | exit |\n| --- | ---: | ---: | ---: | ---: |")
    for name in sys.argv[1:] or ACTUATORS:
        with tempfile.TemporaryDirectory() as folder:
            begun = time.perf_counter()
            command = [sys.executable, "-m", "fem_spa.cli", "study", name, "--out", folder]
            child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            _, status, used = os.wait4(child.pid, 0)
            wall = time.perf_counter() - begun
        cpu, memory = used.ru_utime + used.ru_stime, used.ru_maxrss / 1024
        code = os.waitstatus_to_exitcode(status)
        print(f"| `{name}` | {cpu:.0f} | {wall:.0f} | {memory:.0f} | {code} |", flush=True)


if __name__ == "__main__":
    main()
