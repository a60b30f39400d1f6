"""Test files: what is read, what is refused in one line, what is noticed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from material_samples import NEEDS_DATA, csv, data_folder

from materials.errors import MaterialError
from materials.job import Options, prepare
from materials.reading import read_test
from materials.rest import find_preload, find_toe
from materials.specimen import first_loading, mean_curve, noise, outliers, thin

L = np.linspace(1.0, 2.0, 21)
P = 0.2 * (L - L**-2)  # MPa


def test_stretch_strain_and_units(tmp_path: Path) -> None:
    files = [
        csv(tmp_path / "a.csv", {"stretch": L, "nominal stress [MPa]": P}),
        csv(tmp_path / "b.csv", {"strain [%]": (L - 1) * 100, "nominal stress [kPa]": P * 1e3}),
        csv(tmp_path / "c.csv", {"true strain": np.log(L), "true stress [N/mm^2]": P * L}),
        csv(
            tmp_path / "d.csv",
            {"time [s]": L, "force [N]": P * 24, "displacement [mm]": (L - 1) * 25},
            "# area: 24 mm^2\n# gauge length: 2.5 cm\n",
        ),
        csv(tmp_path / "e.csv", {"Engineering Strain": L - 1, "Engineering Stress (MPa)": P}),
        csv(tmp_path / "f.csv", {"time_s": L, "stretch": L, "nominal_stress_kPa": P * 1e3}),
    ]
    for file in files:
        (s,) = read_test(file)
        assert np.allclose(s.stretch, L, atol=1e-7), file.name
        assert np.allclose(s.stress, P * 1e6, atol=1.0), file.name
        assert (s.mode, s.kind, len(s.sha256)) == ("uniaxial", "pull", 64)


def test_semicolons_decimal_commas_and_a_preamble(tmp_path: Path) -> None:
    rows = "\n".join(f"{l:.6f};{p:.6f}".replace(".", ",") for l, p in zip(L, P, strict=True))
    path = tmp_path / "machine.csv"
    path.write_text(
        f"Specimen Width (mm);6;\nLoad Cell;1 kN\n\nstretch;nominal stress [MPa]\n{rows}\n",
        encoding="latin-1",
    )
    (s,) = read_test(path)
    assert np.allclose(s.stress, P * 1e6, atol=1.0)
    assert s.rows is not None and s.rows[0] == 5


def test_mode_and_several_specimens(tmp_path: Path) -> None:
    names = ["a"] * 21 + ["b"] * 21
    path = csv(
        tmp_path / "two.csv",
        {"specimen": names, "stretch": np.tile(L, 2), "nominal stress [MPa]": np.concatenate([P, 1.1 * P])},
        "# mode: pure shear\n",
    )
    first, second = read_test(path)
    assert first.mode == second.mode == "planar"
    mean = mean_curve([first, second])
    assert mean is not None
    assert np.allclose(mean.stress, np.interp(mean.stretch, L, 1.05e6 * P))
    assert np.allclose(mean.spread, np.interp(mean.stretch, L, 0.1e6 * P) / np.sqrt(2))


def wrong(tmp_path: Path, columns: dict[str, object], head: str = "") -> str:
    path = csv(tmp_path / "bad.csv", columns, head)
    with pytest.raises(MaterialError) as caught:
        read_test(path)
    assert "\n" not in str(caught.value)
    assert "bad.csv" in str(caught.value)
    return str(caught.value)


T = np.arange(21.0)
BACK = np.where(T == 10, 3.0, T)
M = np.linspace(0.5, 1.5, 21)
SMALL = np.linspace(1.0, 1.15, 21)


@pytest.mark.parametrize(
    "columns, head, words",
    [
        ({"stretch": L, "nominal stress": P}, "", "has no unit"),
        ({"stretch": L, "stress [MPa]": P}, "", "may be nominal or true"),
        ({"stretch": L, "nominal stress [mm]": P}, "", "is a length"),
        ({"stretch": L, "nominal stres [MPa]": P}, "", "no column of stress"),
        ({"strain": (L - 1) * 100, "nominal stress [MPa]": P}, "", "strain [%]"),
        ({"strain": (L - 1) * 15, "nominal stress [MPa]": 0.2 * (SMALL - SMALL**-2)}, "", "strain [%]"),
        (
            {"stretch": M, "nominal stress [MPa]": np.abs(0.2 * (M - M**-2))},
            "",
            "compression and tension mixed",
        ),
        ({"stretch": L, "nominal stress [MPa]": -P}, "", "compressive stress at a tensile strain"),
        ({"time [s]": BACK, "stretch": L, "nominal stress [MPa]": P}, "", "time goes back at line 12"),
        ({"stretch": L, "nominal stress [MPa]": np.where(T == 4, np.nan, P)}, "", "line 6"),
        ({"stretch": L, "nominal stress [MPa]": np.where(T == 4, 1e200, P)}, "", "line 6"),
        ({"stretch": L, "nominal stress [MPa]": ["x"] * 21}, "", "is not a number"),
        ({"stretch": L[:2], "nominal stress [MPa]": P[:2]}, "", "2 rows"),
        ({"stretch": P + 0.01, "nominal stress [MPa]": L}, "", "a time or a strain"),
        ({"strain": L, "nominal stress [MPa]": P}, "", "is the strain a stretch"),
        ({"stretch": L, "nominal stress [MPa]": T}, "", "is that column a time"),
        (
            {"stretch": [1.0, 1.1, 1.1, 1.1, 1.1], "nominal stress [MPa]": P[:5]},
            "",
            "only 2 different stretches",
        ),
        ({"strain": P, "nominal stress [MPa]": L - 1}, "", "the stress in another one"),
        ({"stretch": L, "nominal stress [MPa]": 0 * L + 1}, "", "all along"),
        ({"stretch": L, "nominal stress [MPa]": P, "true stress [MPa]": P / L}, "", "wrong place"),
        ({"stretch": L, "nominal stress [Pa]": P}, "", "unit of stress"),
        ({"displacement [mm]": L - 1, "force [N]": P}, "", "gauge length"),
        ({"displacement [mm]": L - 1, "force [N]": P}, "# gauge length: 25 mm\n", "rest area"),
        (
            {"displacement [mm]": L - 1, "force [N]": P},
            "# gage length: 25 mm\n",
            'did you mean "gauge length"',
        ),
        ({"stretch": L, "nominal stress [MPa]": P}, "# mode: uniaxal\n", 'did you mean "uniaxial"'),
        ({"stretch": L, "nominal stress [MPa]": P}, "# test: relaxtion\n", 'did you mean "relaxation"'),
        ({"stretch": L, "nominal stress [MPa]": P}, "# test: relaxation\n", "needs a column `time [s]`"),
    ],
)
def test_bad_tests_get_one_line(tmp_path: Path, columns: dict[str, object], head: str, words: str) -> None:
    assert words in wrong(tmp_path, columns, head)


def test_empty_and_headless_files(tmp_path: Path) -> None:
    for text, words in (
        ("", "is empty"),
        ("1,2\n3,4\n", "no header line"),
        ("stretch,nominal stress [MPa]\n", "0 rows"),
    ):
        path = tmp_path / "bad.csv"
        path.write_text(text)
        with pytest.raises(MaterialError, match=words):
            read_test(path)
    with pytest.raises(MaterialError, match="cannot be read"):
        read_test(tmp_path / "nowhere.csv")


def test_time_out_of_order_may_be_waved_through(tmp_path: Path) -> None:
    path = csv(tmp_path / "a.csv", {"time [s]": BACK, "stretch": L, "nominal stress [MPa]": P})
    (s,) = read_test(path, ignore_time=True)
    assert s.time is None


def test_outliers_are_named_and_kept_unless_asked(tmp_path: Path) -> None:
    spoilt = P.copy()
    spoilt[7] *= 1.5
    (s,) = read_test(csv(tmp_path / "a.csv", {"stretch": L, "nominal stress [MPa]": spoilt}))
    assert outliers(s).tolist() == [7]
    kept, said = prepare(s, Options())
    assert kept is not None and kept.stretch.size == 21
    assert any("outliers at line 9:" in note and "kept" in note for note in said)
    dropped, said = prepare(s, Options(drop_outliers=True))
    assert dropped is not None and dropped.stretch.size == 20
    assert any("left out" in note for note in said)


@pytest.mark.parametrize("row", [5, 8, 14])
def test_an_outlier_is_no_rupture(tmp_path: Path, row: int) -> None:
    spoilt = P.copy()
    spoilt[row] *= 4.0
    (s,) = read_test(csv(tmp_path / "a.csv", {"stretch": L, "nominal stress [MPa]": spoilt}))
    assert s.stretch.size == 21
    assert row in outliers(s)


def test_a_few_per_cent_without_unit_are_said(tmp_path: Path) -> None:
    """15 % of a stiffer rubber: it might be 1500 % of a gel."""
    stress = 2.0 * (SMALL - SMALL**-2)
    (s,) = read_test(csv(tmp_path / "a.csv", {"strain": (L - 1) * 15, "nominal stress [MPa]": stress}))
    assert "`strain [%]`" in s.notes[0]
    columns: dict[str, object] = {"strain [1]": (L - 1) * 15, "nominal stress [MPa]": stress}
    assert read_test(csv(tmp_path / "b.csv", columns))[0].notes == ()


def test_clean_curves_have_no_outliers() -> None:
    rng = np.random.default_rng(0)
    from materials.specimen import Specimen

    for k in range(20):
        l = np.sort(rng.uniform(1.0, 4.0, 60))
        p = 1e5 * (l - l**-2) * (1 + 0.05 * l**2) + 500 * rng.standard_normal(60)
        assert outliers(Specimen("x", "uniaxial", "pull", l, p)).size == 0, k


def test_rupture_is_cut_and_said(tmp_path: Path) -> None:
    broken = np.concatenate([P, [0.01, 0.0]])
    (s,) = read_test(
        csv(
            tmp_path / "a.csv", {"stretch": np.concatenate([L, [2.01, 2.02]]), "nominal stress [MPa]": broken}
        )
    )
    assert s.stretch.max() == 2.0
    assert "ruptured at stretch 2" in s.notes[0]


def test_first_loading_is_taken_out_of_a_cyclic_test(tmp_path: Path) -> None:
    up1, down1, up2 = np.linspace(1, 1.5, 20), np.linspace(1.48, 1.02, 15), np.linspace(1.05, 2.0, 30)
    l = np.concatenate([up1, down1, up2])
    soft = np.concatenate([np.ones(20), 0.7 * np.ones(15), np.where(up2 > 1.5, 1.0, 0.75)])
    (s,) = read_test(
        csv(
            tmp_path / "a.csv",
            {"time [s]": np.arange(65.0), "stretch": l, "nominal stress [MPa]": soft * 0.2 * (l - l**-2)},
        )
    )
    assert s.kind == "cyclic"
    first = first_loading(s)
    assert np.all(np.diff(first.stretch) > 0)
    assert np.allclose(first.stress, 2e5 * (first.stretch - first.stretch**-2), atol=1.0)
    assert "others are not" in first.notes[-1]


def test_toe_moves_the_rest_length_back(tmp_path: Path) -> None:
    """1 mm of slack on 25 mm: the toe-corrected rows lie on the true curve again."""
    x = np.linspace(0, 26, 400)
    slack = 1.0
    taut = np.maximum(x - slack, 0.0)
    l = 1 + taut / 25
    settle = np.clip((x - 0.2 * slack) / (1.6 * slack), 0, 1)
    force = 24 * 0.2 * (l - l**-2) * settle
    path = csv(
        tmp_path / "a.csv",
        {"displacement [mm]": x, "force [N]": force},
        "# area: 24 mm^2\n# gauge length: 25 mm\n",
    )
    (s,) = read_test(path)
    toe = find_toe(s)
    assert toe is not None
    assert toe.rest == pytest.approx(1.04, abs=0.01)
    ready, said = prepare(s, Options())
    assert ready is not None and any("toe up to stretch" in note for note in said)
    raw, _ = prepare(s, Options(toe="off"))
    assert raw is not None

    def off(t: object) -> float:
        stretch, stress = t.stretch, t.stress  # type: ignore[attr-defined]
        return float(np.sqrt(np.mean((stress - 2e5 * (stretch - stretch**-2)) ** 2)))

    assert off(ready) < 0.35 * off(raw)


def test_preload_is_counted_in(tmp_path: Path) -> None:
    """Clamped at 4 % stretch, force and displacement set to zero there: `# preload` makes the curve whole."""
    l0 = 1.04
    length = 25.0  # mm, between the grips when the test starts
    x = np.linspace(0, 25, 300)
    l = l0 * (1 + x / length)
    force = 24 * 0.2 * (l - l**-2)
    head = "# area: 24 mm^2\n# gauge length: 25 mm\n"
    columns = {"displacement [mm]": x, "force [N]": force - force[0]}
    path = csv(tmp_path / "a.csv", columns, f"{head}# preload: {force[0]:.9f} N\n")
    (s,) = read_test(path)
    assert find_preload(s) == pytest.approx(l0, abs=0.004)
    ready, said = prepare(s, Options())
    assert ready is not None and any("pre-load" in note for note in said)
    assert np.allclose(
        ready.stress, 2e5 * (ready.stretch - ready.stretch**-2), atol=0.02 * ready.stress.max()
    )
    (tared,) = read_test(csv(tmp_path / "b.csv", columns, head))
    assert find_preload(tared) is None


def test_a_rubber_without_toe_has_none(tmp_path: Path) -> None:
    fine = np.linspace(1, 2, 200)
    (s,) = read_test(
        csv(tmp_path / "a.csv", {"stretch": fine, "nominal stress [MPa]": 0.2 * (fine - fine**-2)})
    )
    assert find_toe(s) is None
    assert find_preload(s) is None


def test_noise_is_measured_and_thinning_keeps_the_ends(tmp_path: Path) -> None:
    fine = np.linspace(1, 3, 2000)
    p = 0.2 * (fine - fine**-2) + 2e-3 * np.random.default_rng(0).standard_normal(2000)
    (s,) = read_test(csv(tmp_path / "a.csv", {"stretch": fine, "nominal stress [MPa]": p}))
    assert noise(s) == pytest.approx(2e3, rel=0.1)
    few = thin(s)
    assert few.stretch.size <= 200
    assert (few.stretch[0], few.stretch[-1]) == (1.0, 3.0)


@NEEDS_DATA
def test_every_file_of_the_tensile_and_compression_sets_is_read() -> None:
    folder = data_folder()
    assert folder is not None
    files = sorted((folder / "silicone_tensile_marechal").glob("*.csv"))
    assert len(files) == 19
    for file in files:
        (s,) = read_test(file)
        assert s.kind == "pull" and s.stretch.min() >= 1.0 and s.stretch.max() > 2.5
    files = sorted((folder / "ecoflex_compression_qmul").glob("*/*.csv"))
    assert len(files) == 30
    for file in files:
        (s,) = read_test(file)
        assert 0.3 < s.stretch.min() < 0.4 and s.stress.min() < 0
