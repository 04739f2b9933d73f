"""Elastic foundation: springs and dashpots distributed over part of a surface."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import DampedEnergy, Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks


@dataclass(frozen=True)
class ElasticFoundation(DampedEnergy):
    """Elastic foundation on undeformed facets (f, k): E = 1/2 int u . D u dA with D = s 1 or D = s n (x) n.

    s is the stiffness per area and n the normal. `K` (f, 3 k, 3 k) are the integrals of N_a N_b D, N/m. The dashpot
    matrix is the time `lag`, s, times K. If the component `along` is given, K is (f, k, k) and acts on that
    displacement component only. This is Winkler's foundation, a Robin boundary condition.
    Source: Hetenyi (1946), "Beams on Elastic Foundation", chapter 1.
    """

    resists_rigid_motion = True

    facets: Ints
    K: Floats
    lag: float = 0.0
    conservative: bool = True
    along: int | None = None

    @property
    def has_dashpots(self) -> bool:
        """True if the foundation has dashpots."""
        return self.lag > 0.0

    @cached_property
    def stencils(self) -> Ints:
        """Three degrees of freedom for each node of a facet (f, 3 k), or one (f, k) if `along` is given."""
        if self.along is not None:
            return 3 * self.facets + self.along
        return (3 * self.facets[:, :, None] + np.arange(3)).reshape(len(self.facets), -1)

    def forces(self, x: Floats) -> Floats:
        """Return the force K x of every facet (f, 3 k), N."""
        found: Floats = np.einsum("fab,fb->fa", self.K, np.asarray(x, dtype=np.float64)[self.stencils])
        return found

    def value(self, x: Floats) -> float:
        """Return the energy stored in the springs, J."""
        return 0.5 * float(np.vdot(x[self.stencils], self.forces(x)))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the forces that deform the springs, N."""
        np.add.at(g, self.stencils, scale * self.forces(x))

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the stiffness K, N/m: constant and positive semi-definite."""
        add_blocks(scale * self.K, slots, data)

    def rounding(self, x: Floats) -> float:
        """Return the rounding error of the forces, N, due to the last digits of the displacements."""
        rows = np.linalg.norm(self.K, axis=(1, 2)) * np.abs(x[self.stencils]).max(axis=1, initial=0.0)
        return float(np.finfo(np.float64).eps * np.linalg.norm(rows))

    def add_drag(self, v: Floats, f: Floats) -> None:
        """Add the forces that drive the dashpots at velocities v, N."""
        self.add_gradient(v, f, self.lag)

    def add_damping(self, data: Floats, slots: Ints) -> None:
        """Add the damping matrix of the dashpots, N s/m."""
        add_blocks(self.lag * self.K, slots, data)
