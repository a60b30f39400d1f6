"""Causal operators on the rows of all records, state carried from record to record, pressure zero between."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.signal import lfilter

from fem_spa.loop.data import Data


def lowpass(data: Data, signal: np.ndarray, tau: float, rest: float | np.ndarray = 0.0) -> np.ndarray:
    """First-order lag of time constant `tau` (s), exact for a signal that runs linearly between rows.

    Parameters
    ----------
    signal : (n,) or (n, d)
    rest : value of the signal at zero pressure, where the state goes in the gaps
    """
    if data.step is not None:
        return _lowpass_together(data, signal - rest, tau) + rest
    out = np.empty_like(signal)
    state = np.broadcast_to(np.asarray(rest, float), signal.shape[1:])
    for run in data.runs:
        state = rest + (state - rest) * np.exp(-run.gap / tau)
        out[run.part] = _lag(signal[run.part], run.step, tau, state)
        state = out[run.part.stop - 1]
    return out


def _lowpass_together(data: Data, signal: np.ndarray, tau: float) -> np.ndarray:
    """All records in one call: each from zero, then what the state that it began with adds."""
    assert data.step is not None
    decay = np.exp(-data.step / tau)
    part = -np.expm1(-data.step / tau) * tau / data.step
    b0, b1 = 1.0 - part, part - decay
    x = signal[data.table]
    zi = -b0 * x[:, :1]
    free = lfilter([b0, b1], [1.0, -decay], x, axis=1, zi=zi)[0]
    record, inside = data.place
    out = np.asarray(free[record, inside])
    state = np.zeros(signal.shape[1:])
    starts = np.zeros((len(data.runs), *signal.shape[1:]))
    for i, run in enumerate(data.runs):
        starts[i] = state * np.exp(-run.gap / tau)
        n = run.part.stop - run.part.start
        state = out[run.part.stop - 1] + starts[i] * decay ** (n - 1)
    if np.abs(starts).max() > 0.0:
        power = decay**inside
        out = out + starts[record] * (power if signal.ndim == 1 else power[:, None])
    return out


def _lag(x: np.ndarray, step: float, tau: float, state: np.ndarray) -> np.ndarray:
    decay = np.exp(-step / tau)
    part = -np.expm1(-step / tau) * tau / step
    b0, b1 = 1.0 - part, part - decay
    start = np.asarray(state) - b0 * x[0]
    return np.asarray(lfilter([b0, b1], [1.0, -decay], x, axis=0, zi=start[None])[0])


def lag_up_down(data: Data, signal: np.ndarray, rise: float, fall: float) -> np.ndarray:
    """Lag of a (n,) signal with one time constant up, another down; at rest 0.

    The direction at a row is that of the signal against the state; found by repetition, as it changes rarely.
    """
    out = lowpass(data, signal, rise)
    if abs(fall / rise - 1.0) < 1e-9:
        return out
    for _ in range(3):
        up = signal >= np.concatenate([[0.0], out[:-1]])
        state = 0.0
        for run in data.runs:
            state *= np.exp(-run.gap / fall)
            a, b = run.part.start, run.part.stop
            edges = np.concatenate([[a], a + 1 + np.nonzero(np.diff(up[a:b]))[0], [b]])
            for i, (i0, i1) in enumerate(itertools.pairwise(edges)):
                tau = rise if up[i0] else fall
                if i == 0:
                    out[i0:i1] = _lag(signal[i0:i1], run.step, tau, np.asarray(state))
                else:
                    out[i0:i1] = _lag(signal[i0 - 1 : i1], run.step, tau, np.asarray(state))[1:]
                state = out[i1 - 1]
    return out


def rate_limited(data: Data, signal: np.ndarray, up: float, down: float) -> np.ndarray:
    """(n,) signal followed no faster than `up` and `down` (a second, above 0); at rest 0, in the gaps too."""
    out = np.empty_like(signal)
    state = 0.0
    for run in data.runs:
        state = max(state - down * run.gap, 0.0) if state > 0.0 else min(state + up * run.gap, 0.0)
        out[run.part] = _followed(signal[run.part], state, up * run.step, down * run.step)
        state = float(out[run.part.stop - 1])
    return out


def _followed(x: np.ndarray, state: float, up: float, down: float) -> np.ndarray:
    """(n,) from `state`, at most `up` and `down` from row to row; the first row is free to be reached."""
    steps = np.diff(x)
    if state == x[0] and (steps <= up).all() and (steps >= -down).all():
        return x
    out = np.empty_like(x)
    now = state
    for i, aim in enumerate(x.tolist()):
        now = aim if now - down <= aim <= now + up else now + up if aim > now else now - down
        out[i] = now
    return out


def delayed(data: Data, signal: np.ndarray, delay: float) -> np.ndarray:
    """(n, d) signal later by `delay` (s); before a record's beginning its first value."""
    out = np.empty_like(signal)
    for run in data.runs:
        n = run.part.stop - run.part.start
        at = np.arange(n) - delay / run.step
        for j in range(signal.shape[1]):
            out[run.part, j] = np.interp(at, np.arange(n), signal[run.part, j])
    return out


def turns(x: np.ndarray) -> np.ndarray:
    """Indices that cut a (n,) signal into monotone pieces, first and last row included."""
    slope = np.sign(np.diff(x))
    moving = np.nonzero(slope)[0]
    if len(moving) == 0:
        return np.array([0, len(x)])
    change = moving[1:][slope[moving[1:]] != slope[moving[:-1]]]
    return np.concatenate([[0], change + 1, [len(x)]])


def play(data: Data, signal: np.ndarray, radius: float, rest: float = 0.0) -> np.ndarray:
    """Play operator (backlash of half width `radius`) of a (n,) signal, at the value `rest` to begin with."""
    out = np.empty_like(signal)
    state = rest
    for run in data.runs:
        state = min(max(state, rest - radius), rest + radius)
        x = signal[run.part]
        cuts = turns(x)
        piece = np.empty_like(x)
        for a, b in itertools.pairwise(cuts):
            segment = x[a:b]
            before = x[a - 1] if a else rest
            if segment[-1] >= before:
                piece[a:b] = np.maximum(state, segment - radius)
                piece[a:b] = np.minimum(piece[a:b], segment + radius)
            else:
                piece[a:b] = np.minimum(state, segment + radius)
                piece[a:b] = np.maximum(piece[a:b], segment - radius)
            state = float(piece[b - 1])
        out[run.part] = piece
    return out


def sliding(data: Data, signal: np.ndarray, slope: float, limit: np.ndarray, rest: float) -> np.ndarray:
    """(n,) force of a spring that slides where it reaches its limit.

    Parameters
    ----------
    slope : force over the way of the (n,) signal
    limit : (n,) of the force at every row
    rest : the same where the signal is zero, between records
    """
    out = np.empty_like(signal)
    force = 0.0
    for run in data.runs:
        x, most = signal[run.part], limit[run.part]
        piece, last = np.empty_like(x), 0.0
        # from zero to the first row, too, it may slide
        for a, b in itertools.pairwise(np.unique(np.append(turns(x), 1))):
            piece[a:b] = np.clip(force + slope * (x[a:b] - last), -most[a:b], most[a:b])
            force, last = float(piece[b - 1]), float(x[b - 1])
        out[run.part] = piece
        force = min(max(force - slope * last, -rest), rest)
    return out


def running_max(data: Data, signal: np.ndarray, start: float = 0.0) -> np.ndarray:
    """(n,) largest value so far, over all records."""
    return np.asarray(np.maximum(np.maximum.accumulate(signal), start))


def travelled(data: Data, signal: np.ndarray) -> np.ndarray:
    """(n,) cycles so far: half the way that a signal of unit span has gone, the gaps' return included."""
    out = np.empty_like(signal)
    so_far, last = 0.0, 0.0
    for run in data.runs:
        x = signal[run.part]
        way = np.concatenate([[abs(last) + abs(x[0])], np.abs(np.diff(x))])
        out[run.part] = so_far + 0.5 * np.cumsum(way)
        so_far, last = float(out[run.part.stop - 1]), float(x[-1])
    return out


def holding(data: Data, pressure: np.ndarray) -> np.ndarray:
    """(n,) whether a command stands still at a row: its valve is shut, if it shuts at all."""
    still = np.zeros(len(pressure), bool)
    limit = 1e-3 * float(np.max(np.abs(pressure))) + 1e-12
    for run in data.runs:
        x = pressure[run.part]
        rate = np.abs(np.diff(x, prepend=x[:1]))
        still[run.part] = (rate < limit * 0.2) & (np.abs(x) > 20 * limit)
    return still


def staged_lag(data: Data, signal: np.ndarray, theta: np.ndarray, rest: np.ndarray | float) -> np.ndarray:
    """One lag of time constant theta[0], then two equal ones of theta[1] (s); zero is none."""
    out = signal
    for tau, stages in zip(theta, (1, 2), strict=True):
        for _ in range(stages if tau > 0.0 else 0):
            out = lowpass(data, out, float(tau), rest)
    return out
