"""Energies over the unknowns q of a reduced model, where displacements are V q."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy import linalg as dense
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.linear.factorisations import Singular
from softmark.solvers.model_reduction.basis_products import down, inner, up
from softmark.solvers.runtime.thread_limits import ALONE


def _whole(r: int) -> Ints:
    """One stencil of all unknowns (1, r)."""
    return np.arange(r, dtype=np.int64)[None]


@dataclass(frozen=True)
class Projected(Energy):
    """E(V q) of an energy over the degrees of freedom of some nodes; V (dofs, r) are the rows of the fields there."""

    energy: Energy
    V: Floats

    @property
    def conservative(self) -> bool:
        """As the energy."""
        return self.energy.conservative

    @cached_property
    def stencils(self) -> Ints:
        """All unknowns at once (1, r)."""
        return _whole(self.V.shape[1])

    @cached_property
    def _local(self) -> Assembly:
        return Assembly(len(self.V), np.zeros(0, dtype=np.int64), [self.energy], [])

    @cached_property
    def _stretch(self) -> float:
        """The largest singular value of V."""
        return float(np.sqrt(np.linalg.eigvalsh(inner(self.V, self.V))[-1]))

    def rounding(self, x: Floats) -> float:
        """Norm of what rounding leaves in the gradient: that of the energy's own, in the worst direction."""
        return self._stretch * self.energy.rounding(up(self.V, x))

    def value(self, x: Floats) -> float:
        """Energy, J."""
        return self.energy.value(up(self.V, x))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """g (r,) += scale V^T dE/du."""
        forces = np.zeros(len(self.V))
        self.energy.add_gradient(up(self.V, x), forces)
        g += scale * down(self.V, forces)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """V^T K V, made definite cell by cell where it is `projected`."""
        block = inner(self.V, self._local.tangent(up(self.V, x), 1.0, projected) @ self.V)
        keep = slots[0] >= 0
        data[slots[0][keep]] += scale * block[keep]


@dataclass(frozen=True)
class Quadratic(Energy):
    """q . K q / 2, K (r, r): a linear body, whose cells need not be visited again."""

    K: Floats
    noise: float = 0.0  # norm of what rounding leaves in the gradient
    conservative: bool = True

    @cached_property
    def stencils(self) -> Ints:
        """All unknowns at once (1, r)."""
        return _whole(len(self.K))

    def rounding(self, x: Floats) -> float:
        """Norm of what rounding leaves in the gradient."""
        return self.noise

    def value(self, x: Floats) -> float:
        """Energy, J."""
        return 0.5 * float(x @ self.K @ x)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """g += scale K q."""
        g += scale * (self.K @ x)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """K."""
        keep = slots[0] >= 0
        data[slots[0][keep]] += scale * self.K[keep]


@dataclass(frozen=True)
class Dense:
    """Solves the small full systems of a reduced model in motion, by Gauss's elimination (LAPACK)."""

    def solve(self, K: sparse.csr_matrix, b: Floats, tolerance: float) -> Floats:
        """x with K x = b to rounding. Raises Singular."""
        try:
            with ALONE:
                x: Floats = dense.solve(K.toarray(), b, check_finite=False)
        except (dense.LinAlgError, dense.LinAlgWarning) as error:
            raise Singular(str(error)) from error
        if not np.all(np.isfinite(x)):
            raise Singular("the tangent holds numbers that are not finite")
        return x
