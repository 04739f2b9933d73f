"""Springs and dashpots spread over a part of a surface: a quadratic energy of the displacements there, and drag."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Dashpots, Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks


@dataclass(frozen=True)
class Bedding(Dashpots):
    """E = 1/2 int u . D u dA over undeformed facets (f, k), D = s 1 or s n (x) n of a stiffness s and the normal n.

    `K` (f, 3 k, 3 k) are the integrals of N_a N_b D, N/m, and the matrix of the dashpots is `lag` times that, s. This
    is Winkler's foundation, a boundary condition of Robin's (Hetenyi 1946, "Beams on Elastic Foundation", chapter 1).
    With `along` K is (f, k, k), of that component of the nodes alone.
    """

    grounded = True

    facets: Ints
    K: Floats
    lag: float = 0.0
    conservative: bool = True
    along: int | None = None

    @property
    def damps(self) -> bool:
        """Whether it has dashpots."""
        return self.lag > 0.0

    @cached_property
    def stencils(self) -> Ints:
        """Three degrees of freedom for each node of a facet (f, 3 k), or one (f, k)."""
        if self.along is not None:
            return 3 * self.facets + self.along
        return (3 * self.facets[:, :, None] + np.arange(3)).reshape(len(self.facets), -1)

    def forces(self, x: Floats) -> Floats:
        """K x of every facet (f, 3 k), N."""
        found: Floats = np.einsum("fab,fb->fa", self.K, np.asarray(x, dtype=np.float64)[self.stencils])
        return found

    def value(self, x: Floats) -> float:
        """What the springs store, J."""
        return 0.5 * float(np.vdot(x[self.stencils], self.forces(x)))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """What holds the springs as they are, N."""
        np.add.at(g, self.stencils, scale * self.forces(x))

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """K: the same in every state, and definite."""
        add_blocks(scale * self.K, slots, data)

    def rounding(self, x: Floats) -> float:
        """What the last digits of the displacements leave in its forces, N."""
        rows = np.linalg.norm(self.K, axis=(1, 2)) * np.abs(x[self.stencils]).max(axis=1, initial=0.0)
        return float(np.finfo(np.float64).eps * np.linalg.norm(rows))

    def add_drag(self, v: Floats, f: Floats) -> None:
        """What holds the dashpots at these speeds, N."""
        self.add_gradient(v, f, self.lag)

    def add_damping(self, data: Floats, slots: Ints) -> None:
        """The dashpots' matrix, N s/m."""
        add_blocks(self.lag * self.K, slots, data)
