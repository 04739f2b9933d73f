"""Saddle-point systems with pressures: [[A, B^T], [B, -C]] with a small C, zero for an incompressible solid.

A factorisation without pivoting needs C away from zero, and pivoting costs more than it gains. So the system is
factorised with some additional compliance: SLACK / mu is added to 1 / bulk modulus. The factor L S L^T of this matrix
exists in every elimination order (Vanderbei 1995, "Symmetric quasidefinite matrices"). Iterative refinement removes the
resulting error: each round leaves a fraction of about SLACK / beta^2, with beta the inf-sup constant of the element
(Benzi, Golub and Liesen 2005, section 9). For a few pressure modes this fraction is not small, as in a body fixed
nearly all around; GMRES removes their error (Saad and Schultz 1986). A saddle point has as many negative pivots as
pressures; more negative pivots mean that the body is unstable.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Factor, Unsolved

ROUNDS = 20  # largest number of refinement rounds
ENOUGH, USABLE = 1e-13, 1e-8  # relative residuals at which refinement stops, and up to which a solution is accepted


@dataclass
class SaddlePointFactor:
    """Solver for a saddle-point system by the factor of a slightly more compressible system and refinement."""

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
        """Number of negative pivots beyond the number of pressures: 0 for a stable equilibrium, None if unknown."""
        found = self.factor.negative_pivots
        return None if found is None else max(0, found - self.pressures)

    def solve(self, b: Floats) -> Floats:
        """Return the solution x of K x = b. Raises Unsolved.

        There is no solution if, for example, supports change the volume of an incompressible body.
        """
        size = float(np.linalg.norm(b))
        x, left = self._solve_refined(b, ENOUGH * size)
        if not left <= USABLE * size:
            x, left = self._correct_by_gmres(b, x, left)
        if not left <= USABLE * size:
            raise Unsolved(left / size, USABLE)
        return x

    def _solve_refined(self, b: Floats, enough: float) -> tuple[Floats, float]:
        """Return x and the norm of its residual, after iterative refinement.

        Rounds end when the residual is at most `enough`, or no longer decreases.
        """
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

    def _correct_by_gmres(self, b: Floats, x: Floats, left: float) -> tuple[Floats, float]:
        """Return the better of x and its correction by GMRES, and the norm of the residual.

        `left` is the norm of the residual of x.
        """
        if not np.isfinite(left):
            return x, left
        # the import takes 0.14 s and is needed only if refinement is not enough
        from scipy.sparse.linalg import LinearOperator, gmres

        size = self.K.shape
        prior = LinearOperator(size, matvec=self.factor.solve, dtype=np.float64)
        y, _ = gmres(self.K, b, x0=x, rtol=ENOUGH, atol=0.0, restart=ROUNDS, maxiter=1, M=prior)
        after = float(np.linalg.norm(b - self.K @ y))
        return (y, after) if after < left else (x, left)


def factor(
    K: sparse.csr_matrix, spare: Floats, make: Callable[[sparse.csr_matrix], Factor], halved: bool = False
) -> Factor:
    """Return a solver for the saddle-point matrix K, refined from the factor of a more compressible matrix.

    `spare` (n,) is positive at the pressures and zero elsewhere. It is subtracted from the diagonal of K, and `make`
    factorises the result. If K is nearly symmetric, `halved` passes only the symmetric part to `make`; refinement
    corrects the difference. Raises the errors of `make`.
    """
    near = (0.5 * (K + K.T)).tocsr() if halved else K
    softened: Any = sparse.csr_matrix((near.data.copy(), near.indices, near.indptr), shape=K.shape)
    softened.setdiag(near.diagonal() - spare)  # the pattern of K has these entries, so it does not change
    return SaddlePointFactor(make(softened), K, int(np.count_nonzero(spare)))
