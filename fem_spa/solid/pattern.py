"""The sparsity pattern of the free unknowns and the maps that sum element blocks into it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit


@dataclass(frozen=True)
class Pattern:
    """Upper triangle in CSR, diagonal first in each row, of the free unknowns.

    number : (n_dofs,) number of each unknown among the free ones, -1 where it is held
    free : (n_free,) the free unknowns
    indptr, indices : CSR of the upper triangle, int32, columns sorted
    """

    number: np.ndarray
    free: np.ndarray
    indptr: np.ndarray
    indices: np.ndarray

    @property
    def n_free(self) -> int:
        return len(self.free)

    @property
    def nnz(self) -> int:
        return len(self.indices)


def build_pattern(element_dofs: np.ndarray, held: np.ndarray) -> Pattern:
    """Pattern of all pairs of unknowns that share an element.

    element_dofs : (n_el, n_local) unknowns of each element;  held : (n_dofs,) bool
    """
    free = np.flatnonzero(~held)
    number = np.full(len(held), -1, dtype=np.int32)
    number[free] = np.arange(len(free), dtype=np.int32)
    local = number[element_dofs]
    counts = np.bincount(local[local >= 0], minlength=len(free))
    start = np.zeros(len(free) + 1, dtype=np.int64)
    np.cumsum(counts, out=start[1:])
    indptr, indices = _rows(local, start, len(free))
    return Pattern(number, free, indptr, indices)


@njit(cache=True)
def _rows(local, start, n):
    n_el, n_loc = local.shape
    owner = np.empty(start[n], dtype=np.int32)
    fill = start[:-1].copy()
    for e in range(n_el):
        for r in range(n_loc):
            d = local[e, r]
            if d >= 0:
                owner[fill[d]] = e
                fill[d] += 1
    indptr = np.zeros(n + 1, dtype=np.int32)
    seen = np.full(n, -1, dtype=np.int32)
    for row in range(n):
        count = 0
        for k in range(start[row], start[row + 1]):
            for c in range(n_loc):
                d = local[owner[k], c]
                if d >= row and seen[d] != row:
                    seen[d] = row
                    count += 1
        indptr[row + 1] = indptr[row] + count
    indices = np.empty(indptr[n], dtype=np.int32)
    seen[:] = -1
    for row in range(n):
        at = indptr[row]
        for k in range(start[row], start[row + 1]):
            for c in range(n_loc):
                d = local[owner[k], c]
                if d >= row and seen[d] != row:
                    seen[d] = row
                    indices[at] = d
                    at += 1
        indices[indptr[row] : at].sort()
    return indptr, indices


def scatter_map(pattern: Pattern, dofs: np.ndarray) -> np.ndarray:
    """Where each entry of the upper triangles of blocks goes in the CSR data.

    dofs : (n_blocks, n_local) unknowns;  returns (n_blocks, n_local (n_local + 1) / 2) int32,
    `pattern.nnz` (a slot to be thrown away) where a row or column is held.
    """
    return _scatter(pattern.number[dofs], pattern.indptr, pattern.indices)


@njit(cache=True)
def _scatter(local, indptr, indices):
    n_el, n_loc = local.shape
    nnz = len(indices)
    where = np.empty((n_el, n_loc * (n_loc + 1) // 2), dtype=np.int32)
    for e in range(n_el):
        k = 0
        for r in range(n_loc):
            for c in range(r, n_loc):
                i = min(local[e, r], local[e, c])
                j = max(local[e, r], local[e, c])
                if i < 0:
                    where[e, k] = nnz
                else:
                    lo = indptr[i]
                    hi = indptr[i + 1]
                    while hi - lo > 1:
                        middle = (lo + hi) // 2
                        if indices[middle] <= j:
                            lo = middle
                        else:
                            hi = middle
                    where[e, k] = lo
                k += 1
    return where


def extend_pattern(pattern: Pattern, rows: np.ndarray, columns: np.ndarray) -> tuple[Pattern, np.ndarray]:
    """The pattern with more entries, and where the old entries (and the slot thrown away) are in it.

    rows, columns : unknowns, in either order; held ones are passed over
    """
    i, j = pattern.number[rows], pattern.number[columns]
    i, j = np.minimum(i, j), np.maximum(i, j)
    use = i >= 0
    n = np.int64(pattern.n_free)
    old_rows = np.repeat(np.arange(pattern.n_free, dtype=np.int64), np.diff(pattern.indptr))
    old = old_rows * n + pattern.indices
    new = np.unique(i[use].astype(np.int64) * n + j[use])
    at = np.minimum(np.searchsorted(old, new), len(old) - 1)
    new = new[old[at] != new]
    keys = np.insert(old, np.searchsorted(old, new), new)
    where = np.append(np.searchsorted(keys, old), len(keys)).astype(np.int32)
    indptr = np.zeros(pattern.n_free + 1, dtype=np.int32)
    indptr[1:] = np.cumsum(np.bincount(keys // n, minlength=pattern.n_free))
    return Pattern(pattern.number, pattern.free, indptr, (keys % n).astype(np.int32)), where


@njit(cache=True)
def add_blocks(where, blocks, n_blocks, data):
    """data[where[e, k]] += blocks[e, k], in order: the sum does not depend on the number of threads."""
    for e in range(n_blocks):
        for k in range(where.shape[1]):
            data[where[e, k]] += blocks[e, k]


@njit(cache=True)
def add_vectors(dofs, blocks, out):
    """out[dofs[e, k]] += blocks[e, k]."""
    for e in range(dofs.shape[0]):
        for k in range(dofs.shape[1]):
            out[dofs[e, k]] += blocks[e, k]


@njit(cache=True)
def symmetric_product(indptr, indices, data, x, out):
    """out = A x with A given by its upper triangle."""
    n = len(indptr) - 1
    for i in range(n):
        out[i] = 0.0
    for i in range(n):
        s = 0.0
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            s += data[k] * x[j]
            if j != i:
                out[j] += data[k] * x[i]
        out[i] += s
