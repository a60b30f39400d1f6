"""Known parameters come back; intervals cover them; what cannot be told is named."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import treloar
from material_samples import SAMPLES, specimen

from materials.errors import MaterialError
from materials.fitting import Variant, collect, fit, predict, variants
from materials.intervals import uncertainty
from materials.ranking import asked_ranges, cross_validate, folds, rank
from materials.response import MODES, nominal_stress
from materials.specimen import Specimen
from materials.stability import scan
from materials.stable_fit import fit_stable

KNOWN: dict[str, dict[str, float]] = {
    **SAMPLES,
    "yeoh-2": {"C10": 1.1e5, "C20": 2e4},
    "yeoh-3": {"C10": 1.1e5, "C20": -1e3, "C30": 50.0},
    "ogden-1": {"mu1": 1.5e5, "alpha1": 2.7},
    "ogden-2": {"mu1": 3e5, "alpha1": 1.4, "mu2": -2e4, "alpha2": -3.0},
    "ogden-3": SAMPLES["ogden"],
}
ALL = variants([v.name for v in variants()] + ["linear"])
RANGES: dict[str, tuple[float, float]] = {
    "uniaxial": (0.7, 4.0),
    "equibiaxial": (0.7, 2.6),
    "planar": (0.7, 3.5),
}
TRELOAR_RANGES = {s.mode: (float(s.stretch.min()), float(s.stretch.max())) for s in treloar.specimens()}
"""Over these Ogden's own six constants of 1972 can be told apart; they are the sample of ogden-3."""


def truth(variant: Variant) -> dict[str, float]:
    return KNOWN[variant.name]


def three_modes(
    variant: Variant,
    noise: float = 0.0,
    seed: int = 0,
    rows: int = 30,
    ranges: dict[str, tuple[float, float]] = RANGES,
) -> list[Specimen]:
    return [
        specimen(variant.law.name, truth(variant), mode, *ranges[mode], rows, noise, 10 * seed + k)
        for k, mode in enumerate(MODES)
    ]


def pairs(variant: Variant, values: dict[str, float]) -> np.ndarray:
    """Free parameters in one order: Ogden's terms by their exponent."""
    v = np.array([values[k] for k in variant.free])
    if variant.law.name == "ogden":
        v = v.reshape(-1, 2)[np.argsort(v.reshape(-1, 2)[:, 1])].ravel()
    return v


@pytest.mark.parametrize("variant", ALL, ids=lambda v: v.name)
def test_known_parameters_come_back_to_1e_6(variant: Variant) -> None:
    found = fit(variant, collect(three_modes(variant)))
    assert pairs(variant, found.parameters) == pytest.approx(pairs(variant, truth(variant)), rel=1e-6)
    assert found.r2 == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("weights", ["absolute", "relative", "noise"])
@pytest.mark.parametrize("name", ["mooney-rivlin", "gent"])
def test_weights_do_not_move_an_exact_fit(name: str, weights: str) -> None:
    (variant,) = variants([name])
    found = fit(variant, collect(three_modes(variant), weights))
    assert pairs(variant, found.parameters) == pytest.approx(pairs(variant, truth(variant)), rel=1e-6)


def test_relative_weights_follow_the_small_stresses() -> None:
    """A law that cannot be right all over: with relative weights its start is closer."""
    s = specimen("yeoh", {"C10": 1e5, "C20": 3e3}, "uniaxial", 1.02, 4.0)
    (neo,) = variants(["neo-hooke"])
    at = {w: np.abs(fit(neo, collect([s], w)).values[0] - 1e5) for w in ("absolute", "relative")}
    assert at["relative"] < 0.6 * at["absolute"]


def test_rows_outside_the_law_are_not_silently_used() -> None:
    """Gent must reach past every row: Jm stays above the greatest I1 - 3."""
    s = specimen("neo-hooke", {"C10": 1e5}, "uniaxial", 1.0, 5.0)
    (gent,) = variants(["gent"])
    data = collect([s])
    assert fit(gent, data).parameters["Jm"] > data.reach


def test_modulus_stays_positive_where_least_squares_would_not_have_it() -> None:
    """Stress that is nearly cubic in the strain: unbounded Yeoh would take C10 < 0."""
    l = np.linspace(1.0, 3.0, 40)
    (yeoh,) = variants(["yeoh-2"])
    s = Specimen("odd", "uniaxial", "pull", l, 1e4 * (l - 1) ** 4)
    found = fit(yeoh, collect([s]))
    assert found.parameters["C10"] > 0
    assert "C10" in found.at_bound


def test_fewer_rows_than_parameters_is_an_error() -> None:
    s = specimen("neo-hooke", {"C10": 1e5}, "uniaxial", 1.1, 2.0, rows=5)
    (variant,) = variants(["ogden-3"])
    with pytest.raises(MaterialError, match="6 parameters and the tests have 5 rows"):
        fit(variant, collect([s]))


def test_names_of_laws() -> None:
    assert [v.name for v in variants(["yeoh", "ogden-1"])] == ["yeoh-2", "yeoh-3", "ogden-1"]
    assert "linear" not in [v.name for v in variants()]
    with pytest.raises(MaterialError, match=r'did you mean "ogden'):
        variants(["ogdn-2"])


@pytest.mark.parametrize("name", ["neo-hooke", "mooney-rivlin", "yeoh-3", "gent", "ogden-1", "arruda-boyce"])
def test_with_noise_the_truth_is_within_four_half_widths(name: str) -> None:
    (variant,) = variants([name])
    specimens = three_modes(variant, noise=2e3, seed=3)
    data = collect(specimens)
    found = fit(variant, data)
    u = uncertainty(found, data)
    assert u.method == "profile"
    for key in variant.free:
        low, high = u.intervals[key]
        assert low < found.parameters[key] < high
        assert abs(truth(variant)[key] - found.parameters[key]) < 2.0 * (high - low)


def true_values(variant: Variant) -> dict[str, float]:
    """The truth, Ogden's terms in the fit's order: by their part of the modulus, largest first."""
    v = np.array([truth(variant)[k] for k in variant.free])
    if variant.law.name == "ogden":
        v = v.reshape(-1, 2)[np.argsort(-v[0::2] * v[1::2])].ravel()
    return dict(zip(variant.free, v.tolist(), strict=True))


def coverage(name: str, draws: int, rows: int = 20) -> dict[str, float]:
    (variant,) = variants([name])
    true = true_values(variant)
    ranges = TRELOAR_RANGES if name == "ogden-3" else RANGES
    hits = dict.fromkeys(variant.free, 0)
    for draw in range(draws):
        data = collect(three_modes(variant, noise=3e3, seed=draw, rows=rows, ranges=ranges))
        u = uncertainty(fit(variant, data), data)
        for key in variant.free:
            low, high = u.intervals[key]
            hits[key] += low <= true[key] <= high
    return {key: count / draws for key, count in hits.items()}


@pytest.mark.parametrize("name", ["mooney-rivlin", "yeoh-3", "linear"])
def test_intervals_cover_the_truth_500_draws_linear_laws(name: str) -> None:
    assert all(0.92 <= share <= 0.97 for share in coverage(name, 500).values())


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["neo-hooke", "yeoh-2", "gent", "ogden-1", "ogden-2", "ogden-3", "arruda-boyce", "extended-tube"]
)
def test_intervals_cover_the_truth_500_draws(name: str) -> None:
    assert all(0.92 <= share <= 0.97 for share in coverage(name, 500).values())


def test_bootstrap_over_specimens_covers_their_scatter() -> None:
    """Eight specimens whose moduli differ by 5 %: the mean's interval follows from their scatter."""
    (neo,) = variants(["neo-hooke"])
    hits, draws = 0, 60
    for draw in range(draws):
        rng = np.random.default_rng(draw)
        moduli = 1e5 * (1 + 0.05 * rng.standard_normal(8))
        own = [specimen("neo-hooke", {"C10": c}, "uniaxial", 1.0, 2.0, 12) for c in moduli]
        data = collect(own)
        u = uncertainty(fit(neo, data), data)
        assert u.method == "bootstrap over 8 specimens"
        low, high = u.intervals["C10"]
        hits += low <= 1e5 <= high
    assert 0.90 <= hits / draws <= 0.99


def test_correlated_residuals_widen_the_interval() -> None:
    """A law that misses the shape must not look certain to a part in a thousand."""
    s = specimen("yeoh", {"C10": 1e5, "C20": 5e3}, "uniaxial", 1.0, 3.0, 100)
    (neo,) = variants(["neo-hooke"])
    data = collect([s])
    assert uncertainty(fit(neo, data), data).widening > 3


def test_band_holds_the_true_curve() -> None:
    (variant,) = variants(["yeoh-2"])
    data = collect(three_modes(variant, noise=3e3, seed=5))
    found = fit(variant, data)
    band = uncertainty(found, data).band(found, data.stretches)
    true = predict(variant.law, variant.full(np.array(list(truth(variant).values()))), data.stretches)
    error = np.abs(predict(variant.law, found.parameters, data.stretches) - true)
    assert np.mean(error <= 1.5 * band) > 0.95
    assert np.median(band) < 3e3


def test_folds_are_modes_then_specimens_then_blocks() -> None:
    (variant,) = variants(["neo-hooke"])
    three = three_modes(variant)
    assert folds(collect(three))[0] == "one mode left out"
    assert folds(collect([three[0]] * 3))[0] == "one specimen left out"
    words, masks = folds(collect([three[0]]))
    assert "blocks" in words
    assert np.all(np.sum(masks, axis=0) == 1)


def test_held_out_error_finds_the_right_law_where_r2_does_not() -> None:
    """Neo-Hooke with noise: three more parameters always raise R2, and the held-out error says no."""
    s = specimen("neo-hooke", {"C10": 1e5}, "uniaxial", 1.0, 3.0, 25, noise=6e3, seed=2)
    data = collect([s])
    ranking = rank(variants(["neo-hooke", "yeoh", "ogden-2"]), data, details="none")
    assert ranking.recommended.name == "neo-hooke"
    assert max(ranking.rows, key=lambda r: r.fit.r2).name != "neo-hooke"


def test_mooney_rivlin_from_uniaxial_alone_names_the_test_that_is_missing() -> None:
    s = specimen("mooney-rivlin", {"C10": 1e5, "C01": 2e4}, "uniaxial", 1.0, 2.0, 40, noise=1e3, seed=1)
    row = rank(variants(["mooney-rivlin"]), collect([s])).rows[0]
    (warning,) = [w for w in row.warnings if "apart" in w]
    assert "C10" in warning and "C01" in warning
    assert "equibiaxial test would narrow" in warning
    both = [
        s,
        specimen("mooney-rivlin", {"C10": 1e5, "C01": 2e4}, "equibiaxial", 1.0, 1.6, 40, noise=1e3, seed=4),
    ]
    assert not [w for w in rank(variants(["mooney-rivlin"]), collect(both)).rows[0].warnings if "apart" in w]


def unstable_data() -> Specimen:
    """Tension that stiffens early, which Mooney-Rivlin can only follow with a negative C01."""
    l = np.linspace(1.0, 2.2, 40)
    return Specimen("tension", "uniaxial", "pull", l, 2 * (l - l**-2) * (1.5e5 - 4e4 / l))


def test_unstable_mooney_rivlin_that_looks_right_is_caught_and_named() -> None:
    s = unstable_data()
    ranking = rank(variants(["mooney-rivlin", "neo-hooke", "yeoh"]), collect([s]))
    row = next(r for r in ranking.rows if r.name == "mooney-rivlin")
    assert row.fit.r2 > 0.9999
    assert not row.stable
    (warning,) = [w for w in row.warnings if "UNSTABLE" in w]
    assert "equibiaxial above stretch" in warning
    assert "R2 = 1.0000" in warning
    assert ranking.recommended.name != "mooney-rivlin"


def test_fit_under_the_constraint_of_stability() -> None:
    data = collect([unstable_data()])
    (variant,) = variants(["mooney-rivlin"])
    free, asked = fit(variant, data), asked_ranges(data)
    held = fit_stable(free, data, asked)
    assert not scan(variant.law, free.parameters, asked)[0]
    assert scan(variant.law, held.parameters, asked)[0]
    assert free.cost < held.cost
    # It lies on the edge of stability: a part in a hundred towards the free fit is unstable again.
    between = {k: held.parameters[k] + 0.05 * (free.parameters[k] - held.parameters[k]) for k in variant.free}
    assert not scan(variant.law, between, asked)[0]


def test_under_the_constraint_what_is_held_out_is_told_under_it_too() -> None:
    data = collect([unstable_data()])
    errors = [rank(variants(["mooney-rivlin"]), data, only_stable=yes).rows[0].cv for yes in (False, True)]
    assert errors[1] > 1.5 * errors[0]


def test_cross_validation_is_infinite_where_a_fold_cannot_be_told() -> None:
    s = specimen("neo-hooke", {"C10": 1e5}, "uniaxial", 1.1, 2.0, rows=6)
    (variant,) = variants(["ogden-3"])
    data = collect([s])
    assert math.isinf(cross_validate(variant, data, fit(variant, data)))


def test_user_law_fits_like_the_built_in_one(tmp_path: Path) -> None:
    from materials.user_law import load_law

    path = tmp_path / "mine.py"
    path.write_text(
        "import numpy as np\nname = 'mine'\nparameters = {'mu': 'Pa', 'Jm': '1'}\n"
        "example = {'mu': 1e5, 'Jm': 40.0}\n"
        "limits = {'mu': (0.0, np.inf), 'Jm': (15.0, 1e3)}\n"
        "def energy(I1, I2, *, mu, Jm):\n    return -0.5 * mu * Jm * np.log(1 - (I1 - 3) / Jm)\n"
        "def derivatives(I1, I2, *, mu, Jm):\n    return 0.5 * mu / (1 - (I1 - 3) / Jm), 0 * I1\n"
    )
    mine = load_law(path)
    s = specimen("gent", {"mu": 2e5, "Jm": 30.0}, "uniaxial", 1.0, 3.5)
    (variant,) = variants(["mine"], {"mine": mine})
    assert fit(variant, collect([s])).parameters == pytest.approx({"mu": 2e5, "Jm": 30.0}, rel=1e-5)
    assert nominal_stress(mine, {"mu": 2e5, "Jm": 30.0}, "uniaxial", np.array([2.0]))[0] == pytest.approx(
        2e5 * 30 / (30 - 2.0) * 1.75
    )
