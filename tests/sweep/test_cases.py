"""Which cases a sweep has: every combination once, named by its design; wrong ones before anything runs."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from fem_spa.errors import InputError
from fem_spa.sweep.cases import Plan, _absolute_laws, make_plan


def plan(deck: Path, *vary: str, sample: str | None = None, seed: int = 0, set: tuple[str, ...] = ()) -> Plan:
    return make_plan(deck, vary, sample, seed, set, None)


def texts(found: Plan) -> list[tuple[str, ...]]:
    return [tuple(value.text for value in case.values) for case in found.cases]


def test_the_grid_is_every_combination_with_its_deck(deck: Path) -> None:
    found = plan(
        deck, "geometry.end_wall=2mm:4mm:3", "loads.pressure=1kPa,2kPa", "materials.body.C10=1MPa,2MPa"
    )
    assert texts(found) == list(itertools.product("234", "12", "12"))
    assert len({case.name for case in found.cases}) == 12
    last = found.cases[-1].deck
    assert last is not None and last.geometry.parameters["end_wall"] == "4 mm"
    assert last.loads.pressure[""].si == 2e3 and last.materials["body"].parameters["C10"] == "2 MPa"


def test_a_mesh_belongs_to_the_geometry_alone(deck: Path) -> None:
    found = plan(
        deck, "geometry.end_wall=2mm:4mm:3", "loads.pressure=1kPa,2kPa", "materials.body.C10=1MPa,2MPa"
    )
    meshes = {
        case.values[0].text: {c.mesh for c in found.cases if c.values[0] == case.values[0]}
        for case in found.cases
    }
    assert all(len(keys) == 1 for keys in meshes.values())
    assert len(set.union(*meshes.values())) == 3


def test_a_name_is_that_of_the_design_however_it_is_written(deck: Path) -> None:
    """Defaults written out, other units and another order of the keys are the same design."""
    one = plan(deck, "geometry.end_wall=3mm,4mm", "loads.pressure=4kPa,5kPa")
    other = plan(
        deck, "loads.pressure=0.04bar,5000Pa", "geometry.end_wall=0.3cm,0.4cm", set=("observe.blocked=false",)
    )
    assert {case.name for case in one.cases} == {case.name for case in other.cases}
    assert {case.name for case in plan(deck, "loads.points=2,3").cases}.isdisjoint(
        {c.name for c in one.cases}
    )


def test_a_card_counts_by_its_numbers(deck: Path, tmp_path: Path) -> None:
    from materials.card import FOLDER

    text = (FOLDER / "dragon-skin-30.toml").read_text(encoding="utf-8")
    drop = ("materials.body={ card = 'own.toml' }",)
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    first = plan(deck, "loads.pressure=1kPa,2kPa", set=drop).cases[0].name
    assert (
        plan(deck, "loads.pressure=1kPa,2kPa", set=("materials.body={ card = 'dragon-skin-30' }",))
        .cases[0]
        .name
        == first
    )
    (tmp_path / "own.toml").write_text(
        text.replace("value = 1", "value = 2", 1).replace("value = 0.1", "value = 0.2", 1)
    )
    assert plan(deck, "loads.pressure=1kPa,2kPa", set=drop).cases[0].name != first


def test_a_case_is_found_from_any_folder(deck: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker of a cluster stands elsewhere: files beside the deck, and laws, have their whole path."""
    monkeypatch.chdir(tmp_path)
    found = plan(Path("tube.toml"), "loads.pressure=1kPa,2kPa").cases[0].deck
    assert found is not None and found.folder == tmp_path.resolve()
    tables = {"materials": {"body": {"law": "own.py"}, "soft": {"law": "yeoh"}}}
    _absolute_laws(tables)
    assert tables["materials"] == {
        "body": {"law": str(tmp_path.resolve() / "own.py")},
        "soft": {"law": "yeoh"},
    }


def test_twins_are_run_once(deck: Path) -> None:
    found = plan(deck, "loads.pressure=1kPa,1000 Pa,2kPa")
    assert texts(found) == [("1",), ("2",)] and found.twins == 1


def test_sobol_points_are_even_and_a_longer_call_begins_with_the_shorter(deck: Path) -> None:
    vary = ("geometry.end_wall=2mm:4mm", "loads.pressure=1kPa:9kPa:3")
    few, many = (plan(deck, *vary, sample=f"sobol:{n}", seed=3) for n in (8, 16))
    assert texts(many)[:8] == texts(few)
    shares = np.array([[(float(w) - 2) / 2, (float(p) - 1) / 8] for w, p in texts(many)])
    assert ((shares >= 0) & (shares < 1)).all()
    for column in shares.T:  # one in each sixteenth of either range: no random draw does that
        assert sorted(np.floor(16 * column)) == list(range(16))
    assert texts(plan(deck, *vary, sample="sobol:8", seed=4)) != texts(few)


def test_sizes_that_do_not_go_together_are_a_row_with_the_reason(deck: Path) -> None:
    found = plan(deck, "geometry.inner_radius=5mm:20mm:2", "loads.pressure=1kPa,2kPa")
    refused = [case for case in found.cases if case.refused]
    assert {case.values[0].text for case in refused} == {"20"} and len(refused) == 2
    assert "inner_radius = 20 mm" in refused[0].refused
    assert len({case.name for case in found.cases}) == 4


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        (["geometry.wal=1mm:2mm:3"], "given geometry.wal: there is no such key; did you mean 'end_wall'"),
        (["loads.presure=1kPa,2kPa"], "loads.presure: there is no such key"),
        (["loads.pressure.x=1kPa,2kPa"], "loads.pressure is not a table"),
        (["materials.bdy.C10=1MPa,2MPa"], "materials.bdy needs either card or law"),
        (["materials.body.C20=1MPa,2MPa"], "materials.body.C20: there is no such key"),
        (["geometry.end_wall=1kPa:2kPa:3"], "for geometry.end_wall: a length is needed"),
        (["loads.pressure=1mm,2mm"], "for loads.pressure: a pressure or modulus is needed"),
        (["geometry.end_wall=1:2:3"], "for geometry.end_wall: a unit is missing"),
        (["geometry.end_wall=1mm:5m:3"], "0.01 mm to 500 mm is allowed"),
        (["geometry.share=1:2:3"], "given 1.5 for geometry.share"),
        (["loads.pressure=1kPa,2kPa", "loads.pressure=3kPa,4kPa"], "loads.pressure twice"),
        (["loads.pressure=1kPa,2kPa", "loads.pressure.x=3kPa,4kPa"], "one would replace the other"),
        (
            ["geometry.end_wall=1mm:2mm:200", "loads.pressure=1kPa:2kPa:51"],
            "200 x 51 = 10200 cases: at most 10000",
        ),
        ([], "given no --vary"),
    ],
)
def test_a_wrong_key_or_value_is_refused_before_anything_is_run(
    deck: Path, vary: list[str], words: str
) -> None:
    with pytest.raises(ValueError, match=words) as caught:
        plan(deck, *vary)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "sample", ["sobol", "sobol:1", "sobol:-4", "sobol:99999999999", "halton:8", "sobol:1e3"]
)
def test_a_wrong_sample_is_one_line(deck: Path, sample: str) -> None:
    with pytest.raises(InputError, match="for --sample: write sobol:N"):
        plan(deck, "loads.pressure=1kPa:2kPa", sample=sample)


def test_names_are_held_against_a_mesh_file(deck: Path, tmp_path: Path) -> None:
    from fem_spa.deck import read_deck
    from fem_spa.prepare import make_mesh
    from geometry.files import write_mesh

    write_mesh(make_mesh(read_deck(deck)), tmp_path / "own.msh", "mm")
    text = deck.read_text(encoding="utf-8")
    body = text[text.index("[materials.body]") :].replace(
        'pressure = "4 kPa"', 'pressure = { main = "4 kPa" }'
    )
    own = tmp_path / "own.toml"
    own.write_text(f'[geometry]\nfile = "own.msh"\nunit = "mm"\n{body}', encoding="utf-8")
    with pytest.raises(InputError, match=r"loads.pressure.wind: the mesh has no cavity 'wind'"):
        plan(own, "loads.pressure.wind=1kPa,2kPa")
