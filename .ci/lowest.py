"""The lowest version of every package that pyproject.toml allows, as constraints for pip.

python .ci/lowest.py > constraints.txt && pip install --constraint constraints.txt ".[dev]"
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def lowest(requirements: list[str]) -> list[str]:
    """name==version of each requirement with a lower bound; the project's own extras have none."""
    found = (re.match(r"([\w.-]+)(?:\[[^]]*\])?\s*>=\s*([\w.]+)", line) for line in requirements)
    return [f"{match[1]}=={match[2]}" for match in found if match]


if __name__ == "__main__":
    extras = [line for group in PROJECT["optional-dependencies"].values() for line in group]
    print("\n".join(sorted(set(lowest(PROJECT["dependencies"] + extras)))))
