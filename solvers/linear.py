"""Sparse linear systems: one place that knows which factorisation is used."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from softmark.solvers.energies.energy import Floats

NAME = "SuperLU (scipy)"
NEUTRAL = 1e-13  # of the largest pivot: smaller ones have no sign


class Singular(Exception):
    """The matrix has no usable factorisation."""


@dataclass(frozen=True)
class Factor:
    """A factorised matrix."""

    lu: Any  # scipy.sparse.linalg.SuperLU

    def solve(self, b: Floats) -> Floats:
        """x with K x = b."""
        x: Floats = self.lu.solve(b)
        return x

    @property
    def negative_pivots(self) -> int:
        """How many pivots are negative: for a symmetric matrix, its negative eigenvalues (Sylvester's law).

        Only pivots on the diagonal count; a pivot taken elsewhere makes the matrix indefinite as well.
        """
        elsewhere = np.any(self.lu.perm_r != self.lu.perm_c)
        pivots = self.lu.U.diagonal()
        # a neutral direction, such as the plane in which a round column bends, has a pivot of zero to rounding
        return int(np.sum(pivots < -NEUTRAL * np.abs(pivots).max())) or int(elsewhere)


def factor(K: sparse.csr_matrix, symmetric: bool = True) -> Factor:
    """Factorise K by SuperLU (Li 2005) with a minimum-degree order for symmetric patterns.

    Raises Singular where a pivot vanishes or the matrix holds a number that is not finite.
    """
    if not np.all(np.isfinite(K.data)):
        raise Singular("the stiffness matrix holds numbers that are not finite")
    # a symmetric matrix read by columns is itself: no conversion
    columns = sparse.csc_matrix((K.data, K.indices, K.indptr), shape=K.shape) if symmetric else K.tocsc()
    try:
        lu = splu(columns, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError as error:  # "Factor is exactly singular"
        raise Singular(str(error)) from error
    return Factor(lu)
