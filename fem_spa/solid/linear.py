"""Symmetric indefinite linear systems behind one small interface: PARDISO, elsewhere SuperLU.

A solver is made from a pattern once, is given numbers with `factorize(data)` as often as the method
wants, and then solves. Nothing else in the program knows which one it is.
"""

from __future__ import annotations

import ctypes
import os
from importlib.metadata import files
from typing import Protocol

import numpy as np
from scipy.sparse import csr_matrix, triu
from scipy.sparse.linalg import SuperLU as SuperLUFactors
from scipy.sparse.linalg import splu

from fem_spa.solid.pattern import Pattern


class SingularMatrix(ArithmeticError):
    """The factorization broke down or its solution is not finite."""


class LinearSolver(Protocol):
    name: str
    pattern: Pattern
    factorizations: int

    def factorize(self, data: np.ndarray) -> None: ...

    def solve(self, b: np.ndarray) -> np.ndarray: ...

    def free(self) -> None: ...


def make_solver(pattern: Pattern, backend: str = "auto") -> LinearSolver:
    """`backend`: "auto" (PARDISO where MKL can be loaded, else SuperLU), "pardiso" or "superlu"."""
    if backend in ("auto", "pardiso"):
        try:
            return Pardiso(pattern)
        except (ImportError, OSError):  # PackageNotFoundError is an ImportError
            if backend == "pardiso":
                raise
    return SuperLU(pattern)


class Pardiso:
    """LDL^T with Bunch-Kaufman pivoting (mtype -2), analysed once.

    The caller gives a matrix with entries of order one (see `System`), so neither scaling nor matching is
    needed; on the meshes of benchmarks/ no pivot is perturbed.
    """

    name = "pardiso"

    def __init__(self, pattern: Pattern) -> None:
        # pypardiso searches the whole environment for MKL, twice, unless it is told where it is
        for file in files("mkl") or ():
            if "mkl_rt" in file.name:
                os.environ.setdefault("PYPARDISO_MKL_RT", str(file.locate()))
        from pypardiso import PyPardisoSolver

        self._pardiso = PyPardisoSolver().libmkl.pardiso
        self._pardiso.argtypes = None
        self.factorizations = 0
        self.pattern = pattern
        self._pt = np.zeros(64, dtype=np.int64)
        self._iparm = np.zeros(64, dtype=np.int32)
        # numbers as in MKL's manual, counted from 1
        for k, value in {
            1: 1,  # no defaults
            2: 2,  # METIS nested dissection
            10: 8,  # pivots below 1e-8 are perturbed
            21: 1,  # Bunch-Kaufman
            24: 1,  # two-level parallel factorization
            35: 1,  # zero-based indices
        }.items():
            self._iparm[k - 1] = value
        self._analysed = False
        self._data = np.zeros(0)

    def factorize(self, data):
        dummy = np.zeros(1)
        self._data = data
        self._call(22 if self._analysed else 12, dummy, dummy)
        self._analysed = True
        self.factorizations += 1

    def solve(self, b):
        b = np.ascontiguousarray(b, dtype=float)
        x = np.empty_like(b)
        self._call(33, b, x)
        return x

    def _call(self, phase: int, b: np.ndarray, x: np.ndarray) -> None:
        error = ctypes.c_int32(0)
        one = ctypes.byref(ctypes.c_int32(1))
        n = ctypes.byref(ctypes.c_int32(self.pattern.n_free))
        self._pardiso(
            self._pt.ctypes,
            one,  # maxfct
            one,  # mnum
            ctypes.byref(ctypes.c_int32(-2)),
            ctypes.byref(ctypes.c_int32(phase)),
            n,
            self._data.ctypes,
            self.pattern.indptr.ctypes,
            self.pattern.indices.ctypes,
            None,  # perm
            one,  # right-hand sides
            self._iparm.ctypes,
            ctypes.byref(ctypes.c_int32(0)),  # silent
            b.ctypes,
            x.ctypes,
            ctypes.byref(error),
        )
        if error.value == -2:
            raise MemoryError("PARDISO: not enough memory for the factors; a coarser mesh needs less")
        if error.value != 0:
            raise SingularMatrix(f"the tangent cannot be factorized (PARDISO error {error.value})")

    def free(self) -> None:
        """Give MKL's memory back; the solver can be used no more."""
        if self._analysed:
            dummy = np.zeros(1)
            self._call(-1, dummy, dummy)
            self._analysed = False


class SuperLU:
    """scipy's SuperLU on the full matrix: several times slower and hungrier, the same answer."""

    name = "superlu"

    def __init__(self, pattern: Pattern) -> None:
        self.factorizations = 0
        self.pattern = pattern
        self._factors: SuperLUFactors | None = None

    def factorize(self, data):
        n = self.pattern.n_free
        upper = csr_matrix((data, self.pattern.indices, self.pattern.indptr), shape=(n, n))
        full = upper + triu(upper, 1).T
        try:
            self._factors = splu(
                full.tocsc(),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.01,
                options={"SymmetricMode": True},
            )
        except RuntimeError as exc:
            raise SingularMatrix(f"the tangent cannot be factorized ({exc})") from None
        self.factorizations += 1

    def solve(self, b):
        if self._factors is None:
            raise SingularMatrix("solve was called before factorize")
        return self._factors.solve(np.asarray(b, dtype=float))

    def free(self) -> None:
        """Drop the factors."""
        self._factors = None
