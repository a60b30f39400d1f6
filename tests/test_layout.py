"""The architecture: which rooms there are, and that arrows go one way only."""

from __future__ import annotations

import ast
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = ("fem_spa", "geometry", "materials", "studies")
TOP_LEVEL = {
    *ROOMS,
    *("tests", "benchmarks", "docs", ".ci"),
    *("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "LICENSE", "Makefile", "pyproject.toml", ".gitignore"),
}
# room -> what it must not import, anywhere in its files
FORBIDDEN = {
    "geometry": ("fem_spa", "materials", "studies"),
    "materials": ("fem_spa", "geometry", "studies"),
    "fem_spa": ("studies",),
    "fem_spa/solid": ("fem_spa.reduced", "fem_spa.loop", "fem_spa.output", "fem_spa.commands", "fem_spa.run"),
    "fem_spa/reduced": ("fem_spa.solid", "fem_spa.loop", "fem_spa.output", "fem_spa.commands", "fem_spa.run"),
    "fem_spa/output": ("fem_spa.commands", "fem_spa.run", "fem_spa.prepare", "fem_spa.deck", "fem_spa.loop"),
}
HEAVY = ("numpy", "scipy", "gmsh", "meshio", "skfem", "numba", "pypardiso", "pyvista", "vtk", "matplotlib")
HEAVY += ("pydantic", "pint", "rich")
# where a heavy import may stand at the top of a file: the modules that need it
HOMES = {
    "gmsh": (),
    "pyvista": (),
    "vtk": (),
    "matplotlib": (),
    "numba": ("fem_spa/solid", "fem_spa/reduced"),
}


def sources(place: str) -> Iterator[Path]:
    return (path for path in sorted((ROOT / place).rglob("*.py")) if "__pycache__" not in path.parts)


def imports(path: Path, only_at_import: bool = False) -> set[str]:
    """Modules that a file imports: at its top level, or anywhere; not those that only a type checker sees."""
    found: set[str] = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            for statement in [] if only_at_import else node.body:
                visit(statement)
            return
        if only_at_import and isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            return
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        if isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"{path}: imports are absolute"
            found.add(node.module)
            found.update(f"{node.module}.{alias.name}" for alias in node.names)
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(ast.parse(path.read_text(encoding="utf-8")))
    return found


def within(module: str, package: str) -> bool:
    return module == package or module.startswith(package + ".")


@pytest.mark.parametrize("room", FORBIDDEN)
def test_arrows_go_one_way(room: str) -> None:
    for path in sources(room):
        for module in imports(path):
            for package in FORBIDDEN[room]:
                assert not within(module, package), f"{path.relative_to(ROOT)} imports {module}"


@pytest.mark.parametrize("library", HOMES)
def test_heavy_libraries_are_loaded_where_they_are_needed(library: str) -> None:
    for room in ROOMS:
        for path in sources(room):
            if any(path.is_relative_to(ROOT / home) for home in HOMES[library]):
                continue
            loaded = [m for m in imports(path, only_at_import=True) if within(m, library)]
            assert not loaded, f"{path.relative_to(ROOT)} imports {loaded[0]} when it is itself imported"


def reachable(start: str) -> dict[str, set[str]]:
    """Module of ours -> what it imports when imported, for all that importing `start` loads."""
    found: dict[str, set[str]] = {}
    waiting = [start]
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        base = ROOT / name.replace(".", "/")
        path = base / "__init__.py" if base.is_dir() else base.with_suffix(".py")
        if not path.is_file():  # a name inside a module
            continue
        found[name] = imports(path, only_at_import=True)
        parents = [name.rpartition(".")[0]]
        ours = [module for module in found[name] if module.partition(".")[0] in ROOMS]
        waiting += [module for module in (*ours, *parents) if module]
    return found


@pytest.mark.parametrize(
    "start", ["fem_spa.cli", "fem_spa.commands.mesh", "fem_spa.commands.study", "geometry"]
)
def test_help_loads_nothing_heavy(start: str) -> None:
    """Without running it: what the commands' help stands on imports none of the large libraries."""
    for module, loaded in reachable(start).items():
        heavy = {m for m in loaded if m.partition(".")[0] in HEAVY}
        assert not heavy, f"{start} loads {module}, which imports {sorted(heavy)}"


def tracked() -> list[Path]:
    """Files that git knows; a copy without git (an unpacked archive) is not examined."""
    done = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip("not a git work tree")
    return [Path(name) for name in done.stdout.split("\0") if name and (ROOT / name).is_file()]


def test_top_level_has_the_given_names_only() -> None:
    assert {path.parts[0] for path in tracked()} <= TOP_LEVEL


def test_nothing_tracked_knows_a_machine() -> None:
    """No path of one machine, no host of a package registry."""
    slash = "/"
    machine = re.compile(
        rf"(?<![\w.]){slash}(?:home|Users|root|work|tmp|mnt|opt)/\w|[A-Z]:\\\\Users|(?:index|registry)-url|pypi\."
    )
    for path in tracked():
        if path.suffix in (".png", ".csv", ".msh", ".step") or path == Path("tests/test_layout.py"):
            continue
        for number, line in enumerate((ROOT / path).read_text(encoding="utf-8").splitlines(), 1):
            assert not machine.search(line), f"{path}:{number}: {line.strip()}"


def test_files_stay_small() -> None:
    """A file that outgrows this has more than one thing in it."""
    for room in (*ROOMS, "tests"):
        for path in sources(room):
            lines = len(path.read_text(encoding="utf-8").splitlines())
            assert lines <= 450, f"{path.relative_to(ROOT)} has {lines} lines"
