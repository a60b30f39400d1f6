"""What is installed: versions within ranges whose ends are both tested, data files beside the code."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from importlib import metadata, resources
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
RANGE = re.compile(r"[\w.-]+>=[\d.]+,<[\d.]+(;.*)?")


def numbers(version: str) -> list[int]:
    """Release numbers, without what follows a letter, and without zeros at the end."""
    found = [int(part) for part in re.split(r"[^\d.]", version)[0].split(".") if part]
    while found and found[-1] == 0:
        found.pop()
    return found


@pytest.mark.parametrize("requirement", PROJECT["dependencies"])
def test_every_version_has_two_ends(requirement: str) -> None:
    """Catches a dependency whose next major breaks what is installed, and an environment beyond the range."""
    assert RANGE.fullmatch(requirement), requirement
    name, lowest, next_one = re.match(r"([\w.-]+)>=([\d.]+),<([\d.]+)", requirement).groups()
    try:
        here = metadata.version(name)
    except metadata.PackageNotFoundError:
        assert ";" in requirement, f"{name} is not installed"  # not for this machine
        return
    assert numbers(lowest) <= numbers(here) < numbers(next_one), f"{name} {here}"


def test_the_lowest_versions_are_those_of_the_ranges() -> None:
    """.ci/install tests what this prints: a name that it overlooks would be tested at its newest only."""
    done = subprocess.run(
        [sys.executable, str(ROOT / ".ci" / "lowest.py")], capture_output=True, text=True, check=True
    )
    printed = dict(line.split("==") for line in done.stdout.split())
    for requirement in PROJECT["dependencies"]:
        name, lowest = re.match(r"([\w.-]+)>=([\d.]+)", requirement).groups()
        assert printed[name] == lowest


@pytest.mark.parametrize(
    "room, ending, least", [("materials", ".toml", 10), ("studies", ".toml", 8), ("studies", ".py", 10)]
)
def test_data_files_are_where_the_code_looks_for_them(room: str, ending: str, least: int) -> None:
    """As installed, wherever that is: cards and decks are no code, and a wheel forgets them easily."""
    tracked = [path for path in (ROOT / room).rglob(f"*{ending}") if "__pycache__" not in path.parts]
    assert len(tracked) >= least
    for path in tracked:
        place = resources.files(room).joinpath(*path.relative_to(ROOT / room).parts)
        assert place.is_file(), f"{path.relative_to(ROOT)} is not installed"
