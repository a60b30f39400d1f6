"""Treloar's rubber, three modes at once: this program's fits beside FElupe's, and beside published ones.

Run: python benchmarks/fit_treloar.py        (FElupe: pip install felupe; without it its columns are empty)

Every law is fitted to the same 53 points with the same objective (absolute nominal stress). FElupe's
part: its own formulas, differentiated automatically, under scipy's least squares with numerical
derivatives, once from a common start and once from this program's answer, where its sum of squares must
be the same and a minimum too. (FElupe 11.3.0's own `optimize` cannot be called with all three modes of
different length: it pairs the planar curve with the biaxial data. Hence its `view`.)
"""

from __future__ import annotations

import importlib.metadata
import platform
import sys
import time
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[1] / "tests" / "materials")]

from treloar import OGDEN_1972, specimens  # noqa: E402

from materials.fitting import collect, fit, predict, variants  # noqa: E402
from materials.laws import LAWS  # noqa: E402
from materials.ranking import rank  # noqa: E402


def main() -> None:
    """Print the table."""
    print(
        f"Python {platform.python_version()}, {platform.machine()}, "
        + ", ".join(map(version, ("numpy", "scipy", "felupe")))
    )
    own = specimens()
    data = collect(own)
    print(f"\n{'law':15s} {'SSE [MPa^2]':>12s} {'R2':>9s} {'ms':>7s}   FElupe: own start, from ours")
    for variant in variants():
        start = time.perf_counter()
        found = fit(variant, data)
        spent = 1e3 * (time.perf_counter() - start)
        sse = found.rmse**2 * data.stress.size / 1e12
        other = felupe_sse(variant.name, found.parameters, own)
        print(f"{variant.name:15s} {sse:12.5f} {found.r2:9.5f} {spent:7.1f}   {other}")
    published = predict(LAWS["ogden"], OGDEN_1972, data.stretches) - data.stress
    print(f"\nOgden (1972), six parameters by hand, same points: SSE {np.sum(published**2) / 1e12:.5f} MPa^2")
    ranking = rank(variants(), data, details="none")
    print(f"Ranking, {ranking.scheme}: " + ", ".join(f"{r.name} {100 * r.cv:.1f} %" for r in ranking.rows))
    print(f"best sum of squares of ogden-3 in 300 random starts: {random_starts(300):.5f} MPa^2")


def version(name: str) -> str:
    """name and version, or that it is not there."""
    try:
        return f"{name} {importlib.metadata.version(name)}"
    except importlib.metadata.PackageNotFoundError:
        return f"no {name}"


def random_starts(count: int) -> float:
    """Least sum of squares of the three-term Ogden law from random starts, MPa^2."""
    data = collect(specimens())
    (ogden,) = variants(["ogden-3"])
    rng, best = np.random.default_rng(0), np.inf
    for _ in range(count):
        alpha = rng.uniform(-10, 12, 3)
        start = np.stack([rng.uniform(1e-4, 1.0, 3) * 4e5 / alpha, alpha], axis=1).ravel()
        best = min(best, fit(ogden, data, start=[start]).rmse ** 2 * data.stress.size / 1e12)
    return best


def felupe_model(
    name: str, p: dict[str, float]
) -> tuple[object, dict[str, object], dict[str, object]] | None:
    """(FElupe's model, its start, our answer in its parameters, MPa), or None where it has not this law."""
    import felupe as fem

    m = {k: v / 1e6 for k, v in p.items()}
    if name == "neo-hooke":
        return fem.neo_hooke, {"mu": 0.4}, {"mu": 2 * m["C10"]}
    if name == "mooney-rivlin":
        return fem.mooney_rivlin, {"C10": 0.2, "C01": 0.01}, {"C10": m["C10"], "C01": m["C01"]}
    if name in ("yeoh-2", "yeoh-3"):
        free = ("C10", "C20", "C30")[: int(name[-1])]
        fixed = {} if name == "yeoh-3" else {"C30": 0.0}
        model = fem.yeoh if name == "yeoh-3" else lambda C, C10, C20: fem.yeoh(C, C10, C20, 0.0)
        return model, dict.fromkeys(free, 0.01) | {"C10": 0.2}, {k: m[k] for k in free if k not in fixed}
    if name.startswith("ogden"):
        n = int(name[-1])
        mu = [m[f"mu{k}"] * p[f"alpha{k}"] / 2 for k in range(1, n + 1)]
        alpha = [p[f"alpha{k}"] for k in range(1, n + 1)]
        start_mu, start_alpha = [0.4, 0.003, 0.01][:n], [1.3, 5.0, -2.0][:n]
        return fem.ogden, {"mu": start_mu, "alpha": start_alpha}, {"mu": mu, "alpha": alpha}
    if name == "arruda-boyce":
        model = lambda C, C1, limit: fem.arruda_boyce(C, C1, limit)  # noqa: E731
        return model, {"C1": 0.3, "limit": 5.0}, {"C1": m["mu"], "limit": p["N"] ** 0.5}
    if name == "extended-tube":
        return (
            fem.extended_tube,
            {"Gc": 0.2, "delta": 0.05, "Ge": 0.2, "beta": 0.2},
            {"Gc": m["Gc"], "delta": p["delta"], "Ge": m["Ge"], "beta": p["beta"]},
        )
    return None


def felupe_sse(name: str, parameters: dict[str, float], own: list) -> str:
    """Sums of squares, MPa^2, of FElupe's formula fitted from its own start and from our answer."""
    try:
        import felupe as fem
    except ImportError:
        return "not installed"
    found = felupe_model(name, parameters)
    if found is None:
        return "has not this law"
    model, start, ours = found
    sizes = [np.size(v) for v in start.values()]

    def residual(x: np.ndarray) -> np.ndarray:
        values = dict(zip(start, np.split(x, np.cumsum(sizes)[:-1]), strict=True))
        values = {k: list(v) if isinstance(start[k], list) else float(v[0]) for k, v in values.items()}
        view = fem.Hyperelastic(model, **values).view(incompressible=True)
        modes = {"uniaxial": view.uniaxial, "equibiaxial": view.biaxial, "planar": view.planar}
        r = np.concatenate([modes[s.mode](s.stretch)[1] - s.stress / 1e6 for s in own])
        return np.where(np.isfinite(r), r, 1e3)

    words = []
    for values in (start, ours):
        x0 = np.concatenate([np.ravel(v) for v in values.values()]).astype(float)
        with np.errstate(all="ignore"):
            result = least_squares(
                residual, x0, jac="3-point", x_scale="jac", xtol=1e-12, ftol=1e-12, max_nfev=2000
            )
        words.append(f"{2 * result.cost:.5f}")
    return ", ".join(words)


if __name__ == "__main__":
    main()
