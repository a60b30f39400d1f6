"""Wrong input through the real entry: status 2, one line with a reason, nothing written."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fem_spa.cli import main
from geometry.tagged import TaggedMesh

Deck = Callable[..., str]


def refused(arguments: list[str], capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The one line of a refusal; the current folder is as it was."""
    before = sorted(str(path) for path in Path(".").rglob("*"))
    assert main(arguments) == 2
    captured = capsys.readouterr()
    lines = captured.err.splitlines()
    assert len(lines) == 1, captured.err
    assert "Traceback" not in captured.err
    for word in words:
        assert word in lines[0], lines[0]
    assert sorted(str(path) for path in Path(".").rglob("*")) == before
    return lines[0]


SETTINGS = [
    ("loads.presure='1 kPa'", ["loads.presure", "did you mean 'pressure'"]),
    ("load.pressure='1 kPa'", ["did you mean 'loads'"]),
    ("geometry.wal='1 mm'", ["geometry.wal"]),
    ("materials.body.C1='1 MPa'", ["materials.body.C1", "C10"]),
    ("loads.pressure='1 mm'", ["loads.pressure", "'20 kPa'"]),
    ("loads.pressure=5", ["loads.pressure", "unit is missing"]),
    ("loads.pressure=nan", ["loads.pressure", "not a number"]),
    ("loads.pressure='-2 bar'", ["least allowed"]),
    ("loads.pressure={ left = '1 kPa' }", ["loads.pressure.left", "no cavity 'left'", "main"]),
    ("loads.path=['1 kPa','2 mm']", ["loads.path.1"]),
    ("loads.path=[['1 kPa','2 kPa']]", ["loads.path.0", "1 values"]),
    ("loads.points=0", ["loads.points"]),
    ("loads.gravity=[0,0,-9.81]", ["density"]),
    ("loads.gravity=[0,0]", ["three numbers"]),
    ("loads.control=volume", ["control", "loads.volume"]),
    ("loads.control=arc", ["'pressure', 'volume' or 'gas-mass'"]),
    ("loads.contact=yes", ["loads.contact"]),
    (
        "loads.obstacles=[{ plane = { point = ['1 mm',0,0], normal = [1,0,0] } }]",
        ["1 mm deep", "(0.0, 0.0, 0.0) mm"],
    ),
    (
        "loads.obstacles=[{ plane = { point = ['-1 mm',0,0], normal = [0,0,0] } }]",
        ["a direction has a length"],
    ),
    (
        "loads.obstacles=[{ sphere = { centre = [0,0,'1 m'], radius = ['1 mm','2 mm'] } }]",
        ["one value or three"],
    ),
    ("loads.obstacles=[{ cylinder = { point = [0,0,'1 m'], axis = [1,0,0] } }]", ["radius is missing"]),
    ("loads.obstacles=[{ plane = { point = ['1 mm',0,0], norml = [1,0,0] } }]", ["normal"]),
    ("materials.body.card=dragon-skin-30", ["either card or law"]),
    ("materials.body={ card = 'dragon-skin-3' }", ["dragon-skin-30"]),
    ("materials.body={ card = 'missing.toml' }", ["missing.toml"]),
    ("materials.body.law=yeo", ["yeoh"]),
    ("materials.body.C10='10 Pa'", ["shear modulus"]),
    ("materials.body.C10='-1 MPa'", ["materials.body", "C10"]),
    ("materials.body.bulk='-1 MPa'", ["bulk"]),
    ("materials.skin={ card = 'dragon-skin-30' }", ["no volume 'skin'"]),
    ("materials={}", ["materials.body is missing"]),
    ("layers.paper={ modulus = '2 GPa', thickness = '0.1 mm' }", ["no surface 'layer paper'"]),
    ("layers.paper={ modulus = '2 GPa' }", ["layers.paper.thickness is missing"]),
    ("supports.fixed=['bas']", ["no surface 'bas'", "did you mean 'base'"]),
    ("supports.fixed=[]", ["float"]),
    ("supports.symmetry={ symmetry = 'y' }", ["no surface 'symmetry'"]),
    ("supports.symmetry={ base = 'w' }", ["'x', 'y' or 'z'"]),
    ("geometry.unit=furlong", ["geometry.unit", "mm"]),
    ("geometry.unit=m", ["10 m", "unit"]),
    ("geometry.file=nothing.msh", ["nothing.msh"]),
    ("geometry.file=deck.toml", ["deck.toml"]),
    ("geometry.shape=pneunet", ["both"]),
    ("geometry={ shape = 'pneunet', slow_pitc = '9 mm' }", ["did you mean 'slow_pitch'"]),
    ("geometry={ shape = 'pneune' }", ["did you mean 'pneunet'"]),
    ("observe.angle=tip", ["'tip-face', 'chord' or 'tangent'"]),
    ("solver.tolerance=1", ["solver.tolerance"]),
    ("nonsense", ["key=value"]),
    ("a..b=1", ["dotted key"]),
    ("loads.pressure.main.x=1", ["not a table"]),
]


@pytest.mark.parametrize("setting,words", SETTINGS, ids=[setting for setting, _ in SETTINGS])
def test_setting(deck: Deck, capsys: pytest.CaptureFixture[str], setting: str, words: list[str]) -> None:
    refused(["solve", deck(), "--set", setting, "--out", "out"], capsys, *words)


SIZES = [
    ("slow_pitch='18 kPa'", ["geometry.slow_pitch", "a length is needed"]),
    ("slow_pitch='-3 mm'", ["slow_pitch"]),
    ("slow_pitch=nan", ["slow_pitch"]),
    ("slow_pitch='nan mm'", ["slow_pitch"]),
    ("slow_pitch='9 m'", ["slow_pitch"]),
    ("slow_pitch=9", ["slow_pitch", "unit is missing"]),
    ("slow_chambers=2.5", ["slow_chambers"]),
    ("slow_inner_wall='0 mm'", ["slow_inner_wall"]),
    ("channel_width='30 mm'", ["channel"]),
    ("size='-1 mm'", ["geometry.size"]),
]


@pytest.mark.parametrize("setting,words", SIZES, ids=[setting for setting, _ in SIZES])
def test_sizes_of_a_shape(
    deck: Deck, capsys: pytest.CaptureFixture[str], setting: str, words: list[str]
) -> None:
    """Refused before gmsh is asked, by `solve` and by `mesh`."""
    text = '[geometry]\nshape = "pneunet"\n[materials.body]\ncard = "dragon-skin-30"\n'
    path = deck(text + '[loads]\npressure = { slow = "4 kPa", fast = "2 kPa" }\n')
    for command in ("solve", "mesh"):
        refused([command, path, "--set", f"geometry.{setting}"], capsys, *words)


def test_open_cavity(deck: Deck, block: TaggedMesh, capsys: pytest.CaptureFixture[str]) -> None:
    surfaces = {**block.surfaces, "cavity main": block.surfaces["cavity main"][:-1]}
    refused(["solve", deck(surfaces=surfaces)], capsys, "cavity")


def test_missing_groups(deck: Deck, block: TaggedMesh, capsys: pytest.CaptureFixture[str]) -> None:
    without = {name: faces for name, faces in block.surfaces.items() if name != "base"}
    refused(["solve", deck(surfaces=without)], capsys, "'base'")
    without = {name: faces for name, faces in block.surfaces.items() if not name.startswith("cavity")}
    refused(["solve", deck(surfaces=without)], capsys, "cavity")


@pytest.mark.parametrize("part", [1.0, 1.2], ids=["flat", "inverted"])
def test_bad_element(deck: Deck, block: TaggedMesh, capsys: pytest.CaptureFixture[str], part: float) -> None:
    """A corner of one tet moved to, or through, the plane of its other three."""
    points, tet = block.points.copy(), block.tets[0]
    points[tet[0]] += part * (points[tet[1:]].mean(axis=0) - points[tet[0]])
    refused(["solve", deck(points=points)], capsys)


@pytest.mark.parametrize("file", ["junk.msh", "cut.msh", "empty.msh", "junk.step", "folder.msh"])
def test_a_file_that_is_not_a_mesh(deck: Deck, capsys: pytest.CaptureFixture[str], file: str) -> None:
    path = deck()
    whole = Path("block.msh").read_bytes()
    content = {"cut.msh": whole[: len(whole) // 2], "empty.msh": b""}.get(file, b"\x00\x01junk" * 50)
    if file == "folder.msh":
        Path(file).mkdir()
    else:
        Path(file).write_bytes(content)
    refused(["solve", path, "--set", f"geometry.file={file}"], capsys, file)


def test_metres_said_to_be_millimetres(deck: Deck, capsys: pytest.CaptureFixture[str]) -> None:
    refused(["solve", deck(unit="m")], capsys, "mm")


def test_a_place_that_cannot_be_written(
    deck: Deck, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Refused by the system when the folder is made: still a wrong input, not a fault of the program."""
    path, mkdir = deck(), Path.mkdir

    def refuse(self: Path, *args: object, **kinds: object) -> None:
        if self.parts[0] == "closed":
            raise PermissionError(13, "Permission denied")
        mkdir(self, *args, **kinds)  # type: ignore[arg-type]

    monkeypatch.setattr(Path, "mkdir", refuse)
    for command, place in (("solve", "closed/out"), ("mesh", "closed/block.msh")):
        assert main([command, path, "--out", place]) == 2
        last = capsys.readouterr().err.splitlines()[-1]
        assert "Permission denied" in last and place in last


def test_a_symmetry_surface_of_a_file_needs_its_plane(
    deck: Deck, block: TaggedMesh, capsys: pytest.CaptureFixture[str]
) -> None:
    outer = block.surfaces["outer"]
    plane = np.all(block.points[outer][:, :, 1] < 1e-9, axis=1)
    surfaces = {**block.surfaces, "outer": outer[~plane], "symmetry": outer[plane]}
    refused(["solve", deck(surfaces=surfaces)], capsys, "supports.symmetry")


def test_decks_that_cannot_be_read(deck: Deck, capsys: pytest.CaptureFixture[str]) -> None:
    refused(["solve", "missing.toml"], capsys, "no such file")
    refused(["solve", "."], capsys, "folder")
    refused(["solve", deck("geometry = [")], capsys, "not valid TOML")
    refused(["solve", deck("x = 1")], capsys, "no such key")
    refused(["solve", deck("")], capsys, "geometry")
    Path("deck.toml").write_bytes(b"\xff\xfe\x00")
    refused(["solve", "deck.toml"], capsys, "UTF-8")


def test_command_lines(deck: Deck, capsys: pytest.CaptureFixture[str]) -> None:
    path = deck()
    refused([], capsys, "a command is needed", "solve")
    refused(["sove", path], capsys, "invalid choice")
    refused(["solve"], capsys, "DECK.toml")
    refused(["solve", path, "--ou", "x", "--nothing"], capsys, "--nothing")
    refused(["solve", path, "--out", "deck.toml"], capsys, "is a file")
    refused(["solve", path, "--out", "deck.toml/below"], capsys, "is a file")
    refused(["solve", path, "--out", "x" * 300], capsys, "--out", "give another folder")
    refused(["mesh", path, "--out", "x" * 300 + ".msh"], capsys, "--out")
    refused(["mesh", path, "--out", "x.stl"], capsys, ".msh or .vtu")
    refused(["study", "no_such_study"], capsys, "there is no such study")


def test_as_a_process(deck: Deck) -> None:
    """The same from the shell: the exit status is the process's, stdout is empty."""
    command = [sys.executable, "-m", "fem_spa.cli", "solve", deck(), "--set", "loads.presure='1 kPa'"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1 and "did you mean 'pressure'" in done.stderr


@pytest.mark.parametrize(
    "setting,words",
    [
        ("#=3", ["dotted key"]),
        ("# x = 3", ["dotted key"]),
        ("loads.gravity=9.81", ["loads.gravity", "a list is needed", "[0, 0, -9.81]"]),
        ("loads.path='2 kPa'", ["loads.path", "a list is needed", '"5 kPa"']),
        ("supports.fixed=base", ["supports.fixed", "a list is needed", '["base"]']),
        ("observe.blocked='true'", []),
        ("observe.blocked=yes", ["observe.blocked", "true or false", "blocked = true"]),
        ("solver.tolerance=1e-13", ["solver.tolerance", "0.000000000001"]),
    ],
)
def test_what_is_needed_is_shown(
    deck: Deck, capsys: pytest.CaptureFixture[str], setting: str, words: list[str]
) -> None:
    line = refused(["solve", deck(), "--set", setting], capsys, *words)
    assert "valid" not in line


def test_an_empty_place(deck: Deck, capsys: pytest.CaptureFixture[str]) -> None:
    path = deck()
    refused(["solve", path, "--out", ""], capsys, "--out", "empty")
    refused(["study", "limit_point", "--out", ""], capsys, "--out", "empty")
    refused(["mesh", path, "--out", ""], capsys, "--out")
