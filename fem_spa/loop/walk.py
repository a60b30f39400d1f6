"""A number that wanders through the records: its path on nodes, by penalised least squares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem_spa.loop.data import Data

NODES = 40
"""Most nodes of a path in a record."""
ALL_NODES = 240
"""Most nodes in all records together, two a record apart."""
FOLDS = 5
"""Blocks of two nodes are dealt to so many folds."""
PENALTIES = (1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e4)
"""Weight of a path's squared steps, in units of its mean squared sensitivity a node."""
FEWEST = 16
"""Rows of a record that a path can be drawn through."""


@dataclass(frozen=True)
class Walk:
    """Nodes of a path: rows stand between `left` and the next with weight `part`; `record` of a node."""

    rows: np.ndarray
    left: np.ndarray
    part: np.ndarray
    fold: np.ndarray
    nodes: int
    record: np.ndarray
    penalty: np.ndarray


def walk_of(data: Data) -> Walk:
    """Nodes evenly in each training record, the path going on from record to record."""
    lefts, parts, rows, joints, at = [], [], [], [], 0
    several = sum(run.train for run in data.runs)
    for run in data.runs:
        n = run.part.stop - run.part.start
        if not run.train or n < FEWEST:
            continue
        count = max(min(NODES, n // 4, ALL_NODES // several), 2)
        place = np.linspace(0.0, count - 1.0, n)
        left = np.minimum(place.astype(int), count - 2)
        rows.append(np.arange(run.part.start, run.part.stop))
        lefts.append(at + left)
        parts.append(place - left)
        at += count
        joints.append(at - 1)
    known = data.known[np.concatenate(rows)]
    left = np.concatenate(lefts)[known]
    steps = np.diff(np.eye(at), axis=0)
    steps[joints[:-1]] *= 0.5
    record = np.repeat(np.arange(len(joints)), np.diff([-1, *joints]))
    inside, fold = np.concatenate(parts)[known], left // 2 % FOLDS
    return Walk(np.concatenate(rows)[known], left, inside, fold, at, record, steps.T @ steps)


def record_means(walk: Walk, path: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(nodes,) a path's mean in each record, which a record's own offset leaves open."""
    total = np.maximum(np.bincount(walk.record, weight), 1e-300)
    return np.asarray((np.bincount(walk.record, weight * path) / total)[walk.record])


def followed(
    walk: Walk, column: np.ndarray, nuisance: np.ndarray, residual: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray]:
    """Share explained on blocks left out, the path over the nodes, and the weight of each node."""
    grams = np.stack([_gram(walk, walk.fold == f, column, nuisance, residual) for f in range(FOLDS)])
    total, m = grams.sum(axis=0), walk.nodes
    weight = np.diag(total)[:m].copy()
    unit = float(weight.mean())
    free = np.arange(m, len(total) - 1)
    without = sum(_error(g, _solve(total - g, free, None)) for g in grams)
    best, chosen = -np.inf, PENALTIES[-1]
    everything = np.arange(len(total) - 1)
    for penalty in PENALTIES:
        ridge = penalty * unit * walk.penalty
        error = sum(_error(g, _solve(total - g, everything, ridge)) for g in grams)
        if 1.0 - error / max(without, 1e-300) > best:
            best, chosen = 1.0 - error / max(without, 1e-300), penalty
    path = _solve(total, everything, min(chosen, 1.0) * unit * walk.penalty)[:m]
    return best, path, weight


def _gram(
    walk: Walk, pick: np.ndarray, column: np.ndarray, nuisance: np.ndarray, residual: np.ndarray
) -> np.ndarray:
    """(nodes + c + 1, same): sums of products of the path's hats, the refitted columns and the residual."""
    rows, left, part = walk.rows[pick], walk.left[pick], walk.part[pick]
    m, c = walk.nodes, nuisance.shape[2]
    out = np.zeros((m + c + 1, m + c + 1))
    rest = np.concatenate([nuisance[rows], residual[rows][:, :, None]], axis=2)
    s = column[rows]
    square = np.sum(s * s, axis=1)
    cross = np.einsum("nd,ndc->nc", s, rest)
    for i, a in ((0, 1.0 - part), (1, part)):
        for j, b in ((0, 1.0 - part), (1, part)):
            np.add.at(out, (left + i, left + j), a * b * square)
        for k in range(c + 1):
            out[:m, m + k] += np.bincount(left + i, a * cross[:, k], m)
    out[m:, :m] = out[:m, m:].T
    flat = rest.reshape(-1, c + 1)
    out[m:, m:] = flat.T @ flat
    return out


def _solve(gram: np.ndarray, used: np.ndarray, ridge: np.ndarray | None) -> np.ndarray:
    """(c - 1,) coefficients of the used columns, zero elsewhere."""
    matrix = gram[np.ix_(used, used)].copy()
    if ridge is not None:
        matrix[: len(ridge), : len(ridge)] += ridge
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix / np.outer(size, size) + 1e-9 * np.eye(len(used))
    out = np.zeros(len(gram) - 1)
    out[used] = np.linalg.solve(scaled, gram[used, -1] / size) / size
    return out


def _error(gram: np.ndarray, solution: np.ndarray) -> float:
    v = np.append(-solution, 1.0)
    return float(v @ gram @ v)
