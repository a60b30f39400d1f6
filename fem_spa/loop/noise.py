"""What is noise: white, coloured (AR(1)), and an offset and a gain that differ from record to record.

A residual is e = white + coloured + offset_r + gain_r * response. `Whitener` turns rows so that this
noise becomes
white of unit size; least squares on turned rows are the generalised ones (GLS), and records weigh as
much as they
are repeatable. Coloured noise of unknown size is the steady Kalman filter's ARMA(1,1) (Harvey 1989,
section 3.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import minimize
from scipy.signal import lfilter

from fem_spa.loop.data import Data

COLOURED = 0.009
"""Largest share of the response that coloured noise may have: sensors and supplies wander by some 0.3 %.
What is
larger is a residual to be explained, not noise.
"""
LONGEST_MEMORY = 6.0
"""s: largest correlation time of coloured noise."""
REPEATS = (0.002, 0.006)
"""Share of the response to which a record repeats (offset and gain) in one session, 0.2 to 1 %, 0.45 to
0.96 % on a pneumatic arm; sizes beyond are allowed and cost likelihood, lest a change pass for noise, or
what few records happen to share for perfect repetition.
"""
SPREADS = (1.0, 0.4)
"""Standard deviations of the logarithm of such sizes below and above the usual ones."""
LARGEST_HELD = 0.012
"""Share of the response above which records' own offsets and gains are not believed while effects are
sought."""


@dataclass(frozen=True)
class Noise:
    """Sizes of the noise, in the unit of the residual.

    Attributes
    ----------
    white, coloured : standard deviations
    tau : s, correlation time of the coloured part
    offset : standard deviation of a record's offset
    gain : standard deviation of a record's gain (times the response)
    """

    white: float
    coloured: float
    tau: float
    offset: float
    gain: float

    @property
    def sample(self) -> float:
        """Standard deviation within a record."""
        return math.hypot(self.white, self.coloured)


def repeating(noise: Noise, response: np.ndarray) -> Noise:
    """The same noise in which records repeat: their own offsets and gains no larger than `LARGEST_HELD`.

    A slow trend that is taken for offsets and gains is hidden by them from every screen.
    """
    top = float(np.max(np.abs(response))) or 1.0
    return replace(noise, offset=min(noise.offset, LARGEST_HELD * top), gain=min(noise.gain, LARGEST_HELD))


def scattered(noise: Noise, response: np.ndarray) -> bool:
    """Whether records differ by more than they usually do."""
    top = float(np.max(np.abs(response))) or 1.0
    return max(noise.offset / top, noise.gain) > REPEATS[1]


def between(noise: Noise, response: np.ndarray, data: Data) -> Noise:
    """A noise under which only what differs from record to record counts: a record weighs as one or two
    numbers."""
    held = repeating(noise, response)
    top = float(np.max(np.abs(response))) or 1.0
    rows = float(np.median([r.part.stop - r.part.start for r in data.runs if r.train]))
    white = math.hypot(noise.sample, 0.5 * LARGEST_HELD * top * math.sqrt(rows))
    return Noise(white, 1e-3 * white, noise.tau, max(held.offset, 0.5 * LARGEST_HELD * top), held.gain)


@dataclass(frozen=True)
class _Filter:
    b: np.ndarray
    a: np.ndarray
    scale: float
    first: float


def _filter(noise: Noise, step: float) -> _Filter:
    """Innovations form of white + AR(1) at this sampling time."""
    phi = math.exp(-step / noise.tau)
    w, q = max(noise.white, 1e-150) ** 2, max(noise.coloured, 1e-150) ** 2 * (1.0 - phi * phi)
    # steady variance of the prediction: P = phi^2 P w / (P + w) + q
    half = 0.5 * (q - (1.0 - phi * phi) * w)
    p = half + math.sqrt(half * half + q * w)
    gain = p / (p + w)
    return _Filter(
        np.array([1.0, -phi]),
        np.array([1.0, -phi * (1.0 - gain)]),
        1.0 / math.sqrt(p + w),
        1.0 / math.hypot(noise.coloured, noise.white),
    )


@dataclass(frozen=True)
class Whitener:
    """Turns (n, ...) rows of the chosen records; rows of unknown samples become zero.

    Attributes
    ----------
    data : rows
    noise : sizes
    response : (n, d) that a record's gain acts on
    runs : indices of the records to be turned; the others' rows become zero
    """

    data: Data
    noise: Noise
    response: np.ndarray
    runs: tuple[int, ...]

    def __call__(self, rows: np.ndarray) -> np.ndarray:
        """(n, d, k) or (n, d): whitened."""
        flat = rows.reshape(rows.shape[0], rows.shape[1], -1)
        out = np.zeros_like(flat)
        together = self._together(flat) if self.data.step is not None else None
        for index in self.runs:
            part = self.data.runs[index].part
            turned = self._filtered(index, flat[part]) if together is None else together[part]
            basis, shrink = self._records[index]
            if basis is not None:
                n, d, k = turned.shape
                line = turned.reshape(n * d, k)
                turned = (line + basis @ (shrink @ (basis.T @ line))).reshape(n, d, k)
            out[part] = turned
        return out.reshape(rows.shape)

    def _together(self, rows: np.ndarray) -> np.ndarray:
        """(n, d, k) of all records through the innovations filter in one call."""
        assert self.data.step is not None
        f = _filter(self.noise, self.data.step)
        table = self.data.table
        found = lfilter(f.b, f.a, rows[table], axis=1) * f.scale
        record, inside = self.data.place
        out = found[record, inside]
        first = table[:, 0]
        out[first] = rows[first] * f.first
        out *= self.data.known[:, None, None]
        return np.asarray(out)

    @cached_property
    def _records(self) -> dict[int, tuple[np.ndarray | None, np.ndarray]]:
        return {index: self._record(index) for index in self.runs}

    def _filtered(self, index: int, rows: np.ndarray) -> np.ndarray:
        """(n, d, k) through the innovations filter."""
        run = self.data.runs[index]
        f = _filter(self.noise, run.step)
        out = lfilter(f.b, f.a, rows, axis=0) * f.scale
        out[0] = rows[0] * f.first
        out *= self.data.known[run.part][:, None, None]
        return np.asarray(out)

    def _record(self, index: int) -> tuple[np.ndarray | None, np.ndarray]:
        """Basis Q (n d, c) of a record's own offsets and gain, and (I + R D R')^(-1/2) - I."""
        columns, variances = self._columns(index)
        if not columns:
            return None, np.zeros((0, 0))
        turned = self._filtered(index, np.stack(columns, axis=2)).reshape(-1, len(columns))
        q, r = np.linalg.qr(turned)
        values, vectors = np.linalg.eigh(np.eye(len(variances)) + r @ np.diag(variances) @ r.T)
        values = np.maximum(values, 1e-12)
        root = vectors @ np.diag(1.0 / np.sqrt(values)) @ vectors.T
        return q, root - np.eye(len(variances))

    def _columns(self, index: int) -> tuple[list[np.ndarray], list[float]]:
        """(n, d) patterns of a record's own offsets and gain, and their variances."""
        part = self.data.runs[index].part
        n, d = part.stop - part.start, self.data.output.shape[1]
        columns, variances = [], []
        for j in range(d if self.noise.offset > 0.0 else 0):
            one = np.zeros((n, d))
            one[:, j] = 1.0
            columns.append(one)
            variances.append(self.noise.offset**2)
        if self.noise.gain > 0.0:
            columns.append(self.response[part])
            variances.append(self.noise.gain**2)
        return columns, variances

    def record_bases(self) -> list[np.ndarray]:
        """For each turned record, (n_rows_total * d, c) orthonormal directions of its offset and gain,
        turned."""
        found = []
        for index in self.runs:
            basis, _ = self._records[index]
            if basis is not None:
                found.append(basis)
        return found

    def cost(self, residual: np.ndarray) -> float:
        """-2 log likelihood of an (n, d) residual; the record's part by Woodbury's formula."""
        total, d = 0.0, residual.shape[1]
        together = None
        if self.data.step is not None:
            parts = [np.zeros((len(residual), d, 0))]
            if self.noise.offset > 0.0:
                parts.append(np.broadcast_to(np.eye(d), (len(residual), d, d)))
            if self.noise.gain > 0.0:
                parts.append(self.response[:, :, None])
            together = self._together(np.concatenate([residual[:, :, None], *parts], axis=2))
        for index in self.runs:
            part = self.data.runs[index].part
            known = int(np.sum(self.data.known[part]))
            columns, variances = self._columns(index)
            if together is None:
                turned = self._filtered(index, np.stack([residual[part], *columns], axis=2))
            else:
                turned = together[part]
            flat = turned.reshape(-1, turned.shape[2])
            gram = flat.T @ flat
            total += gram[0, 0] - 2.0 * d * known * math.log(
                _filter(self.noise, self.data.runs[index].step).scale
            )
            if variances:
                inner = np.diag(1.0 / np.asarray(variances)) + gram[1:, 1:]
                total -= float(gram[0, 1:] @ np.linalg.solve(inner, gram[0, 1:]))
                total += float(np.linalg.slogdet(inner)[1] + np.sum(np.log(variances)))
        return total


def _grain(data: Data, runs: tuple[int, ...]) -> float:
    """White noise of the outputs by the median of their second differences, which jumps and motion
    hardly touch."""
    second = np.concatenate([np.diff(data.output[data.runs[i].part], 2, axis=0) for i in runs])
    sizes = np.median(np.abs(second - np.median(second, axis=0)), axis=0)
    return float(1.4826 * np.min(sizes) / math.sqrt(6.0))


def fit_noise(
    data: Data, residual: np.ndarray, response: np.ndarray, runs: tuple[int, ...], start: Noise | None = None
) -> tuple[Noise, float]:
    """Most likely noise for an (n, d) residual of the records `runs`, and -2 log likelihood.

    The correlation time is kept between one step and a quarter of the longest record.
    """
    rows = np.concatenate([np.arange(data.runs[i].part.start, data.runs[i].part.stop) for i in runs])
    rows = rows[data.known[rows]]
    size = float(np.sqrt(np.mean(residual[rows] ** 2))) or 1e-12
    amplitude = float(np.sqrt(np.mean(response[rows] ** 2))) or 1.0
    step = min(data.runs[i].step for i in runs)
    longest = max(min(0.25 * data.longest, LONGEST_MEMORY), 4.0 * step)
    top = float(np.max(np.abs(response[rows]))) or 1.0
    least = 1e-4 * min(size, top)
    coloured = max(min(2.0 * size, COLOURED * top), 2.0 * least)
    low = np.log(
        [max(0.6 * _grain(data, runs), data.grain, least), least, 1.5 * step, least, least / amplitude]
    )
    high = np.log(
        [max(2.0 * size, 4.0 * np.exp(low[0])), coloured, longest, 3.0 * size, 3.0 * size / amplitude]
    )
    differences = np.concatenate([np.diff(residual[data.runs[i].part], axis=0) for i in runs])
    white = max(float(np.sqrt(np.mean(differences**2) / 2.0)) * 0.7, 1e-3 * size)
    several = len(runs) > 1
    if start is None:
        guess = [
            white,
            0.6 * min(size, coloured),
            min(max(2.0, 3.0 * step), 0.5 * longest),
            0.3 * size,
            0.1 * size / amplitude,
        ]
    else:
        guess = [start.white, start.coloured, start.tau, start.offset or low[3], start.gain or low[4]]
    x0 = np.clip(np.log(np.maximum(guess, 1e-300)), low + 0.01, high - 0.01)
    sub = data

    def unlikely(noise: Noise) -> float:
        """Prior: actuators repeat to about half a per cent from record to record (see REPEATS)."""
        if not several:
            return 0.0
        sizes = [math.log(max(v, 1e-12)) for v in (noise.offset / top, noise.gain)]
        low, high = (math.log(v) for v in REPEATS)
        under, over = SPREADS
        return sum((max(low - v, 0.0) / under) ** 2 + (max(v - high, 0.0) / over) ** 2 for v in sizes)

    def noise_of(x: np.ndarray) -> Noise:
        v = np.exp(np.clip(x, low, high))
        return Noise(v[0], v[1], v[2], v[3] if several else 0.0, v[4] if several else 0.0)

    def cost(x: np.ndarray) -> float:
        outside = float(np.sum(np.maximum(low - x, 0.0) ** 2 + np.maximum(x - high, 0.0) ** 2))
        return (
            Whitener(sub, noise_of(x), response, runs).cost(residual) + 10.0 * outside + unlikely(noise_of(x))
        )

    n = 5 if several else 3
    base = x0.copy()

    def part(y: np.ndarray) -> float:
        full = base.copy()
        full[:n] = y
        return cost(full)

    found = minimize(
        part,
        x0[:n],
        method="Nelder-Mead",
        options={
            "maxfev": 110 if start is None else 45,
            "xatol": 0.08,
            "fatol": 1.0,
            "initial_simplex": np.vstack([x0[:n], x0[:n] + np.diag(np.full(n, 0.7))]),
        },
    )
    base[:n] = found.x
    noise = noise_of(base)
    return noise, float(found.fun)
