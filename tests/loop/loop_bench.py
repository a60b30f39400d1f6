"""A small bench for tests of the loop: records whose physics is written in other forms than the library's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

STEP = 0.1
TOP = 50.0  # kPa
SPAN = 40.0  # deg


def curve(q: np.ndarray) -> np.ndarray:
    """deg at a share of the largest pressure."""
    return SPAN * (0.6 * q + 0.4 * q * q)


def triangle(period: float, top: float, cycles: int) -> np.ndarray:
    t = np.arange(0.0, period * cycles, STEP) / period % 1.0
    return top * (1.0 - np.abs(1.0 - 2.0 * t))


def holds(levels: Sequence[float], seconds: float) -> np.ndarray:
    points, last = [], 0.0
    for level in levels:
        points += [np.linspace(last, level, 10), np.full(int(seconds / STEP), level)]
        last = level
    return np.concatenate(points)


def drives() -> list[np.ndarray]:
    """Shares of the largest pressure, record by record: three rates, two amplitudes, holds, uneven steps."""
    uneven = np.array([0.3, 0.9, 0.5, 1.0, 0.2, 0.7, 0.0])
    return [
        triangle(12.0, 1.0, 3),
        np.concatenate([triangle(5.0, 0.5, 3), triangle(5.0, 1.0, 3)]),
        holds([0.5, 1.0, 0.4, 0.0], 8.0),
        triangle(3.0, 1.0, 8),
        holds(list(uneven), 4.0),
        triangle(18.0, 0.9, 2),
    ]


def rich() -> list[np.ndarray]:
    """A protocol over more than a decade of rates, with long holds and minor amplitudes."""
    return [
        triangle(60.0, 1.0, 2),
        np.concatenate([triangle(4.0, 0.5, 4), triangle(4.0, 1.0, 6)]),
        holds([0.5, 1.0, 0.4, 0.0], 20.0),
        triangle(2.0, 1.0, 12),
        holds([0.3, 0.9, 0.5, 1.0, 0.2, 0.7, 0.0], 4.0),
        triangle(15.0, 0.9, 4),
        np.concatenate([triangle(40.0, 0.6, 1), triangle(3.0, 1.0, 6)]),
        triangle(60.0, 1.0, 1),
    ]


def noise(rng: np.random.Generator, n: int) -> np.ndarray:
    """deg: white 0.15 %, coloured 0.2 % with 1.5 s of memory, an offset of 0.3 % of the span."""
    a = np.exp(-STEP / 1.5)
    coloured = np.zeros(n)
    for k in range(1, n):
        coloured[k] = a * coloured[k - 1] + np.sqrt(1 - a * a) * rng.standard_normal()
    white = rng.standard_normal(n)
    return np.asarray(SPAN * (0.0015 * white + 0.002 * coloured + 0.003 * rng.standard_normal()))


def write_case(
    folder: Path,
    body: Callable[[list[np.ndarray]], list[np.ndarray]],
    seed: int = 1,
    shares: list[np.ndarray] | None = None,
    chamber: Callable[[np.ndarray], np.ndarray] | None = None,
) -> tuple[Path, list[Path]]:
    """A curve model and a record a drive of `body`, which turns the drives into angles in deg.

    `chamber` turns a drive into the share of the pressure that was measured in the chamber.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    grid = np.linspace(0.0, 1.2, 60)
    rows = "\n".join(f"{TOP * q:.8g},{y:.8g}" for q, y in zip(grid, curve(grid), strict=True))
    (folder / "curve.csv").write_text(f"pressure [kPa],angle [deg]\n{rows}\n")
    model = folder / "model.toml"
    model.write_text('[model]\nkind = "curve"\nfile = "curve.csv"\n')
    files, shares = [], drives() if shares is None else shares
    for k, (q, angle) in enumerate(zip(shares, body(shares), strict=True)):
        columns = {"time [s]": STEP * np.arange(len(q)), "pressure [kPa]": TOP * q}
        reading = 0.95 * angle + 1.0 + noise(rng, len(q))
        if chamber is not None:
            columns["measured pressure [kPa]"] = TOP * (chamber(q) + 0.002 * rng.standard_normal(len(q)))
        columns["angle [deg]"] = reading
        lines = ["# history: virgin", f"# start: 2026-03-01T10:{5 * k:02d}:00", "# orientation: 0 deg"]
        lines.append(",".join(columns))
        lines += [",".join(f"{v:.7g}" for v in row) for row in zip(*columns.values(), strict=True)]
        files.append(folder / f"run{k}.csv")
        files[-1].write_text("\n".join(lines) + "\n")
    return model, files


def nothing(shares: list[np.ndarray]) -> list[np.ndarray]:
    return [curve(q) for q in shares]


def duhem(shares: list[np.ndarray]) -> list[np.ndarray]:
    """Loops after Duhem: a state that is driven by the way gone, not a sum of plays."""
    out = []
    for q in shares:
        z = np.zeros(len(q))
        for k in range(1, len(q)):
            way = q[k] - q[k - 1]
            z[k] = z[k - 1] + 9.0 * (way * 0.4 * SPAN * 0.12 - abs(way) * z[k - 1])
        out.append(curve(q) - z)
    return out


def threshold(shares: list[np.ndarray]) -> list[np.ndarray]:
    """Nothing below a twelfth of the pressure, the rest stretched: another form than a shifted pressure."""
    p0 = 1.0 / 12.0
    return [curve(np.where(q > p0, (q - p0) / (1.0 - p0), 0.0)) for q in shares]


def wander(shares: list[np.ndarray]) -> list[np.ndarray]:
    """What no effect of the library does: a tone whose pitch follows the pressure of ten seconds ago."""
    out = []
    for q in shares:
        late = np.concatenate([np.zeros(100), q])[: len(q)]
        out.append(curve(q) + 0.05 * SPAN * np.sin(14.0 * late) * (1.0 - late))
    return out


def soften(shares: list[np.ndarray], size: float = 0.12) -> list[np.ndarray]:
    """Less and less motion with the way gone."""
    out, so_far = [], 0.0
    for q in shares:
        way = so_far + 0.5 * np.cumsum(np.abs(np.diff(q, prepend=0.0)))
        so_far = float(way[-1])
        out.append(curve(q) * (1.0 - size * (1.0 - np.exp(-way / 8.0))))
    return out


def creeping(shares: list[np.ndarray]) -> list[np.ndarray]:
    """Every change of pressure goes on with the logarithm of time; records begin anew."""
    out = []
    for q in shares:
        late = np.log1p(STEP * np.arange(len(q)) / 0.5)
        out.append(curve(q) + 0.03 * SPAN * np.convolve(np.diff(q, prepend=0.0), late)[: len(q)])
    return out


def rubbing(shares: list[np.ndarray]) -> list[np.ndarray]:
    """Angles with bristles on a wall (Bliman, Sorine): their force nears a limit that grows with it."""
    out = []
    for q in shares:
        y = curve(q)
        z, held = 0.0, np.zeros(len(y))
        for k in range(1, len(y)):
            limit = 0.02 * SPAN + 0.1 * y[k]
            for _ in range(8):
                d = (y[k] - y[k - 1]) / 8
                z += 1.3 * (d - abs(d) * z / limit)
            held[k] = z
        out.append(y - held)
    return out
