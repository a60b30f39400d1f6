"""Symmetric indefinite linear systems behind one small interface: PARDISO, elsewhere SuperLU.

A solver is made from a pattern once, is given numbers with `factorize(data)` as often as the method
wants, and then solves. Nothing else in the program knows which one it is. A solver that goes beyond one
machine (PETSc's, say) is one more class with these methods, and one more line in `make_solver`.
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

from fem_spa.errors import InputError
from fem_spa.solid.gmres import gmres
from fem_spa.solid.pattern import Pattern, symmetric_product
from fem_spa.solid.resources import free_memory

_KEPT_FREE = 0.2  # of the free memory: for what else grows during a run
_ACCURACY = 1e-11  # residual of a solution with factors in single precision, relative
_MOST_ITERATIONS = 60


class SingularMatrix(ArithmeticError):
    """The factorization broke down or its solution is not finite."""


class LinearSolver(Protocol):
    """`single` says whether the factors are in single precision.

    negative : how many negative pivots the last factorization met, None where that is not known for certain
    """

    name: str
    pattern: Pattern
    factorizations: int

    @property
    def single(self) -> bool: ...

    @property
    def negative(self) -> int | None: ...

    def factorize(self, data: np.ndarray) -> None: ...

    def solve(self, b: np.ndarray) -> np.ndarray: ...

    def free(self) -> None: ...

    def on(self, pattern: Pattern, single: bool = False) -> LinearSolver:
        """The same kind of solver for another pattern, counting on; this one is freed.

        Factors that are in single precision stay so; `single` makes them so where the solver can.
        """
        ...


def make_solver(pattern: Pattern, backend: str = "auto", factors: str = "auto") -> LinearSolver:
    """A solver for matrices of one pattern.

    Parameters
    ----------
    backend : "auto" (PARDISO where MKL can be loaded, else SuperLU), "pardiso" or "superlu"
    factors : PARDISO's: "double"; "single" precision; "auto" is double unless they will not fit

    Raises
    ------
    InputError
        The factors are to be in single precision, and there is only SuperLU.
    """
    if backend in ("auto", "pardiso"):
        try:
            return Pardiso(pattern, factors)
        except (ImportError, OSError):  # PackageNotFoundError is an ImportError
            if backend == "pardiso":
                raise
    if factors == "single":
        raise InputError(
            "given solver.factors 'single': only MKL's PARDISO has them, and it is not here; leave the key "
            "out, or use a machine with pypardiso (64-bit Intel or AMD, Linux or Windows)"
        )
    return SuperLU(pattern)


class Pardiso:
    """LDL^T with Bunch-Kaufman pivoting (mtype -2), analysed once.

    The caller gives a matrix with entries of order one (see `System`), so neither scaling nor matching is
    needed; on the meshes of benchmarks/ no pivot is perturbed. The analysis says how large the factors will
    be; where they do not fit in the free memory they are kept in single precision, which is half of it, and
    precondition GMRES on the matrix itself, so that the solution is as accurate.
    """

    name = "pardiso"

    def __init__(self, pattern: Pattern, factors: str = "auto") -> None:
        # pypardiso searches the whole environment for MKL, twice, unless it is told where it is
        for file in files("mkl") or ():
            if "mkl_rt" in file.name:
                os.environ.setdefault("PYPARDISO_MKL_RT", str(file.locate()))
        from pypardiso import PyPardisoSolver

        library = PyPardisoSolver().libmkl
        self._pardiso = library.pardiso
        self._pardiso.argtypes = None
        self.factorizations = 0
        self.pattern = pattern
        self._given = factors
        self.single = factors == "single"
        self._pt = np.zeros(64, dtype=np.int64)
        self._iparm = np.zeros(64, dtype=np.int32)
        self._analysed = False
        self._needed_bytes = self._factor_bytes = 0.0
        self._data = self._exact = np.zeros(0)

    def factorize(self, data):
        self._exact = data
        if not self._analysed:
            self._analyse()
        self._data = data.astype(self._type, copy=False)
        self._call(22)
        self.factorizations += 1

    def solve(self, b):
        b = np.ascontiguousarray(b, dtype=float)
        return self._iterate(b) if self.single else self._substitute(b)

    @property
    def negative(self) -> int | None:
        # numbers as in MKL's manual: 23 negative pivots, 14 perturbed ones
        known = self.factorizations > 0 and not self.single and self._iparm[13] == 0
        return int(self._iparm[22]) if known else None

    @property
    def _type(self) -> type[np.floating]:
        return np.float32 if self.single else np.float64

    def _substitute(self, b: np.ndarray) -> np.ndarray:
        given = np.ascontiguousarray(b, dtype=self._type)
        x = np.empty_like(given)
        self._call(33, given, x)
        return x.astype(float, copy=False)

    def _iterate(self, b: np.ndarray) -> np.ndarray:
        """GMRES on the exact matrix, preconditioned by the factors."""
        found = gmres(self._product, self._substitute, b, _ACCURACY, _MOST_ITERATIONS)
        if not found.residual <= _ACCURACY:
            raise SingularMatrix("the tangent is too near to singular for factors in single precision")
        return found.solution

    def _product(self, v: np.ndarray) -> np.ndarray:
        out = np.empty_like(v)
        symmetric_product(self.pattern.indptr, self.pattern.indices, self._exact, v, out)
        return out

    def _analyse(self) -> None:
        """Symbolic factorization, and the precision that fits."""
        self._symbolic()
        allowed = (1.0 - _KEPT_FREE) * free_memory()
        if self._given == "auto" and not self.single and self._needed_bytes > allowed:
            self._call(-1)
            self.single = True
            self._symbolic()
        if self._given == "auto" and self._needed_bytes > allowed:
            raise self._too_large()

    def _symbolic(self) -> None:
        self._pt[:] = 0
        self._iparm[:] = 0
        # numbers as in MKL's manual, counted from 1
        for k, value in {
            1: 1,  # no defaults
            2: 2,  # METIS nested dissection
            10: 8,  # pivots below 1e-8 are perturbed
            21: 1,  # Bunch-Kaufman
            24: 1,  # two-level parallel factorization
            28: 1 if self.single else 0,
            35: 1,  # zero-based indices
        }.items():
            self._iparm[k - 1] = value
        self._data = self._exact.astype(self._type, copy=False)
        self._call(11)
        self._analysed = True
        # iparm 15 to 17 in KB, later overwritten: peak of the analysis, what is kept of it, the factors
        peak, kept, self._factor_bytes = (1024.0 * float(k) for k in self._iparm[14:17])
        self._needed_bytes = max(peak, kept + self._factor_bytes)

    def _too_large(self) -> InputError:
        return InputError(
            f"{self.pattern.n_free} unknowns: their factors need {self._needed_bytes / 1e9:.2g} GB even in "
            f"single precision, and {free_memory() / 1e9:.2g} GB are free; use a coarser mesh, planes "
            "of symmetry or a larger machine"
        )

    def _call(self, phase: int, b: np.ndarray | None = None, x: np.ndarray | None = None) -> None:
        unused = np.zeros(1)
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
            (unused if b is None else b).ctypes,
            (unused if x is None else x).ctypes,
            ctypes.byref(error),
        )
        if error.value == -2:
            raise self._too_large()
        if error.value != 0:
            raise SingularMatrix(f"the tangent cannot be factorized (PARDISO error {error.value})")

    def free(self) -> None:
        """Give MKL's memory back; the solver can be used no more."""
        if self._analysed:
            self._call(-1)
            self._analysed = False

    def on(self, pattern: Pattern, single: bool = False) -> LinearSolver:
        self.free()
        other = Pardiso(pattern, self._given)
        other.single = self.single or single
        other.factorizations = self.factorizations
        return other


class SuperLU:
    """scipy's SuperLU on the full matrix: several times slower and hungrier, the same answer."""

    name = "superlu"
    single: bool = False
    negative: int | None = None

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

    def on(self, pattern: Pattern, single: bool = False) -> LinearSolver:
        self.free()
        other = SuperLU(pattern)
        other.factorizations = self.factorizations
        return other
