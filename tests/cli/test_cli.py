"""Help, lists, mesh and solve through the real entry."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from fem_spa.cli import main
from fem_spa.run import run_deck
from geometry.files import read_mesh
from geometry.tagged import TaggedMesh

Deck = Callable[..., str]
BEYOND = ["loads.pressure='5 MPa'", "loads.path=[]"]


def test_help_imports_nothing_heavy() -> None:
    """`--help` is quick because it loads neither numpy nor what stands on it."""
    heavy = ("numpy", "pint", "pydantic", "gmsh", "vtk", "matplotlib", "numba")
    code = (
        "import sys; from fem_spa.cli import main\n"
        "for words in (['--help'], ['mesh', '--help'], ['study', '--list']): main(words)\n"
        f"print([module for module in {heavy} if module in sys.modules])"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True
    )
    assert done.stdout.splitlines()[-1] == "[]"


def test_mesh_help_lists_shapes_with_units(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["mesh", "--help"]) == 0
    text = capsys.readouterr().out
    assert 'shape = "pneunet"' in text
    assert "slow_inner_width" in text and "18 mm" in text


def test_study_list_is_one_line_each(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", "--list"]) == 0
    for line in capsys.readouterr().out.splitlines():
        assert len(line.split(None, 1)) == 2


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("fem-spa ")


def test_mesh_writes_what_a_deck_reads(deck: Deck, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["mesh", deck(), "--out", "meshes/copy.msh"]) == 0
    assert "162" in capsys.readouterr().out or Path("meshes/copy.msh").is_file()
    copy = read_mesh("meshes/copy.msh", unit="mm")
    assert copy.cavities == ("main",)
    assert main(["mesh", "deck.toml"]) == 0
    assert Path("out/deck/deck.msh").is_file()
    assert main(["mesh", "deck.toml", "--out", "copy.vtu"]) == 0
    assert [path.name for path in Path(".").rglob("*part*")] == []


def test_solve_leaves_the_files_of_the_contract(deck: Deck, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", deck(), "--set", "loads.pressure=2 kPa"]) == 0
    assert capsys.readouterr().out.startswith("Done: at 2 kPa")
    folder = Path("out/deck")
    found = {path.name for path in folder.iterdir()}
    assert found == {
        "curve.csv",
        "centre_line.csv",
        "result.json",
        "fields.pvd",
        "fields",
        "curve.png",
        "shape.png",
        "report.html",
        "mesh",
    }
    with open(folder / "curve.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    pressures = [float(row["pressure [kPa]"]) for row in rows]
    assert pressures[-1] == 2.0 and 1.0 in pressures
    result = json.loads((folder / "result.json").read_text())
    assert result["status"] == "done"
    assert {"mesh", "assembly", "linear", "contact", "total"} <= set(result["seconds"])
    for key in (
        "message",
        "dofs",
        "elements",
        "newton_iterations",
        "factorizations",
        "versions",
        "mesh_hash",
    ):
        assert result[key]
    assert len(list((folder / "fields").glob("*.vtu"))) == len(rows)
    assert {path.name for path in Path(".").iterdir()} == {"deck.toml", "block.msh", "out"}


def test_the_resolved_deck_gives_the_same_run(deck: Deck) -> None:
    from fem_spa.output.toml import to_toml

    assert main(["solve", deck(), "--out", "first"]) == 0
    first = json.loads(Path("first/result.json").read_text())
    Path("again.toml").write_text(to_toml(first["deck"]))
    assert main(["solve", "again.toml", "--out", "second"]) == 0
    second = json.loads(Path("second/result.json").read_text())
    assert second["deck"] == first["deck"] and second["mesh_hash"] == first["mesh_hash"]
    assert Path("second/curve.csv").read_text() == Path("first/curve.csv").read_text()


def test_more_than_the_body_bears_ends_with_status_1(deck: Deck) -> None:
    assert main(["solve", deck(), "--set", "loads.pressure=5 MPa", "--set", "loads.path=[]"]) == 1
    result = json.loads(Path("out/deck/result.json").read_text())
    assert result["status"] in ("limit", "diverged")
    assert len(Path("out/deck/curve.csv").read_text().splitlines()) > 1
    assert re.search(r"element \d+ of 'body' at \(.*\) mm", result["message"])


def test_a_mesh_without_tip_has_no_angle_and_says_so(
    deck: Deck, block: TaggedMesh, capsys: pytest.CaptureFixture[str]
) -> None:
    surfaces = {name: faces for name, faces in block.surfaces.items() if name != "tip"}
    assert main(["solve", deck(surfaces=surfaces)]) == 0
    assert "no surface 'tip'" in capsys.readouterr().out


def test_a_study_ends_with_its_warnings_and_the_place_of_its_report(
    deck: Deck, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A study that does not reach its end says why, and its exit status is 1."""
    from studies import slow_module

    deck()
    monkeypatch.setattr(slow_module, "DECK", Path("deck.toml").resolve())
    monkeypatch.setattr(slow_module, "run", lambda out: run_deck(slow_module.DECK, out, BEYOND).exit_status)
    assert main(["study", "slow_module"]) == 1
    captured = capsys.readouterr()
    assert "See out/slow_module/report.html" in captured.out.replace("\\", "/")
    assert "element" in captured.err.splitlines()[-1]


def test_mesh_needs_no_more_than_the_geometry(deck: Deck) -> None:
    path = deck('[geometry]\nfile = "block.msh"\nunit = "mm"\n')
    assert main(["mesh", path]) == 0
    assert Path("out/deck/deck.msh").is_file()
