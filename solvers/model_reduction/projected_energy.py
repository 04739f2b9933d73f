"""Energies as functions of the unknowns q of a reduced model with displacements V q."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy import linalg as dense
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.linear.factorisations import Singular
from softmark.solvers.model_reduction.basis_products import expand, inner_products, project
from softmark.solvers.runtime.thread_limits import ALONE


def _full_stencil(r: int) -> Ints:
    """Return one stencil (1, r) that couples all r unknowns."""
    return np.arange(r, dtype=np.int64)[None]


@dataclass(frozen=True)
class ProjectedEnergy(Energy):
    """Energy E(V q) of a reduced model, from an energy E over the degrees of freedom of some nodes.

    V (dofs, r) holds the rows of the displacement fields at these degrees of freedom.
    """

    energy: Energy
    V: Floats

    @property
    def conservative(self) -> bool:
        """True if the full energy is conservative."""
        return self.energy.conservative

    @cached_property
    def stencils(self) -> Ints:
        """One stencil (1, r) that couples all unknowns."""
        return _full_stencil(self.V.shape[1])

    @cached_property
    def _local_assembly(self) -> Assembly:
        return Assembly(len(self.V), np.zeros(0, dtype=np.int64), [self.energy], [])

    @cached_property
    def _largest_singular_value(self) -> float:
        """Largest singular value of V."""
        return float(np.sqrt(np.linalg.eigvalsh(inner_products(self.V, self.V))[-1]))

    def rounding(self, x: Floats) -> float:
        """Return an upper bound of the rounding error of the gradient.

        It is the rounding error of the full gradient times the largest singular value of V.
        """
        return self._largest_singular_value * self.energy.rounding(expand(self.V, x))

    def value(self, x: Floats) -> float:
        """Return the energy, J."""
        return self.energy.value(expand(self.V, x))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add scale V^T dE/du to the gradient g (r,)."""
        forces = np.zeros(len(self.V))
        self.energy.add_gradient(expand(self.V, x), forces)
        g += scale * project(self.V, forces)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add scale V^T K V to the matrix entries `data`.

        With `projected` the stiffness K of the full model is made definite cell by cell.
        """
        block = inner_products(self.V, self._local_assembly.tangent(expand(self.V, x), 1.0, projected) @ self.V)
        keep = slots[0] >= 0
        data[slots[0][keep]] += scale * block[keep]


@dataclass(frozen=True)
class QuadraticEnergy(Energy):
    """Quadratic energy q . K q / 2 of a linear body, with a stiffness K (r, r) that is computed once."""

    K: Floats
    noise: float = 0.0  # norm of the gradient's rounding error
    conservative: bool = True

    @cached_property
    def stencils(self) -> Ints:
        """One stencil (1, r) that couples all unknowns."""
        return _full_stencil(len(self.K))

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error of the gradient, which is the same in every state."""
        return self.noise

    def value(self, x: Floats) -> float:
        """Return the energy, J."""
        return 0.5 * float(x @ self.K @ x)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add scale K q to the gradient g (r,)."""
        g += scale * (self.K @ x)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add scale K to the matrix entries `data`."""
        keep = slots[0] >= 0
        data[slots[0][keep]] += scale * self.K[keep]


@dataclass(frozen=True)
class DenseSolver:
    """Solver for the small dense linear systems of a reduced dynamic model, by Gaussian elimination (LAPACK)."""

    def solve(self, K: sparse.csr_matrix, b: Floats, tolerance: float) -> Floats:
        """Return the solution x of K x = b, accurate to rounding. Raises Singular."""
        try:
            with ALONE:
                x: Floats = dense.solve(K.toarray(), b, check_finite=False)
        except (dense.LinAlgError, dense.LinAlgWarning) as error:
            raise Singular(str(error)) from error
        if not np.all(np.isfinite(x)):
            raise Singular("the tangent contains numbers that are not finite")
        return x
