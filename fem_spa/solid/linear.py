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
from fem_spa.solid.pattern import Pattern
from fem_spa.solid.resources import Scratch, free_disk, free_memory

FACTORS = ("auto", "memory", "disk")
_KEPT_FREE = 0.2  # of the free memory: for what else grows during a run
_FRONT = (
    0.2  # of the factors: the largest front that PARDISO holds while it writes them; 0.12 at most was seen
)


class SingularMatrix(ArithmeticError):
    """The factorization broke down or its solution is not finite."""


class LinearSolver(Protocol):
    """`on_disk` are the bytes of factors kept on disk, 0 where they are in memory."""

    name: str
    pattern: Pattern
    factorizations: int

    @property
    def on_disk(self) -> float: ...

    def factorize(self, data: np.ndarray) -> None: ...

    def solve(self, b: np.ndarray) -> np.ndarray: ...

    def free(self) -> None: ...

    def on(self, pattern: Pattern) -> LinearSolver:
        """The same kind of solver for another pattern, counting on; this one is freed."""
        ...


def make_solver(pattern: Pattern, backend: str = "auto", factors: str = "auto") -> LinearSolver:
    """A solver for matrices of one pattern.

    Parameters
    ----------
    backend : "auto" (PARDISO where MKL can be loaded, else SuperLU), "pardiso" or "superlu"
    factors : where PARDISO keeps them: "memory"; "disk"; "auto" is memory unless they will not fit

    Raises
    ------
    InputError
        The factors are to be on disk, and there is only SuperLU.
    """
    if backend in ("auto", "pardiso"):
        try:
            return Pardiso(pattern, factors)
        except (ImportError, OSError):  # PackageNotFoundError is an ImportError
            if backend == "pardiso":
                raise
    if factors == "disk":
        raise InputError(
            "given solver.factors 'disk': only MKL's PARDISO can keep factors on disk, and it is not here; "
            "leave the key out, or use a machine with pypardiso (64-bit Intel or AMD, Linux or Windows)"
        )
    return SuperLU(pattern)


class Pardiso:
    """LDL^T with Bunch-Kaufman pivoting (mtype -2), analysed once.

    The caller gives a matrix with entries of order one (see `System`), so neither scaling nor matching is
    needed; on the meshes of benchmarks/ no pivot is perturbed. The analysis says how large the factors will
    be; where they do not fit in the free memory they are kept on disk (PARDISO's out-of-core mode), which
    gives the same solution. `benchmarks/size.py` measures what that costs.
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
        self._threads = library.MKL_Set_Num_Threads_Local
        self.factorizations = 0
        self.pattern = pattern
        self._where = factors
        self._scratch: Scratch | None = None
        self._pt = np.zeros(64, dtype=np.int64)
        self._iparm = np.zeros(64, dtype=np.int32)
        self._analysed = False
        self._needed_bytes = self._factor_bytes = self._kept_bytes = 0.0
        self._megabytes = 0  # of memory that PARDISO may use where the factors are on disk
        self._data = np.zeros(0)

    def factorize(self, data):
        self._data = data
        if not self._analysed:
            self._analyse()
        try:
            self._call(22)
        except MemoryError:  # another try would not do: PARDISO leaves a damaged heap behind
            raise self._too_large() from None
        self.factorizations += 1

    def solve(self, b):
        b = np.ascontiguousarray(b, dtype=float)
        x = np.empty_like(b)
        self._call(33, b, x)
        return x

    @property
    def on_disk(self) -> float:
        return self._factor_bytes if self._scratch is not None else 0.0

    def _analyse(self) -> None:
        """Symbolic factorization, and where the numbers will be kept."""
        self._symbolic()
        if self._where == "disk" or (
            self._where == "auto" and self._needed_bytes > (1.0 - _KEPT_FREE) * free_memory()
        ):
            self._to_disk()

    def _to_disk(self) -> None:
        """The analysis again, for factors on disk; it keeps no more than the first one did."""
        needed = 1.1 * self._kept_bytes + _FRONT * self._factor_bytes
        if 1.2 * self._factor_bytes > free_disk() or needed > (1.0 - _KEPT_FREE) * free_memory():
            raise self._too_large()
        self._call(-1)
        self._scratch = Scratch()
        self._megabytes = int(needed / 2**20) + 16
        self._symbolic()

    def _symbolic(self) -> None:
        out_of_core = self._scratch is not None
        self._pt[:] = 0
        self._iparm[:] = 0
        # numbers as in MKL's manual, counted from 1
        for k, value in {
            1: 1,  # no defaults
            2: 2,  # METIS nested dissection
            10: 8,  # pivots below 1e-8 are perturbed
            21: 1,  # Bunch-Kaufman
            24: 0 if out_of_core else 1,  # two-level parallel factorization, in memory only
            35: 1,  # zero-based indices
            60: 2 if out_of_core else 0,
        }.items():
            self._iparm[k - 1] = value
        self._call(11)
        self._analysed = True
        # iparm 15 to 17 in KB, later overwritten: peak of the analysis, what is kept of it, the factors
        peak, kept, self._factor_bytes = (1024.0 * float(k) for k in self._iparm[14:17])
        self._needed_bytes = max(peak, kept + self._factor_bytes)
        self._kept_bytes = kept

    def _too_large(self) -> InputError:
        return InputError(
            f"{self.pattern.n_free} unknowns: their factors need {self._needed_bytes / 1e9:.1f} GB, and "
            f"{free_memory() / 1e9:.1f} GB of memory and {free_disk() / 1e9:.1f} GB of disk for temporary "
            "files are free; set TMPDIR to a folder with more space, or use a coarser mesh"
        )

    def _call(self, phase: int, b: np.ndarray | None = None, x: np.ndarray | None = None) -> None:
        threads = 0  # as many as MKL likes
        if self._scratch is not None:  # MKL asks for these in every phase
            os.environ["MKL_PARDISO_OOC_PATH"] = str(self._scratch.path)
            os.environ["MKL_PARDISO_OOC_MAX_CORE_SIZE"] = str(self._megabytes)
            threads = 1  # with two, the last digits differ from call to call, and a resumed run with them
        unused = np.zeros(1)
        error = ctypes.c_int32(0)
        before = self._threads(threads)
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
        self._threads(before)
        if error.value in (-2, -9, -10, -11):  # memory; and, with the factors on disk, memory and files
            raise MemoryError(f"PARDISO error {error.value}")
        if error.value != 0:
            raise SingularMatrix(f"the tangent cannot be factorized (PARDISO error {error.value})")

    def free(self) -> None:
        """Give MKL's memory back; the solver can be used no more."""
        if self._analysed:
            self._call(-1)
            self._analysed = False
        if self._scratch is not None:
            self._scratch.remove()
            self._scratch = None

    def on(self, pattern: Pattern) -> LinearSolver:
        self.free()
        other = Pardiso(pattern, self._where)
        other.factorizations = self.factorizations
        return other


class SuperLU:
    """scipy's SuperLU on the full matrix: several times slower and hungrier, the same answer."""

    name = "superlu"
    on_disk: float = 0.0

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

    def on(self, pattern: Pattern) -> LinearSolver:
        self.free()
        other = SuperLU(pattern)
        other.factorizations = self.factorizations
        return other
