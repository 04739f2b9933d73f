"""Saddle-point systems with pressures: [[A, B^T], [B, -C]] with a small C, zero for an incompressible solid.

A factor without pivoting needs C away from zero, and pivoting costs more than it gains. So the system is factorised
with slightly more compliance, 1/K of SLACK times 1/mu, whose L S L^T exists in every order (Vanderbei 1995, "Symmetric
quasidefinite matrices"). Refinement removes the resulting error: each round leaves about SLACK / beta^2 of it, beta the
inf-sup value of the element (Benzi, Golub and Liesen 2005, section 9). The few pressures for which that is not small,
as in a body fixed nearly all around, are left to GMRES (Saad and Schultz 1986). A saddle point has as many negative
pivots as pressures; more of them mean that the body is unstable.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Factor, Unsolved

ROUNDS, ENOUGH, USABLE = 20, 1e-13, 1e-8  # of refinement: at most, and relative residuals


@dataclass
class SaddlePointFactor:
    """Factor of a slightly more compressible system, with refinement."""

    factor: Factor
    K: sparse.csr_matrix
    pressures: int
    tolerance: float = 0.0
    iterations: int = 0  # rounds of refinement in the last solve

    @property
    def name(self) -> str:
        """Name of the method."""
        return f"{self.factor.name}, refined for pressures"

    @property
    def negative_pivots(self) -> int | None:
        """Number of negative pivots minus that of pressures; 0 for a stable equilibrium."""
        found = self.factor.negative_pivots
        return None if found is None else max(0, found - self.pressures)

    def solve(self, b: Floats) -> Floats:
        """Return x with K x = b. Raises Unsolved, e.g. if supports change the volume of an incompressible body."""
        size = float(np.linalg.norm(b))
        x, left = self._refined(b, ENOUGH * size)
        if not left <= USABLE * size:
            x, left = self._projected(b, x, left)
        if not left <= USABLE * size:
            raise Unsolved(left / size, USABLE)
        return x

    def _refined(self, b: Floats, enough: float) -> tuple[Floats, float]:
        """Return x and the norm of its residual, after refinement rounds that each lower it."""
        x = self.factor.solve(b)
        best, least = x, np.inf
        for self.iterations in range(1, ROUNDS + 1):
            r = b - self.K @ x
            left = float(np.linalg.norm(r))
            if left >= least:
                break
            best, least = x, left
            if left <= enough or not np.isfinite(left):
                break
            x = x + self.factor.solve(r)
        return best, least

    def _projected(self, b: Floats, x: Floats, left: float) -> tuple[Floats, float]:
        """Return the better of x and its correction by GMRES, with the norm of its residual."""
        if not np.isfinite(left):
            return x, left
        # 0.14 s, asked for where plain refinement is not enough
        from scipy.sparse.linalg import LinearOperator, gmres

        size = self.K.shape
        prior = LinearOperator(size, matvec=self.factor.solve, dtype=np.float64)
        y, _ = gmres(self.K, b, x0=x, rtol=ENOUGH, atol=0.0, restart=ROUNDS, maxiter=1, M=prior)
        after = float(np.linalg.norm(b - self.K @ y))
        return (y, after) if after < left else (x, left)


def factor(
    K: sparse.csr_matrix, spare: Floats, make: Callable[[sparse.csr_matrix], Factor], halved: bool = False
) -> Factor:
    """Return a solver for K, by `make` of a matrix with `spare` (n,) >= 0 subtracted from the pressure diagonal.

    If K is nearly symmetric, `make` gets only its symmetric part (`halved`), and refinement corrects that. Raises
    errors of `make`.
    """
    near = (0.5 * (K + K.T)).tocsr() if halved else K
    softened: Any = sparse.csr_matrix((near.data.copy(), near.indices, near.indptr), shape=K.shape)
    softened.setdiag(near.diagonal() - spare)  # which the pattern holds: its structure stays that of K
    return SaddlePointFactor(make(softened), K, int(np.count_nonzero(spare)))
