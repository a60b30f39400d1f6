"""Planes of symmetry: those of the mesh are those of the deck, and no load goes across them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fem_spa.deck import parse_deck
from fem_spa.errors import InputError
from fem_spa.prepare import Setup, prepare
from geometry.tagged import TaggedMesh

Deck = Callable[..., str]
Prepare = Callable[..., Setup]
QUARTER: dict[str, Any] = {"shape": "tube", "size": "8 mm", "share": 4}
HALF: dict[str, Any] = {"shape": "tube", "size": "8 mm", "share": 2}


def prepared(geometry: dict[str, Any], symmetry: dict[str, str] | None = None, **loads: Any) -> Setup:
    tables: dict[str, Any] = {
        "geometry": geometry,
        "materials": {"body": {"card": "dragon-skin-30"}},
        "loads": {"pressure": "2 kPa", **loads},
    }
    if symmetry is not None:
        tables["supports"] = {"symmetry": symmetry}
    return prepare(parse_deck(tables))


def test_built_in_planes_are_found() -> None:
    assert prepared(QUARTER).problem.symmetry == {"symmetry y": "y", "symmetry z": "z"}
    assert prepared(HALF).problem.symmetry == {"symmetry": "y"}


@pytest.mark.parametrize("shape", ["tripod", "arm-segment"])
def test_halves_cut_along_x(shape: str) -> None:
    setup = prepared({"shape": shape, "half": True})
    assert setup.problem.symmetry == {"symmetry": "x"}
    assert setup.resolved["supports"]["symmetry"] == {"symmetry": "x"}


@pytest.mark.parametrize(
    "symmetry,words",
    [
        ({}, "does not name it"),
        ({"symmetry": "x"}, "along y"),
        ({"symmetry": "y", "tip": "x"}, "no cut"),
        ({"symmetry": "y", "cavity main": "x"}, "no cut"),
        ({"symmetry": "y", "outer": "z"}, "no plane"),
    ],
)
def test_planes_that_the_mesh_does_not_have(symmetry: dict[str, str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        prepared(HALF, symmetry)


def test_a_plane_left_out() -> None:
    with pytest.raises(InputError, match='"symmetry z" = '):
        prepared(QUARTER, {"symmetry y": "y"})


@pytest.mark.parametrize("name", ["symmetry", "symmetry y"])
def test_a_file_says_its_planes(deck: Deck, block: TaggedMesh, name: str) -> None:
    from fem_spa.deck import read_deck

    outer = block.surfaces["outer"]
    plane = np.all(block.points[outer][:, :, 1] < 1e-9, axis=1)
    path = deck(surfaces={**block.surfaces, "outer": outer[~plane], name: outer[plane]})
    with pytest.raises(InputError, match=r"supports.symmetry does not name it.*= \"y\""):
        prepare(read_deck(path))
    with pytest.raises(InputError, match="does not name it"):
        prepare(read_deck(path, ["supports.symmetry={}"]))
    setup = prepare(read_deck(path, [f"supports.symmetry={{ '{name}' = 'y' }}"]))
    assert setup.problem.symmetry == {name: "y"}


ACROSS = [
    {"gravity": [0, 9.81, 0]},
    {"tip_force": [0, "1 N", 0]},
    {"tip_displacement": [0, "1 mm", "1 mm"]},
]


@pytest.mark.parametrize("loads", ACROSS, ids=[next(iter(loads)) for loads in ACROSS])
def test_loads_across_a_plane(loads: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"mesh the whole actuator \(share = 1\)"):
        prepared(HALF, **loads)


def test_loads_within_a_plane() -> None:
    setup = prepared(HALF, gravity=[1, 0, -9.81], tip_force=["1 N", 0, "1 N"])
    assert setup.problem.loads.tip_force == (1.0, 0.0, 1.0)


def test_the_tip_is_pulled_towards_its_mirror_image(deck: Deck, block: TaggedMesh) -> None:
    """A plane across the tip's normal mirrors it to another end: pulling both apart is symmetric."""
    from fem_spa.deck import read_deck

    surfaces = {name: faces for name, faces in block.surfaces.items() if name != "base"}
    path = deck(surfaces={**surfaces, "x0": block.surfaces["base"]})
    held = ["supports.fixed=['outer']", "supports.symmetry={ x0 = 'x' }"]
    setup = prepare(read_deck(path, [*held, "loads.tip_displacement=['1 mm', 0, 0]"]))
    assert setup.problem.loads.tip_displacement == (0.001, 0.0, 0.0)
    with pytest.raises(InputError, match="mesh the whole actuator"):
        prepare(read_deck(path, [*held, "materials.body.density='1000 kg/m^3'", "loads.gravity=[1, 0, 0]"]))


def test_a_law_with_its_own_bulk_takes_no_other(deck: Deck) -> None:
    from fem_spa.deck import read_deck

    linear = "materials.body={ law = 'linear', E = '1 MPa', nu = 0.4, bulk = '1 GPa' }"
    with pytest.raises(InputError, match=r"materials.body.bulk: the law linear gives its own"):
        prepare(read_deck(deck(), [linear]))
    with pytest.raises(InputError, match=r"^materials.body: bulk modulus"):
        prepare(read_deck("deck.toml", ["materials.body.bulk='1 kPa'"]))


def test_lists_in_a_path_need_names() -> None:
    tables = {
        "geometry": {"shape": "pneunet"},
        "materials": {"body": {"card": "dragon-skin-30"}},
        "loads": {"pressure": "2 kPa", "path": [["2 kPa", "0 kPa"]]},
    }
    from fem_spa.prepare import load_points

    with pytest.raises(InputError, match=r"name them: \{ fast = ..., slow = ... \}"):
        load_points(parse_deck(tables), _Two(), {})  # type: ignore[arg-type]


class _Two:
    """As much of a mesh as a load path asks for."""

    cavities = ("fast", "slow")
