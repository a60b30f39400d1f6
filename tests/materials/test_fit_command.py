"""`fem-spa fit` as a user runs it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from material_samples import NEEDS_DATA, csv, data_folder

from fem_spa.cli import main
from materials.card import load_card

L = np.linspace(1.0, 2.5, 41)
P = 0.2 * (L - L**-2) * (1 + 0.1 * (L**2 + 2 / L - 3))


def run(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str, str]:
    status = main([str(w) for w in words])
    out, err = capsys.readouterr()
    return status, out, err


def test_card_page_and_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    test = csv(tmp_path / "rubber.csv", {"stretch": L, "nominal stress [MPa]": P})
    card = tmp_path / "out" / "rubber.toml"
    status, out, _ = run(
        capsys, "fit", test, "--law", "yeoh", "neo-hooke", "--out", card, "--density", "1.1 g/cm^3"
    )
    assert status == 0
    assert "* yeoh-2" in out and "yeoh-3" in out and "neo-hooke" in out
    loaded = load_card(card)
    assert dict(loaded.parameters) == pytest.approx({"C10": 1e5, "C20": 5e3, "C30": 0.0}, rel=1e-5, abs=1e-6)
    assert loaded.density == pytest.approx(1100)
    assert loaded.stretch_range == pytest.approx((1.0, 2.5))
    assert loaded.stable is True
    assert "rubber.csv sha256 " in loaded.source
    assert loaded.intervals["C10"][0] <= 1e5 <= loaded.intervals["C10"][1]
    page = card.with_suffix(".html").read_text()
    assert "data:image/png;base64," in page and "http" not in page.split("base64,")[0]
    assert sorted(p.name for p in card.parent.iterdir()) == ["rubber.html", "rubber.png", "rubber.toml"]


def test_default_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    csv(tmp_path / "My Rubber.csv", {"stretch": L, "nominal stress [MPa]": P})
    assert run(capsys, "fit", "My Rubber.csv", "--law", "neo-hooke")[0] == 0
    assert (tmp_path / "out" / "my-rubber.toml").is_file()


def test_inelastic_tests_go_into_the_card(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pull = csv(tmp_path / "pull.csv", {"stretch": L, "nominal stress [MPa]": P})
    t = np.concatenate([[0.0], np.geomspace(0.1, 500, 80)])
    relax = csv(
        tmp_path / "relax.csv",
        {"time [s]": t, "stretch": 0 * t + 1.5, "nominal stress [MPa]": 0.1 * (0.8 + 0.2 * np.exp(-t / 20))},
        "# test: relaxation\n",
    )
    card = tmp_path / "o" / "c.toml"
    status, out, _ = run(capsys, "fit", pull, relax, "--law", "yeoh-2", "--out", card)
    assert status == 0
    assert "Prony (relax.csv): g 0.200 at 20 s" in out
    (term,) = load_card(card).inelastic["prony"]
    assert term["g"] == pytest.approx(0.2, rel=1e-5)
    assert float(term["tau"].split()[0]) == pytest.approx(20, rel=1e-5)


def test_unstable_law_is_named_on_the_terminal(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    l = np.linspace(1.0, 2.2, 40)
    test = csv(
        tmp_path / "t.csv", {"stretch": l, "nominal stress [MPa]": 2 * (l - l**-2) * (0.15 - 0.04 / l)}
    )
    card = tmp_path / "o" / "c.toml"
    status, out, _ = run(capsys, "fit", test, "--law", "mooney-rivlin", "--out", card)
    assert status == 0
    assert "UNSTABLE in equibiaxial above stretch" in out
    loaded = load_card(card)
    assert loaded.stable is False
    assert loaded.stable_ranges["equibiaxial"][1] < 1.6
    status, out, _ = run(capsys, "fit", test, "--law", "mooney-rivlin", "--stable", "--out", card)
    assert status == 0 and "UNSTABLE" not in out and load_card(card).stable is True


@pytest.mark.parametrize(
    "words, said",
    [
        (["nowhere.csv"], "is not here"),
        (["a.csv", "--law", "yeho"], 'did you mean "yeoh"'),
        (["a.csv", "--weights", "relativ"], 'did you mean "relative"'),
        (["a.csv", "--range", "3:1"], "two stretches around 1"),
        (["a.csv", "--range", "1:1.01"], "fewer than 5 rows"),
        (["a.csv", "--density", "3"], "without a unit"),
        (["a.csv", "--toe", "maybe"], "is not known"),
        (["a.csv", "./a.csv"], "give each test once"),
        (["a.csv", "--law", "neo-hooke", "--out", "a.csv"], "cannot be written"),
        (["--law", "yeoh"], "given no test"),
    ],
)
def test_wrong_calls_write_nothing(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    csv(tmp_path / "a.csv", {"stretch": L, "nominal stress [MPa]": P})
    status, out, err = run(capsys, "fit", *words)
    assert status == 2 and out == ""
    assert said in err and err.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv"]


@pytest.mark.parametrize("room", [0, 1, 2])
def test_a_full_disk_leaves_no_part_of_a_file(
    tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch, full_disk: Any, room: int
) -> None:
    """Card, picture and page are those of the fit before or of this one, to the last byte."""
    test = csv(tmp_path / "a.csv", {"stretch": L, "nominal stress [MPa]": P})
    out, kept = tmp_path / "out", {}
    call = ["fit", test, "--name", "a", "--out", out / "a.toml", "--law"]
    for law in ("yeoh", "neo-hooke"):
        assert run(capsys, *call, law)[0] == 0
        kept[law] = {path.name: path.read_bytes() for path in out.iterdir()}
    full_disk(monkeypatch, room)
    status, _, err = run(capsys, *call, "yeoh")
    assert status == 2 and "No space left" in err and err.count("\n") == 1
    now = {path.name: path.read_bytes() for path in out.iterdir()}
    assert now.keys() == kept["yeoh"].keys()
    assert sum(now[name] == kept["yeoh"][name] for name in now) == room
    assert all(now[name] in (kept["yeoh"][name], kept["neo-hooke"][name]) for name in now)


@NEEDS_DATA
@pytest.mark.slow
def test_all_nineteen_silicones_in_one_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(
        capsys,
        "fit",
        "silicone_tensile_marechal",
        "--data",
        data_folder(),
        "--each",
        "--out",
        tmp_path / "all",
    )
    assert status == 0
    cards = sorted((tmp_path / "all").glob("*.toml"))
    assert len(cards) == 19
    assert all(load_card(c).fit["r2"] > 0.995 and load_card(c).stable for c in cards)
    assert "dragon-skin-30" in out and "stable uniaxial" in out
