"""A user's .msh and STEP files; writing and reading back."""

import os
import re
from pathlib import Path

import numpy as np
import pytest

import geometry
from geometry import GeometryError, read_mesh, write_mesh
from geometry.measures import tet_volumes

SHARED = Path(os.environ.get("FEM_SPA_SHARED", Path(__file__).resolve().parents[3] / "shared"))
EVIDENCE = SHARED / "meshes" / "fast_module_3mm.msh"
needs_evidence = pytest.mark.skipif(
    not EVIDENCE.is_file(), reason=f"{EVIDENCE} is absent (set FEM_SPA_SHARED)"
)


@pytest.fixture(scope="module")
def small():
    return geometry.SHAPES["pneunet"](slow_chambers=1, fast_chambers=2).mesh(5e-3)


@pytest.mark.parametrize("unit", ["mm", "m"])
def test_msh_round_trip(small, tmp_path, unit):
    back = read_mesh(write_mesh(small, tmp_path / "a.msh", unit), unit)
    assert np.abs(back.points - small.points).max() < 1e-15
    assert np.array_equal(back.tets, small.tets)
    assert set(back.surfaces) == set(small.surfaces) and back.notes == ()
    for name, faces in small.surfaces.items():
        assert np.array_equal(back.surfaces[name], faces), name


def test_gmsh_reads_what_is_written(small, tmp_path):
    from geometry.session import session

    path = write_mesh(small, tmp_path / "a.msh", "mm")
    with session() as gmsh:
        gmsh.merge(str(path))
        names = {gmsh.model.getPhysicalName(*g) for g in gmsh.model.getPhysicalGroups()}
        tags, _ = gmsh.model.mesh.getElementsByType(11)
        volume = gmsh.model.mesh.getElementQualities(tags, "volume").sum()
    assert names == {"body", *small.surfaces}
    assert len(tags) == len(small.tets)
    assert volume == pytest.approx(tet_volumes(small.points, small.tets[:, :4]).sum() * 1e9, rel=1e-9)


def test_vtu_holds_the_groups(small, tmp_path):
    import meshio

    back = meshio.read(write_mesh(small, tmp_path / "a.vtu", "mm"))
    assert {"body", *small.surfaces} <= set(back.cell_data)
    assert sum(int(np.sum(part)) for part in back.cell_data["tip"]) == len(small.surfaces["tip"])
    assert np.ptp(back.points[:, 2]) == pytest.approx(24)


@needs_evidence
def test_evidence_mesh():
    mesh = read_mesh(EVIDENCE, "mm")
    assert set(mesh.volumes) == {"body", "stiff"} and mesh.cavities == ("main",)
    assert len(mesh.tets) == 5468 and mesh.tets.shape[1] == 4
    assert geometry.body_volume(mesh, "stiff") == pytest.approx(400e-9)
    assert geometry.area(mesh, "base") == pytest.approx(217.6457e-6)
    second = geometry.to_second_order(mesh)
    geometry.check(second, surfaces=("base", "tip", "symmetry", "outer"), volumes=("body", "stiff"))
    assert 3 * len(second.points) + len(mesh.points) == 32071  # unknowns of design.md's trial


@needs_evidence
def test_evidence_mesh_in_the_wrong_unit():
    with pytest.raises(GeometryError, match="mesh in mm said to be metres"):
        read_mesh(EVIDENCE, "m")
    with pytest.raises(GeometryError, match="unit"):
        read_mesh(EVIDENCE)


def test_mesh_in_metres_said_to_be_mm(small, tmp_path):
    with pytest.raises(GeometryError, match="mesh in metres said to be mm"):
        read_mesh(write_mesh(small, tmp_path / "a.msh", "m"), "mm")


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("empty.msh", b""),
        ("words.msh", b"this is no mesh\n"),
        ("binary.msh", bytes(range(256)) * 20),
        ("empty.step", b""),
        ("words.step", b"this is no drawing\n"),
        ("header.step", b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n"),
        ("half.step", b"ISO-10303-21;\nHEADER;\n"),
    ],
)
def test_damaged_files(tmp_path, name, content, capfd):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(GeometryError, match=name) as caught:
        read_mesh(path, "mm")
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_truncated_msh(small, tmp_path, capfd):
    text = write_mesh(small, tmp_path / "a.msh", "mm").read_text()
    for share in (0.2, 0.5, 0.9):
        (tmp_path / "b.msh").write_text(text[: int(len(text) * share)])
        with pytest.raises(GeometryError):
            read_mesh(tmp_path / "b.msh", "mm")
    assert capfd.readouterr() == ("", "")


def test_wrong_names_units_and_endings(small, tmp_path):
    with pytest.raises(GeometryError, match="no such file"):
        read_mesh(tmp_path / "absent.msh", "mm")
    with pytest.raises(GeometryError, match=r"file type '.stl'"):
        read_mesh(tmp_path / "a.stl", "mm")
    with pytest.raises(GeometryError, match="unit 'feet'"):
        write_mesh(small, tmp_path / "a.msh", "feet")
    with pytest.raises(GeometryError, match="file type"):
        write_mesh(small, tmp_path / "a.obj")
    with pytest.raises(GeometryError, match="cannot be written"):
        write_mesh(small, tmp_path / "no" / "folder" / "a.msh")
    path = write_mesh(small, tmp_path / "a.msh", "mm")
    path.write_text(path.read_text().replace('"tip"', '"point"'))
    with pytest.raises(GeometryError, match=r"missing surface `tip`; allowed: groups found: .*`point`"):
        read_mesh(path, "mm")


def test_unnamed_boundary_becomes_outer(small, tmp_path):
    from dataclasses import replace

    fewer = {n: f for n, f in small.surfaces.items() if n != "outer"}
    back = read_mesh(write_mesh(replace(small, surfaces=fewer), tmp_path / "a.msh", "mm"), "mm")
    assert len(back.surfaces["outer"]) == len(small.surfaces["outer"])
    assert "added to `outer`" in back.notes[0]


def hollow_step(path, names, length=40.0, scale=1.0):
    """Write a box with a closed void and a round bar through STEP by gmsh; name its faces.

    gmsh writes no names of faces, so that they are put into the text, as a CAD program does.
    """
    from geometry.session import session

    with session() as gmsh:
        occ = gmsh.model.occ
        body = occ.addBox(0, 0, 0, length * scale, 10 * scale, 10 * scale)
        void = occ.addCylinder(5 * scale, 5 * scale, 5 * scale, (length - 10) * scale, 0, 0, 3 * scale)
        occ.cut([(3, body)], [(3, void)])
        occ.synchronize()
        gmsh.write(str(path))
    text = path.read_text()
    faces = re.findall(r"(#\d+) = ADVANCED_FACE\(''", text)
    from geometry.step_text import read_step_text

    for number, face in zip(faces, read_step_text(path).faces, strict=True):
        x = [p[0] / scale for p in face.vertices]
        y = {round(p[1] / scale, 6) for p in face.vertices}
        inner = not y & {0.0, 10.0}
        name = (
            "cavity main" if inner else "base" if max(x) < 1e-6 else "tip" if min(x) > length - 1e-6 else ""
        )
        if name in names:
            text = text.replace(f"{number} = ADVANCED_FACE(''", f"{number} = ADVANCED_FACE('{name}'")
    path.write_text(text)


def test_step_becomes_a_mesh_like_a_built_in_shape(tmp_path, capfd):
    path = tmp_path / "box.step"
    hollow_step(path, ("cavity main", "base", "tip"))
    capfd.readouterr()
    for unit in (None, "mm"):
        mesh = read_mesh(path, unit, size=3e-3)
        assert mesh.tets.shape[1] == 10 and set(mesh.volumes) == {"body"}
        assert set(mesh.surfaces) == {"cavity main", "base", "tip", "outer"}
        air = np.pi * 9 * 30
        assert geometry.cavity_volume(mesh, "main") * 1e9 == pytest.approx(air, rel=1e-3)
        assert geometry.body_volume(mesh) * 1e9 == pytest.approx(4000 - air, rel=1e-3)
        assert geometry.area(mesh, "tip") * 1e6 == pytest.approx(100)
    assert read_mesh(path, order=1).tets.shape[1] == 4
    assert capfd.readouterr() == ("", "")


def test_step_unit_is_of_the_files_numbers(tmp_path):
    path = tmp_path / "inch.step"
    hollow_step(path, ("cavity main", "base", "tip"), length=20.0, scale=0.1)  # numbers 0 to 2, said to be mm
    mesh = read_mesh(path, "in", size=5e-3)
    assert np.ptp(mesh.points[:, 0]) == pytest.approx(2 * 0.0254)
    metres = tmp_path / "metres.step"
    metres.write_text(path.read_text().replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"))
    with pytest.raises(GeometryError, match="element size"):
        read_mesh(metres, size=5.0)
    assert np.ptp(read_mesh(metres, size=0.2).points[:, 0]) == pytest.approx(2.0)
    assert np.ptp(read_mesh(metres, "cm", size=5e-3).points[:, 0]) == pytest.approx(0.02)


def test_step_without_names(tmp_path):
    path = tmp_path / "box.step"
    hollow_step(path, ("base",))
    with pytest.raises(GeometryError, match=r"missing surface `tip`; allowed: groups found: .*`base`"):
        read_mesh(path, "mm", size=4e-3)
    hollow_step(path, ("base", "tip"))
    with pytest.raises(GeometryError, match="no surface `cavity NAME`"):
        read_mesh(path, "mm", size=4e-3)


def test_step_of_two_solids_with_a_layer_between(tmp_path):
    from geometry.session import session

    path = tmp_path / "two.step"
    with session() as gmsh:
        occ = gmsh.model.occ
        low, high = occ.addBox(0, 0, 0, 30, 10, 2), occ.addBox(0, 0, 2, 30, 10, 8)
        void = occ.addBox(5, 2, 4, 20, 6, 4)
        occ.cut([(3, high)], [(3, void)])
        occ.synchronize()
        gmsh.write(str(path))
        assert low
    text = path.read_text()
    from geometry.step_text import read_step_text

    numbers = re.findall(r"(#\d+) = ADVANCED_FACE\(''", text)
    for number, face in zip(numbers, read_step_text(path).faces, strict=True):
        low, high = np.min(face.vertices, axis=0), np.max(face.vertices, axis=0)
        name = ""
        if low[2] == high[2] == 2:
            name = "layer paper"
        elif low[0] >= 5 and high[0] <= 25:
            name = "cavity main"
        elif high[0] == 0:
            name = "base"
        elif low[0] == 30:
            name = "tip"
        text = text.replace(f"{number} = ADVANCED_FACE(''", f"{number} = ADVANCED_FACE('{name}'")
    solids = iter(("stiff", "body"))
    text = re.sub(
        r"(MANIFOLD_SOLID_BREP|BREP_WITH_VOIDS)\(''",
        lambda m: f"{m[1]}('{'body' if m[1] == 'BREP_WITH_VOIDS' else next(solids)}'",
        text,
    )
    path.write_text(text)
    mesh = read_mesh(path, "mm", size=3e-3)
    assert {n: round(geometry.body_volume(mesh, n) * 1e9) for n in mesh.volumes} == {
        "stiff": 600,
        "body": 1920,
    }
    assert geometry.area(mesh, "layer paper") * 1e6 == pytest.approx(300)
    assert geometry.cavity_volume(mesh, "main") * 1e9 == pytest.approx(480)
