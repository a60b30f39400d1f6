"""The law of a chamber from a table: monotone, with its derivative, superposed; and back to the paper's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fem_spa.errors import InputError
from fem_spa.reduced.registry import model_text, read_model
from fem_spa.reduced.rod import Rod, arm
from fem_spa.reduced.rod_law import RodLaw, from_loads, read_law

P = np.array([0.0, 0.5e5, 1e5, 2e5, 3e5])
LAW = RodLaw(P, np.array([0.0, 0.2, 3.0, 3.1, 6.0]), np.array([0, 0.05, 0.08, 0.2, 0.21]), source="test")


def test_between_rows_it_is_monotone_and_its_derivative_is_right() -> None:
    p = np.linspace(-0.5e5, 4e5, 901)
    for value in LAW.at(p):
        assert np.all(np.diff(value) >= 0)
    h = 1.0
    for ahead, behind, slope in zip(LAW.at(p + h), LAW.at(p - h), LAW.slope(p), strict=True):
        assert (ahead - behind) / (2 * h) == pytest.approx(slope, rel=2e-3, abs=1e-10)
    assert LAW.at(P)[0] == pytest.approx(LAW.curvature, abs=1e-12)


def test_the_papers_law_as_a_table_gives_the_papers_rod() -> None:
    """(24)-(26) are linear: two rows of a single chamber, alone, bring back every combination."""
    plain = arm().switched(strain_gains=False)
    strain = plain.strains(np.array([[1e5, 0, 0]]))[0]
    law = RodLaw(np.array([0, 1e5]), np.array([0, strain[1]]), np.array([0, strain[0]]))
    p = np.array([[0.3e5, 2e5, 1e5], [3e5, 0, 3e5]])
    ours = Rod(plain.parameters, strain_gains=False, law=law)
    assert ours.settled(p) == pytest.approx(plain.settled(p), abs=1e-10)


def test_loads_and_stiffness_replace_the_sections() -> None:
    """A law by moment and force: curvature times stiffness is the moment; the rod takes its stiffness."""
    law = from_loads(P, 0.01 * P / 1e5, 2 * P / 1e5, 0.05, 150.0)
    assert law.at(np.array(2e5))[0] * 0.05 == pytest.approx(0.02)
    model = Rod(arm().parameters, law=law)
    assert model.discrete().bending[0] == pytest.approx(0.05)
    assert model.discrete().axial[2] == pytest.approx(150.0)
    assert model.discrete().axial[0] == pytest.approx(50.0)


def test_files_and_tables_read_back(tmp_path: Path) -> None:
    (tmp_path / "law.csv").write_text(
        "# bending stiffness: 0.05 N*m^2\n# source: segment.toml\n"
        "pressure [kPa],curvature [1/m],stretch\n0,0,0\n100,3,0.08\n200,5,0.2\n"
    )
    law = read_law("law.csv", tmp_path)
    assert law.pressure[1] == 1e5 and law.bending_stiffness == 0.05 and law.source == "segment.toml"
    model = read_model({"kind": "rod", "preset": "am-i-support", "law": "law.csv"}, tmp_path)
    text = model_text(model)
    (tmp_path / "model.toml").write_text(text)
    assert model_text(read_model(tmp_path / "model.toml")) == text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("pressure [kPa],curvature [1/m]\n0,0\n1,1\n", "stretch"),
        ("pressure [kPa],curvature [1/m],stretch\n1,0,0\n0,1,0\n", "increase"),
        ("pressure [kPa],curvature [1/m],stretch\n0,0,0\n", "at least two"),
        ("pressure [mm],curvature [1/m],stretch\n0,0,0\n1,1,0\n", "kPa"),
        ("pressure [kPa],curvature [1/m],stretch\n0,0,0\n1,1,x\n", "not a number"),
    ],
)
def test_a_wrong_file_is_one_line(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "law.csv").write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        read_law("law.csv", tmp_path)
    assert "\n" not in str(caught.value)
