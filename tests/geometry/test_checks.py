"""Bad meshes are caught, each with its reason; small meshes made by hand."""

from dataclasses import replace

import numpy as np
import pytest

import geometry
from geometry import GeometryError, TaggedMesh
from geometry.checks import check
from geometry.measures import body_volume, cavity_volume, face_areas, symmetry_origin, tet_volumes
from geometry.topology import boundary, oriented, right_handed


def grid(n, size):
    """Tets of a cube of n^3 cells, (points, tets, cell of each tet)."""
    axis = np.linspace(0, size, n + 1)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    paths = [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)]
    tets, cells = [], []
    for cell in np.ndindex(n, n, n):
        for path in paths:
            at = list(cell)
            corner = [number[tuple(at)]]
            for direction in path:
                at[direction] += 1
                corner.append(number[tuple(at)])
            x = points[corner]
            if np.linalg.det(x[1:] - x[0]) < 0:
                corner[2], corner[3] = corner[3], corner[2]
            tets.append(corner)
            cells.append(cell)
    return points, np.array(tets), np.array(cells)


@pytest.fixture
def hollow():
    """A cube of 30 mm with a cubic void of 10 mm, closed."""
    points, tets, cells = grid(3, 0.03)
    tets = tets[~(cells == 1).all(axis=1)]
    bare = TaggedMesh(points, tets, {"body": np.arange(len(tets))}, {})
    faces = boundary(bare)
    centre = points[faces].mean(axis=1)
    inside = ((centre > 0.005) & (centre < 0.025)).all(axis=1)
    base, tip = centre[:, 0] < 1e-9, centre[:, 0] > 0.03 - 1e-9
    surfaces = {
        "cavity main": faces[inside],
        "base": faces[base],
        "tip": faces[tip],
        "outer": faces[~inside & ~base & ~tip],
    }
    return TaggedMesh(points, tets, {"body": np.arange(len(tets))}, surfaces)


def test_good_mesh_passes_and_measures_right(hollow):
    for mesh in (hollow, geometry.to_second_order(hollow)):
        check(mesh, surfaces=["base", "tip", "outer"], volumes=["body"])
        assert body_volume(mesh) == pytest.approx(26e-6)
        assert cavity_volume(mesh, "main") == pytest.approx(1e-6)
        assert geometry.area(mesh, "base") == pytest.approx(9e-4)
        report = geometry.quality(mesh)
        assert report.inverted == report.flat == 0 and 0.2 < report.worst < 1
        assert report.shortest == pytest.approx(0.01) and report.longest == pytest.approx(0.01 * 3**0.5)


def test_second_order_shares_its_middle_nodes(hollow):
    mesh = geometry.to_second_order(hollow)
    edges = {
        tuple(sorted(e))
        for t in hollow.tets
        for e in t[[[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]].tolist()
    }
    assert len(mesh.points) == len(hollow.points) + len(edges)
    for k, (i, j) in enumerate(((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))):
        middle = mesh.points[mesh.tets[:, [i, j]]].mean(axis=1)
        assert np.allclose(mesh.points[mesh.tets[:, 4 + k]], middle)
    for faces in mesh.surfaces.values():
        for k, (i, j) in enumerate(((0, 1), (1, 2), (2, 0))):
            assert np.allclose(mesh.points[faces[:, 3 + k]], mesh.points[faces[:, [i, j]]].mean(axis=1))
    assert geometry.to_second_order(mesh) is mesh


def test_orientation_is_mended(hollow):
    turned = {name: faces[:, ::-1] for name, faces in hollow.surfaces.items()}
    with pytest.raises(GeometryError, match="normal points into the body"):
        check(replace(hollow, surfaces=turned))
    mended = oriented(replace(hollow, surfaces=turned))
    check(mended)
    assert cavity_volume(mended, "main") == pytest.approx(1e-6)


def test_left_handed_mesh_is_renumbered(hollow):
    for mesh in (hollow, geometry.to_second_order(hollow)):
        turn = [1, 0, 2, 3, 4, 6, 5, 8, 7, 9][: mesh.tets.shape[1]]
        left = mesh.tets[:, turn]
        assert (tet_volumes(mesh.points, left) < 0).all()
        assert np.array_equal(right_handed(mesh.points, left), mesh.tets)


def test_inverted_element_is_caught_and_located(hollow):
    mesh = geometry.to_second_order(hollow)
    points = mesh.points.copy()
    tet = mesh.tets[5]
    points[tet[4]] += 3 * (points[tet[2]] - points[tet[4]])
    with pytest.raises(GeometryError, match=r"inverted element \d+ at \(.*\) mm"):
        check(replace(mesh, points=points))
    points = hollow.points.copy()
    corner = np.flatnonzero((np.abs(points - [0.01, 0.01, 0.01]) < 1e-9).all(axis=1))
    points[corner] -= 0.025
    with pytest.raises(GeometryError, match="inverted"):
        check(replace(hollow, points=points))


def test_flat_element_is_caught(hollow):
    a, b, c, d = hollow.tets[0]
    points = hollow.points.copy()
    points[d] = (points[a] + points[b] + points[c]) / 3
    with pytest.raises(GeometryError, match=r"flat|inverted"):
        check(replace(hollow, points=points))


def test_open_cavity_is_caught_with_the_place(hollow):
    surfaces = dict(hollow.surfaces)
    lost, surfaces["cavity main"] = surfaces["cavity main"][:1], surfaces["cavity main"][1:]
    surfaces["outer"] = np.vstack([surfaces["outer"], lost])
    with pytest.raises(GeometryError, match=r"cavity `main` is open: 3 free edges, the first at \("):
        check(replace(hollow, surfaces=surfaces))


def test_outside_named_a_cavity_is_caught(hollow):
    surfaces = {"cavity main": np.vstack([hollow.surfaces[n] for n in ("base", "tip", "outer")])}
    with pytest.raises(GeometryError, match="outside of the body was named a cavity"):
        check(replace(hollow, surfaces=surfaces))


def test_missing_and_empty_groups_are_named(hollow):
    with pytest.raises(
        GeometryError, match="missing surface `crown`; allowed: groups found: `body`, `cavity main`"
    ):
        check(hollow, surfaces=["crown"])
    with pytest.raises(GeometryError, match="missing volume `frame`"):
        check(hollow, volumes=["frame"])
    with pytest.raises(GeometryError, match="no surface `cavity NAME`"):
        check(replace(hollow, surfaces={"base": hollow.surfaces["base"]}))
    with pytest.raises(GeometryError, match="`tip` is empty"):
        check(replace(hollow, surfaces={**hollow.surfaces, "tip": hollow.surfaces["tip"][:0]}))


def test_metres_and_millimetres_are_told_apart(hollow):
    with pytest.raises(GeometryError, match="mesh in mm said to be metres"):
        check(replace(hollow, points=hollow.points * 1e3))
    with pytest.raises(GeometryError, match="mesh in metres said to be mm"):
        check(replace(hollow, points=hollow.points * 1e-3))


def test_symmetry_must_be_plane_and_share_no_face(hollow):
    with pytest.raises(GeometryError, match="`symmetry` is not plane"):
        check(
            replace(
                hollow,
                surfaces={
                    "cavity main": hollow.surfaces["cavity main"],
                    "symmetry": hollow.surfaces["outer"],
                },
            )
        )
    with pytest.raises(GeometryError, match="share faces"):
        check(replace(hollow, surfaces={**hollow.surfaces, "symmetry": hollow.surfaces["base"]}))


def test_elements_outside_every_volume_and_bad_numbers(hollow):
    with pytest.raises(GeometryError, match="in 0 named volumes"):
        check(replace(hollow, volumes={"body": np.arange(10)}))
    with pytest.raises(GeometryError, match="in 2 named volumes"):
        check(replace(hollow, volumes={**hollow.volumes, "twice": np.arange(1)}))
    points = hollow.points.copy()
    points[7] = np.nan
    with pytest.raises(GeometryError, match="node 7"):
        check(replace(hollow, points=points))
    with pytest.raises(GeometryError, match="out of range"):
        check(replace(hollow, tets=hollow.tets + 10**6))


def test_surface_that_is_no_face_of_the_mesh(hollow):
    stray = np.array([[0, 20, 41]])
    with pytest.raises(GeometryError, match="no face of any tet"):
        oriented(replace(hollow, surfaces={**hollow.surfaces, "tip": stray}))
    inner = hollow.tets[40][[0, 1, 2]][None]
    surfaces = {**hollow.surfaces, "load": inner}
    if not np.isin(inner, np.concatenate([f for f in hollow.surfaces.values()])).all():
        with pytest.raises(GeometryError, match="lie inside the body"):
            check(oriented(replace(hollow, surfaces=surfaces)))


def test_curved_sphere_measures():
    """A six-node triangle and a ten-node tet bent on a known map: exact by hand."""
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    middle = np.array(
        [(corner[i] + corner[j]) / 2 for i, j in ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))]
    )
    points = np.vstack([corner, middle])
    bent = points.copy()
    bent[:, 2] += 0.2 * points[:, 0] ** 2  # volume-preserving shear
    tets = np.arange(10)[None]
    assert tet_volumes(bent, tets)[0] == pytest.approx(1 / 6, rel=1e-12)
    stretched = points.copy()
    stretched[:, 0] += 0.3 * points[:, 0] ** 2  # volume: integral of 1 + 0.6 x over the tet
    assert tet_volumes(stretched, tets)[0] == pytest.approx(1 / 6 + 0.6 / 24, rel=1e-12)
    flat = face_areas(stretched, np.array([[0, 1, 2, 4, 5, 6]]))[0]
    assert flat == pytest.approx(0.5 + 0.6 / 6, rel=1e-12)


def test_origin_of_three_symmetry_planes():
    points, tets, _ = grid(2, 0.02)
    points = points + np.array([0.1, 0.2, 0.3])
    bare = TaggedMesh(points, tets, {"body": np.arange(len(tets))}, {})
    faces = boundary(bare)
    centre = points[faces].mean(axis=1)
    planes = {f"symmetry {n}": faces[np.abs(centre[:, k] - (k + 1) / 10) < 1e-9] for k, n in enumerate("xyz")}
    assert symmetry_origin(replace(bare, surfaces=planes)) == pytest.approx([0.1, 0.2, 0.3])
