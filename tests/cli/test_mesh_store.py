"""Kept meshes are the meshes: the same bits, found by all that they depend on and nothing else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fem_spa import prepare
from fem_spa.deck import Deck, parse_deck
from fem_spa.mesh_store import mesh_key


def deck(meshes: Path | None, size: str = "8 mm", wall: str = "3 mm", pressure: str = "5 kPa") -> Deck:
    tables = {
        "geometry": {"shape": "tube", "size": size, "end_wall": wall, "share": 4},
        "materials": {"body": {"law": "neo-hooke", "C10": "0.1 MPa"}},
        "loads": {"pressure": pressure},
    }
    return parse_deck(tables, meshes=meshes)


def key(given: Deck) -> str:
    return mesh_key(given, prepare.built_in(given))


def test_a_mesh_is_made_once_and_read_back_to_the_bit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fresh = prepare.make_mesh(deck(None))
    first = prepare.make_mesh(deck(tmp_path))
    monkeypatch.setattr(prepare, "_new_mesh", lambda *_: pytest.fail("meshed again"))
    again = prepare.make_mesh(deck(tmp_path, pressure="7 kPa"))
    assert first.hash() == again.hash()
    assert np.allclose(again.points, fresh.points, rtol=0, atol=1e-15)
    assert np.array_equal(again.tets, fresh.tets)
    assert again.source == fresh.source and again.notes == fresh.notes
    assert list(again.surfaces) == list(fresh.surfaces)
    assert all(np.array_equal(again.volumes[n], fresh.volumes[n]) for n in fresh.volumes)
    assert [path.suffix for path in tmp_path.iterdir()] == [".npz"]


def test_the_key_is_that_of_the_drawing() -> None:
    base = key(deck(None))
    assert key(deck(None, wall="0.003 m", size="8.0 mm", pressure="9 kPa")) == base
    assert len({base, key(deck(None, wall="3.1 mm")), key(deck(None, size="9 mm"))}) == 3


def test_a_files_key_is_its_content(tmp_path: Path) -> None:
    def at(name: str, text: str) -> str:
        (tmp_path / name).write_text(text)
        tables = {"geometry": {"file": name, "unit": "mm"}, "loads": {"pressure": "1 kPa"}}
        return mesh_key(parse_deck(tables, folder=tmp_path), None)

    assert at("a.msh", "one") == at("b.msh", "one") != at("c.msh", "two")


def test_a_damaged_file_is_made_anew(tmp_path: Path) -> None:
    prepare.make_mesh(deck(tmp_path))
    path = next(tmp_path.iterdir())
    path.write_bytes(path.read_bytes()[:2000])
    anew = prepare.make_mesh(deck(tmp_path))
    assert prepare.make_mesh(deck(tmp_path)).hash() == anew.hash()
    assert len(list(tmp_path.iterdir())) == 1


def test_of_two_that_mesh_at_once_the_first_ones_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both go on with the same mesh: a resumed run would refuse another one."""
    mesh, found = prepare._new_mesh, []

    def slow(*given: object) -> object:
        own = mesh(*given)
        if not found:
            found.append(own)  # meanwhile another worker makes it and writes it
            found.append(prepare.make_mesh(deck(tmp_path)))
        return own

    monkeypatch.setattr(prepare, "_new_mesh", slow)
    assert prepare.make_mesh(deck(tmp_path)).hash() == found[1].hash()
    assert [path.suffix for path in tmp_path.iterdir()] == [".npz"]
