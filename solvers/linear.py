"""Sparse linear systems: one place that knows which factorisation is used."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from softmark.solvers.energies.energy import Floats
from softmark.solvers.threads import ALONE

if TYPE_CHECKING:
    from softmark.solvers.sparse.cholesky import Cholesky

NAME, CHOLESKY = "SuperLU (scipy)", "multifrontal Cholesky"
LARGE = 150_000  # entries from which the Cholesky factorisation pays for the analysis and the loading of its kernels
NEUTRAL = 1e-13  # of the largest pivot: smaller ones have no sign


class Singular(Exception):
    """The matrix has no usable factorisation."""


class Factor(Protocol):
    """A factorised matrix."""

    @property
    def name(self) -> str:
        """The method and its implementation, for reports."""

    @property
    def negative_pivots(self) -> int:
        """How many pivots are negative: for a symmetric matrix, its negative eigenvalues (Sylvester's law)."""

    def solve(self, b: Floats) -> Floats:
        """x with K x = b."""


@dataclass(frozen=True)
class Triangular:
    """K = L U with a permutation."""

    lu: Any  # scipy.sparse.linalg.SuperLU
    name: str = NAME

    def solve(self, b: Floats) -> Floats:
        """x with K x = b."""
        with ALONE:
            x: Floats = self.lu.solve(b)
        return x

    @property
    def negative_pivots(self) -> int:
        """How many pivots are negative.

        Only pivots on the diagonal count; a pivot taken elsewhere makes the matrix indefinite as well.
        """
        elsewhere = np.any(self.lu.perm_r != self.lu.perm_c)
        pivots = self.lu.U.diagonal()
        # a neutral direction, such as the plane in which a round column bends, has a pivot of zero to rounding
        return int(np.sum(pivots < -NEUTRAL * np.abs(pivots).max())) or int(elsewhere)


@dataclass(frozen=True)
class Definite:
    """K = L L^T: every pivot is positive."""

    cholesky: Cholesky
    name: str = CHOLESKY
    negative_pivots: int = 0

    def solve(self, b: Floats) -> Floats:
        """x with K x = b."""
        return self.cholesky.solve(b)


def factor(K: sparse.csr_matrix, symmetric: bool = True) -> Factor:
    """Factorise K: large symmetric definite matrices by Cholesky's method, others by SuperLU (Li 2005).

    What a pattern tells of its factor is found once (`sparse.plans`). Raises Singular where a pivot vanishes or the
    matrix holds a number that is not finite.
    """
    if not np.all(np.isfinite(K.data)):
        raise Singular("the stiffness matrix holds numbers that are not finite")
    definite = _definite(K) if symmetric and K.nnz >= LARGE else None
    return definite or _triangular(K, symmetric)


def _definite(K: sparse.csr_matrix) -> Definite | None:
    """None where K is not positive definite, or its pattern not symmetric."""
    from softmark.solvers.sparse.cholesky import Cholesky, Indefinite
    from softmark.solvers.sparse.plans import plan_of

    try:
        cholesky = Cholesky(plan_of(K))
        cholesky.factorise(K.data)
    except (Indefinite, ValueError):
        return None
    return Definite(cholesky)


def _triangular(K: sparse.csr_matrix, symmetric: bool) -> Triangular:
    """With a minimum-degree order for symmetric patterns. Raises Singular."""
    # a symmetric matrix read by columns is itself: no conversion
    columns = sparse.csc_matrix((K.data, K.indices, K.indptr), shape=K.shape) if symmetric else K.tocsc()
    try:
        with ALONE:
            lu = splu(
                columns, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
    except RuntimeError as error:  # "Factor is exactly singular"
        raise Singular(str(error)) from error
    return Triangular(lu)


def warm(entries: int) -> None:
    """Load the kernels that a system of so many entries will need, outside any clock."""
    if entries >= LARGE:
        _definite(
            sparse.csr_matrix(np.diag([2.0, 2.0, 2.0]) - np.diag([1.0, 1.0], 1) - np.diag([1.0, 1.0], -1))
        )
